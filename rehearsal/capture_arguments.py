"""What the commands of `foosim-replay` have in common: their arguments, and what is wrong with a file as bad input."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from foosim.protocol.errors import Refused, read_at
from foosim.protocol.units import parse_ns
from foosim.vhub.mcap_checks import CaptureError


class BadCapture(Refused):
    """A file that is no capture, or is damaged, is bad input."""

    exit_code = 2


@contextmanager
def reading() -> Iterator[None]:
    """Have what is wrong with the file end the command as bad input."""
    try:
        yield
    except CaptureError as error:
        raise BadCapture(str(error)) from None


Capture = Annotated[Path, typer.Argument(help="The capture, an MCAP file.", show_default=False)]
Json = Annotated[bool, typer.Option("--json", help="Print JSON, for scripts.")]


def time_of(option: str, text: str | None) -> int | None:
    """Return the simulated time in ns that an option says, None without one; raises BadValue, which names it."""
    return None if text is None else read_at(option, parse_ns, text)
