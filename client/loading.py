"""Finds the class that a deployment names as `module:Class`, and checks it without calling it.

A user's module may print, raise, exit, crash or hang when it is imported. What it prints goes to standard error. One
that crashes ends this process, and so does one that hangs, at a limit: its stack is written to standard error first.
"""

from __future__ import annotations

import faulthandler
import importlib
import inspect
import sys
from collections.abc import Callable, Iterable
from contextlib import redirect_stdout
from typing import TYPE_CHECKING, Any, Final

from foosim.client.errors import PlayerError
from foosim.client.player import Player
from foosim.common.errors import BadValue
from foosim.common.finding import Finding
from foosim.world.component_types.failures import place_of_code
from foosim.world.component_types.registry import class_at

if TYPE_CHECKING:
    from foosim.deployment.schema import Deployment

MADE_WITH: Final = ("deployment", "parameters")
CALLED_WITH: Final = ("tick", "samples")
SHOWN_MAX: Final = 100
"""How much of a signature is shown."""


class ClassPathError(PlayerError):
    """A class path that leads to no player: `problem` is the reason, `nearest` a path that might be meant."""

    def __init__(self, path: str, problem: str, nearest: str | None = None) -> None:
        super().__init__(f"player {path}: {problem}" + (f", nearest is {nearest}" if nearest else ""))
        self.problem, self.nearest = problem, nearest


def look_in(folder: str) -> None:
    """Have modules be found in a folder, too, after everywhere else: in that of a deployment's file."""
    if folder not in sys.path:
        sys.path.append(folder)
        importlib.invalidate_caches()


def load_player(path: str) -> Callable[..., Any]:
    """Import the class that `module:Class` names and return it. Raises ClassPathError."""
    try:
        made: Callable[..., Any] = class_at(path, "beside the deployment or on PYTHONPATH")
    except BadValue as error:
        raise ClassPathError(path, error.problem, error.nearest) from error.__cause__
    problem = _unfit(made, path.partition(":")[2])
    if problem:
        raise ClassPathError(path, problem)
    return made


def player_findings(deployment: Deployment, names: Iterable[str]) -> list[Finding]:
    """Return the problems of these players' classes, each at its place in the deployment.

    All modules together may take as long as `deadlines.start`.
    """
    paths = {name: deployment.players[name].class_ for name in sorted(names)}
    faults = class_faults(paths.values(), deployment.deadlines.start_ns / 1e9)
    return [
        Finding(("players", name, "class"), faults[path].problem, path, faults[path].nearest)
        for name, path in paths.items()
        if path in faults
    ]


def class_faults(paths: Iterable[str], limit_s: float) -> dict[str, ClassPathError]:
    """Return the problems of class paths, by path; valid paths are left out."""
    found: dict[str, ClassPathError] = {}
    if not faulthandler.is_enabled():
        faulthandler.enable(2)
    faulthandler.dump_traceback_later(limit_s, exit=True, file=2)
    try:
        with redirect_stdout(sys.stderr):
            for path in sorted(set(paths)):
                try:
                    load_player(path)
                except ClassPathError as error:
                    found[path] = error
    finally:
        faulthandler.cancel_dump_traceback_later()
    return found


def _unfit(made: Any, name: str) -> str:
    """Return why something is no player's class, as far as that shows without calling it; empty when it may be one."""
    if not inspect.isclass(made):
        return f"{name} is no class, {made!r:.{SHOWN_MAX}}"
    if not issubclass(made, Player):
        return f"{name} is no Player{place_of_code(made)}; write: from foosim import Player, class {name}(Player):"
    if inspect.isabstract(made):
        return f"{name} is abstract: it cannot be instantiated"
    taken = _other_arguments(made, *MADE_WITH)
    if taken:
        return f"{name} cannot be made with ({', '.join(MADE_WITH)}): its constructor takes {taken}"
    method: Any = inspect.getattr_static(made, "act")
    if inspect.isfunction(method):
        taken = _other_arguments(method, "self", *CALLED_WITH)
    elif isinstance(method, staticmethod | classmethod):
        taken = _other_arguments(made.act, *CALLED_WITH)
    return f"{name}.act cannot be called with ({', '.join(CALLED_WITH)}): it takes {taken}" if taken else ""


def _other_arguments(call: Callable[..., Any], *arguments: str) -> str:
    """Return the parameters of a callable that these arguments do not fit; empty where they fit, or may."""
    try:
        signature = inspect.signature(call)
    except (ValueError, TypeError):  # of C code without a signature
        return ""
    try:
        signature.bind(*arguments)
    except TypeError:
        text = str(signature)
        return text if len(text) <= SHOWN_MAX else f"{text[: SHOWN_MAX - 3]}..."
    return ""
