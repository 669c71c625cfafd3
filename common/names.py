"""Names: their rules, and the nearest valid name for an error message.

Names end up in file names, keys of the wire, captures and terminals: so they are short, lower case and plain.
"""

import difflib
import re
from collections.abc import Iterable
from itertools import takewhile
from typing import Final

from foosim.common.limits import NAME_LENGTH_MAX

SELECTOR_LENGTH_MAX: Final = 64

NAME_PATTERN: Final = r"^[a-z][a-z0-9_-]*$"
NAME_RULE: Final = (
    f"a name is a lower case letter, then lower case letters, digits, - and _, at most {NAME_LENGTH_MAX} in all"
)
"""The same as a text for people."""
ROBOT_NAME_PATTERN: Final = r"^[a-z][a-z0-9_-]*(\.[a-z0-9_-]+)*$"
SELECTOR_PATTERN: Final = r"^[a-z0-9_.*?-]+$"
CLASS_PATTERN: Final = r"^[A-Za-z_][A-Za-z0-9_]*(\.[A-Za-z_][A-Za-z0-9_]*)*:[A-Za-z_][A-Za-z0-9_]*$"

# Reserved names: of processes other than nodes and players, for nodes, players and clients.
PROCESS_NAMES_RESERVED: Final = ("supervisor", "vhub")
CHANNEL_ECHO: Final = "echo"
"""The channel that every robot has; no component may have this name."""

SIMILAR: Final = 0.6
"""Similarity from which a name is suggested: 0 is nothing in common, 1 is equal but for capitals."""

_NAME = re.compile(NAME_PATTERN)
_SELECTOR = re.compile(SELECTOR_PATTERN)
_ROBOT_NAME = re.compile(ROBOT_NAME_PATTERN)


def is_name(text: str) -> bool:
    """True for the name of a node, player, client, channel, world or link rule."""
    return len(text) <= NAME_LENGTH_MAX and _NAME.fullmatch(text) is not None


def is_robot_name(text: str) -> bool:
    """True for the name of a robot: names joined by dots, as in `red.attack`."""
    return len(text) <= NAME_LENGTH_MAX and _ROBOT_NAME.fullmatch(text) is not None


def is_selector(text: str) -> bool:
    """True for a pattern of endpoints: a name in which * and ? are wildcards."""
    return len(text) <= SELECTOR_LENGTH_MAX and _SELECTOR.fullmatch(text) is not None


def class_path_of(text: str) -> str | None:
    """Return the class path that `module.Class` was meant to be; None where it names no class: those have capitals."""
    module, _, name = text.rpartition(".")
    path = f"{module}:{name}"
    return path if name[:1].isupper() and re.fullmatch(CLASS_PATTERN, path) else None


def nearest_name(value: object, choices: Iterable[str], similar: float = SIMILAR) -> str | None:
    """The choice most similar to the value; None without one.

    Ties go to the longest common prefix, then to the first by name.
    """
    text = str(value)[: 2 * SELECTOR_LENGTH_MAX]
    best, best_likeness = None, (0.0, 0)
    matcher = difflib.SequenceMatcher(autojunk=False)
    matcher.set_seq2(text.lower())
    for choice in sorted(set(choices)):
        matcher.set_seq1(choice.lower())
        enough = max(similar, best_likeness[0])
        if matcher.real_quick_ratio() < enough or matcher.quick_ratio() < enough:
            continue  # both are upper bounds
        likeness = (matcher.ratio(), _common_start(choice.lower(), text.lower()))
        if likeness[0] >= similar and likeness > best_likeness:
            best, best_likeness = choice, likeness
    return best


def nearest_quoted(value: object, choices: Iterable[str]) -> str | None:
    """The choice most similar to the value, in quotes as in messages; None without one."""
    return quoted(nearest_name(value, choices))


def quoted(name: str | None) -> str | None:
    """A name in quotes, None without one."""
    return None if name is None else repr(name)


def _common_start(one: str, other: str) -> int:
    """Length of the common prefix of two texts."""
    pairs = zip(one, other, strict=False)
    return sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], pairs))
