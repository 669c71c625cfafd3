"""Errors of user code on one line: the exception, and the place in the user's files."""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from inspect import findsource, getsourcefile, unwrap
from traceback import walk_tb
from types import FrameType
from typing import Any, Final

OURS: Final = "foosim"
TEXT_LENGTH_MAX: Final = 500
"""A longer text of an error is cut."""
VALUE_LENGTH_MAX: Final = 80


class ContractError(Exception):
    """A method of a component has returned an invalid value; `method` has the place to change."""

    def __init__(self, method: Callable[..., Any], needed: str, given: object) -> None:
        name = getattr(method, "__name__", type(method).__name__)
        super().__init__(f"{name}() returned {_value(given)}; expected {needed}")
        self.method = method


def _value(given: object) -> str:
    text = f"a {type(given).__name__}"
    with suppress(Exception):  # the user's own code, too
        text = repr(given)
    return text if len(text) <= VALUE_LENGTH_MAX else f"{text[: VALUE_LENGTH_MAX - 3]}..."


def failure_of(error: BaseException, module: str = "") -> str:
    """Return `RuntimeError: at import (raises.py:3)` for an error that importing or calling a module has raised.

    The place is in the innermost frame of that module's package, or of others outside of libraries. Without a module it
    is that of the first call outside of foosim.
    """
    kind, text = type(error).__name__, "its text cannot be read"
    with suppress(Exception):  # the user's own code, too
        message = error.msg if isinstance(error, SyntaxError) else str(error)  # which ends with its place
        text = " ".join(message.split())
    text = text if len(text) <= TEXT_LENGTH_MAX else f"{text[: TEXT_LENGTH_MAX - 3]}..."
    if isinstance(error, ContractError):
        return text + place_of_code(error.method)
    return (f"{kind}: {text}" if text else kind) + _place_of(error, module)


def _place_of(error: BaseException, module: str) -> str:
    if isinstance(error, SyntaxError) and error.filename:
        return f" ({_shown(error.filename)}:{error.lineno})"
    frames = [*walk_tb(error.__traceback__)]
    module = module or next((package for frame, _ in frames if (package := _package(frame)) != OURS), "")
    own = [at for at in frames if _is_own(at[0], module)]
    if own:
        frame, line = own[-1]
        return f" ({_shown(frame.f_code.co_filename)}:{line})"
    return ""


def place_of_code(made: Any) -> str:
    """Return ` (file:line)` of the first line of a method or class; empty of one outside of Python."""
    with suppress(OSError, TypeError):  # without source
        made = unwrap(getattr(made, "__func__", made))
        code = getattr(made, "__code__", None)
        if code is not None:
            return f" ({_shown(code.co_filename)}:{code.co_firstlineno})"
        return f" ({_shown(getsourcefile(made) or '')}:{findsource(made)[1] + 1})"
    return ""


def _package(frame: FrameType) -> str:
    return str(frame.f_globals.get("__name__", "")).partition(".")[0]


def _is_own(frame: FrameType, module: str) -> bool:
    """Whether a frame is in a module's package, outside of libraries and foosim, or in that module of foosim's."""
    package = _package(frame)
    if package == OURS:
        return frame.f_globals.get("__name__") == module
    file = frame.f_code.co_filename
    return package == module.partition(".")[0] or not (file.startswith("<") or in_library(file))


def in_library(file: str) -> bool:
    """Whether a file is one of Python's own modules or of an installed package."""
    return file.startswith(_libraries())


@cache
def _libraries() -> tuple[str, ...]:
    import site  # takes longer than all else here, and few processes need it
    import sysconfig

    paths = sysconfig.get_paths()
    own = {paths[key] for key in ("stdlib", "platstdlib", "purelib", "platlib")}
    return tuple(f"{folder}/" for folder in {*own, *site.getsitepackages(), site.getusersitepackages()})


def _shown(file: str) -> str:
    """Return a file's path inside its folder of the path."""
    folders = [f"{folder}/" for folder in sys.path if folder and file.startswith(f"{folder}/")]
    return file.removeprefix(max(folders, key=len, default=""))
