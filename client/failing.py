"""Error reports of players whose own code raised: player, time, error, and the place in the user's files."""

from __future__ import annotations

import site
import sysconfig
import traceback
from contextlib import suppress
from functools import cache
from types import FrameType
from typing import TYPE_CHECKING, Final

from foosim.client.errors import PlayerError

if TYPE_CHECKING:
    from foosim.client.core import ClientCore

OURS: Final = "foosim"
TEXT_LENGTH_MAX: Final = 500
"""A longer text of an error is cut: its whole is in the traceback."""


class PlayerFailed(PlayerError):
    """A player's own code raised. `trace` is the whole traceback, for the log."""

    def __init__(self, what: str, trace: str) -> None:
        super().__init__(what)
        self.trace = trace


class Unanswered(BaseException):
    """Raised in a player that does not return, to end it; the text says how long it was waited for."""


def failed(where: str, error: BaseException, module: str) -> PlayerFailed:
    """Return the error that ends a player of the class of `module`; `where` has the player and the time."""
    return PlayerFailed(f"{where}: {describe(error)}{place_of(error, module)}", _trace_of(error))


def report_failure(core: ClientCore, error: PlayerError | Unanswered) -> None:
    """Make a player's core report why its process ends."""
    trace = error.trace if isinstance(error, PlayerFailed) else ""
    core.fail(str(error), _trace_of(error) if isinstance(error, Unanswered) else trace)


def _trace_of(error: BaseException) -> str:
    return "".join(traceback.format_exception(error)).rstrip()


def describe(error: BaseException) -> str:
    """An error of user code on one line, bounded."""
    kind, text = type(error).__name__, "its text cannot be made"
    with suppress(Exception):  # the user's own code, too
        said = error.msg if isinstance(error, SyntaxError) else str(error)  # which has its place behind it
        text = " ".join(said.split())
    text = text if len(text) <= TEXT_LENGTH_MAX else f"{text[: TEXT_LENGTH_MAX - 3]}..."
    return f"{kind}: {text}" if text else kind


def place_of(error: BaseException, module: str) -> str:
    """Return ` (file:line: code)` of the last frame in the user's own files; of the last one at all where none is.

    Of code that cannot be compiled it is that code's.
    """
    if isinstance(error, SyntaxError) and error.filename:
        code = f": {error.text.strip()}" if error.text else ""
        return f" ({error.filename}:{error.lineno}{code})"
    frames = [(frame, line) for frame, line in traceback.walk_tb(error.__traceback__)]
    found = next((at for at in reversed(frames) if _is_own(at[0], module)), frames[-1] if frames else None)
    if found is None:
        return ""
    (summary,) = traceback.StackSummary.extract([found])
    code = f": {summary.line}" if summary.line else ""
    return f" ({summary.filename}:{summary.lineno}{code})"


def _is_own(frame: FrameType, module: str) -> bool:
    """Whether a frame is in the package of the player's class, or in no library and not in foosim."""
    name = str(frame.f_globals.get("__name__", ""))
    package = name.partition(".")[0]
    if package == module.partition(".")[0]:
        return True
    file = frame.f_code.co_filename
    return package != OURS and not file.startswith("<") and not in_library(file)


def in_library(file: str) -> bool:
    """Whether a file is one of Python's own modules or of an installed package."""
    return file.startswith(_libraries())


@cache
def _libraries() -> tuple[str, ...]:
    """Where Python's own modules and installed ones are."""
    paths = sysconfig.get_paths()
    own = {paths[key] for key in ("stdlib", "platstdlib", "purelib", "platlib")}
    return tuple(f"{folder}/" for folder in sorted({*own, *site.getsitepackages(), site.getusersitepackages()}))
