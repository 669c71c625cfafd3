"""Files that processes of this user have fetched, by digest, in the user's cache folder.

The folder is bounded: the longest unused files are removed first. A damaged file is removed and fetched again; a folder
that cannot be written is none.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, MutableMapping
from contextlib import suppress
from pathlib import Path
from typing import Final

import platformdirs

from foosim.world.matter.mesh import digest_of

CACHE_BYTES_MAX: Final = 1 << 30


class FileCache(MutableMapping[str, bytes]):
    """Contents by digest (hex)."""

    def __init__(self, folder: Path | None = None, bytes_max: int = CACHE_BYTES_MAX) -> None:
        """`folder` is that of the user, if none is given."""
        self._folder = platformdirs.user_cache_path("foosim") / "files" if folder is None else folder
        self._bytes_max = bytes_max

    def __getitem__(self, digest: str) -> bytes:
        path = self._folder / digest
        try:
            content = path.read_bytes()
            if digest_of(content) == digest:
                os.utime(path)
                return content
            path.unlink()
        except OSError:
            pass
        raise KeyError(digest)

    def __setitem__(self, digest: str, content: bytes) -> None:
        part = self._folder / f".{digest}.{os.getpid()}"
        with suppress(OSError):
            self._folder.mkdir(parents=True, exist_ok=True)
            self._make_room(len(content))
            try:
                part.write_bytes(content)
                part.replace(self._folder / digest)
            finally:
                part.unlink(missing_ok=True)

    def __delitem__(self, digest: str) -> None:
        (self._folder / digest).unlink(missing_ok=True)

    def __iter__(self) -> Iterator[str]:
        return iter([path.name for _, _, path in self._files()])

    def __len__(self) -> int:
        return len(self._files())

    def _files(self) -> list[tuple[int, int, Path]]:
        """Return last use, size and path of the files, the longest unused first."""
        found = []
        with suppress(OSError):
            for path in self._folder.iterdir():
                with suppress(OSError):
                    about = path.stat()
                    found.append((about.st_mtime_ns, about.st_size, path))
        return sorted(found)

    def _make_room(self, size: int) -> None:
        files = self._files()
        left = self._bytes_max - size - sum(its for _, its, _ in files)
        for _, its, path in files:
            if left >= 0:
                break
            path.unlink(missing_ok=True)
            left += its
