"""The world is open: no package but those of worlds and of what plays in them names what a kind of world is made of.

They read the source as text: comments, docstrings and what people are told count as names do. Whoever adds a world adds
files to `world/`; a word here would say that something else knows of one.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import pytest

ROOT: Final = Path(__file__).parents[1]
PACKAGES: Final = (
    *(
        "analysis",
        "capture",
        "cli",
        "client",
        "common",
        "console",
        "deployment",
        "gateways",
        "kernels",
        "launcher",
        "node",
    ),
    *("protocol", "rendering", "runtime", "simulation", "supervisor", "vhub"),
)
ENDINGS: Final = {".py", ".js", ".ts", ".mjs", ".html", ".css"}
BUNDLES: Final = ("console", "www")
"""Made from the sources of the page, with libraries in whose minified names anything can stand."""
WORDS: Final = ("rod", "rover", "ball", "goal")
_ANY: Final = "|".join(WORDS)
_CAPITAL: Final = "|".join(word.capitalize() for word in WORDS)
WORD: Final = re.compile(
    rf"(?<![a-zA-Z])(?:{_ANY}|{_CAPITAL})s?(?![a-z])"  # `ball`, `ball_ticks`, `stray_balls`, `goal2`, `ballPosition`
    rf"|(?<=[a-z0-9])(?:{_CAPITAL})s?(?![a-z])"  # `aBall`, `tableBallSpeed`
    rf"|(?<![a-zA-Z])(?:{_ANY.upper()})S?(?![a-zA-Z])"  # `BALL`, `OF_RODS`
)


def sources() -> Iterator[Path]:
    """Every source file of the packages, and what builds them."""
    yield ROOT / "setup.py"
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*")):
            parts = path.relative_to(ROOT).parts
            if path.suffix in ENDINGS and parts[:2] != BUNDLES and not {"test", "node_modules"} & {*parts}:
                yield path


def test_packages_outside_of_worlds_name_nothing_of_a_world() -> None:
    found = list(sources())
    assert len(found) > 300 and {path.relative_to(ROOT).parts[0] for path in found} == {"setup.py", *PACKAGES}
    named = [
        f"{path.relative_to(ROOT)}:{number}: {word[0]!r} in {line.strip()[:100]}"
        for path in found
        for number, line in enumerate(path.read_text().splitlines(), 1)
        if (word := WORD.search(line))
    ]
    named += [str(path.relative_to(ROOT)) for path in found if WORD.search(path.stem)]
    assert not named, "only world/ and library/ may know what a world is made of:\n" + "\n".join(named)


FOUND: Final = "balls Rover rover01 red.goal BALL ROVERS ball_ticks _stray_balls free_ball RodRobot meet_rod OF_BALL"


@pytest.mark.parametrize("text", [*FOUND.split(), "ballSpeed", "theBall"])
def test_a_word_is_found_in_whatever_case_and_part_of_a_name(text: str) -> None:
    assert WORD.search(text)


@pytest.mark.parametrize("text", ["product", "period", "method", "balloon", "global", "Rodrigues", "eyeball", "goalie"])
def test_a_word_in_another_word_is_none(text: str) -> None:
    assert not WORD.search(text)
