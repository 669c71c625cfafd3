"""Files that commands write: none is overwritten, and one that could not be written to its end does not stay."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from shutil import rmtree

from foosim.common.errors import BadValue, Failed, Refused


class Existing(Refused):
    """There is a file already where one is to be written."""


def check_name(option: str, out: Path, what: str, endings: tuple[str, ...]) -> None:
    """Raise BadValue for a name with another ending than `what` has, before anything is computed for it.

    Raises Existing where something is there already, and Failed where no file can be made.
    """
    if out.suffix.lower() not in endings:
        raise BadValue(f"{option}: the name of {what} ends with {' or '.join(endings)}", str(out))
    check_absent(out)
    check_writable(out)


def check_writable(out: Path) -> None:
    """Raise Failed where no file can be made, or replaced."""
    part = _part(out)
    try:
        part.touch()
        part.unlink()
    except OSError as error:
        raise _failed(out, error) from None


def check_absent(out: Path) -> None:
    if os.path.lexists(out):
        raise Existing(f"{out}: exists already, and is not overwritten")


@contextmanager
def new_file(out: Path) -> Iterator[Path]:
    """Give the name to write to; the file, or the folder made there, gets its own name, `out`, when it is whole.

    Raises Existing, and Failed when it cannot be written.
    """
    check_absent(out)
    with written(out) as part:
        yield part


@contextmanager
def written(out: Path) -> Iterator[Path]:
    """Give the name to write to, as `new_file` does; the file replaces another one. Raises Failed."""
    part = _part(out)
    try:
        yield part
        part.rename(out)
        sync_folder(out.parent)
    except OSError as error:
        raise _failed(out, error) from None
    finally:
        rmtree(part, ignore_errors=True)
        with suppress(OSError):
            part.unlink(missing_ok=True)


def sync_folder(folder: Path) -> None:
    """Bring the names of a folder's files to the disk; raises OSError."""
    opened = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        os.fsync(opened)
    finally:
        os.close(opened)


def _part(out: Path) -> Path:
    """Return the name of a file until it is whole."""
    return out.with_name(f".{out.name}.part")


def _failed(out: Path, error: OSError) -> Failed:
    return Failed(f"{out}: cannot be written, {error.strerror or error}")
