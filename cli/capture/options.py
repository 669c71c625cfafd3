"""Shared by commands that read captures: arguments, and bad files as bad input."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from foosim.capture.mcap.checks import CaptureError
from foosim.common.errors import Refused, read_at
from foosim.common.units import parse_ns


class BadCapture(Refused):
    """A file is no capture, or is damaged: bad input."""

    exit_code = 2


@contextmanager
def reading() -> Iterator[None]:
    """Turn a CaptureError into BadCapture, which ends the command with exit code 2."""
    try:
        yield
    except CaptureError as error:
        raise BadCapture(str(error)) from None


Capture = Annotated[Path, typer.Argument(metavar="CAPTURE", help="The capture, an MCAP file.")]


def time_of(option: str, text: str | None) -> int | None:
    """Return an option's simulated time in ns, None without one; raises BadValue with the option's name."""
    return None if text is None else read_at(option, parse_ns, text)
