"""The checksum of the existing part of a file that a writer continues."""

from __future__ import annotations

import os
from threading import Thread
from typing import Final
from zlib import crc32

_PIECE_BYTES: Final = 1 << 20


class EarlierCrc:
    """The CRC-32 of a file's first bytes, read by a thread of its own: the run does not wait for it."""

    def __init__(self, file: int, size: int) -> None:
        self.size = size
        self._crc = 0
        self._error: OSError | None = None
        self._thread = Thread(target=self._run, args=(os.dup(file),), name="capture-crc", daemon=True)
        self._thread.start()

    def value(self) -> int:
        """Wait for it. Raises OSError when the file could not be read."""
        self._thread.join()
        if self._error is not None:
            raise self._error
        return self._crc

    def _run(self, file: int) -> None:
        try:
            at = 0
            while at < self.size:
                piece = os.pread(file, min(_PIECE_BYTES, self.size - at), at)
                if not piece:
                    raise OSError(0, f"it ends at byte {at}")
                self._crc = crc32(piece, self._crc)
                at += len(piece)
        except OSError as error:
            self._error = error
        finally:
            os.close(file)
