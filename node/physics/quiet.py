"""Keeps one known line of a compiled library off the terminal.

Such a library writes to the file descriptors themselves, past `sys.stderr`.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import Final

STANDARD_STREAMS: Final = (1, 2)


@contextmanager
def without_lines(start: bytes) -> Iterator[None]:
    """Drop lines with this beginning that are written meanwhile; all other lines come out at the end.

    Other threads may write meanwhile, and no error may be lost, so unknown lines pass.
    """
    kept = {stream: os.dup(stream) for stream in STANDARD_STREAMS if _is_open(stream)}
    with ExitStack() as stack:
        files = {stream: stack.enter_context(tempfile.TemporaryFile()) for stream in kept}
        try:
            for stream, file in files.items():
                os.dup2(file.fileno(), stream)
            yield
        finally:
            for stream, original in kept.items():
                os.dup2(original, stream)
                os.close(original)
            for stream, file in files.items():
                file.seek(0)
                os.write(stream, b"".join(line for line in file if not line.startswith(start)))


def _is_open(stream: int) -> bool:
    try:
        os.fstat(stream)
    except OSError:
        return False
    return True
