"""Public robots, and small ones of the forms that are rare: each is read or refused as the table has it."""

from __future__ import annotations

from difflib import unified_diff
from typing import Final

import pytest

from tests.corpus.running import Running, needed
from tests.corpus.table import OWN, PUBLIC, SETS, files_of, lines_of, table

HEAVY: Final = pytest.mark.campaign
READ_MIN: Final = 0.8
"""The least share of public robots that are read as they are."""


@pytest.mark.parametrize(
    ("which", "is_light"),
    [(which, True) for which in SETS] + [pytest.param(which, False, marks=HEAVY) for which in PUBLIC],
)
def test_robots_are_read_or_refused_as_the_table_says(which: str, is_light: bool) -> None:
    """Those with large meshes in `make corpus` only."""
    folder = needed(which)
    now = lines_of(which, folder, is_light=is_light)
    names = tuple(f"{name}: " for name in files_of(which, folder, is_light=is_light))
    before = [line for line in table()[which] if line.startswith(names)]
    changes = "\n".join(unified_diff(before, now, "tests/corpus/table.txt", "as read now", lineterm="", n=0))
    assert not changes, f"`python -m tests.corpus.table` writes the table anew:\n{changes}"


@pytest.mark.parametrize("which", SETS)
def test_the_table_has_all_files(which: str) -> None:
    folder = needed(which)
    files = {**files_of(which, folder, is_light=True), **files_of(which, folder, is_light=False)}
    assert [line.partition(": ")[0] for line in table()[which]] == sorted(files)


def test_most_public_robots_are_read_as_they_are() -> None:
    lines = [line for which in PUBLIC for line in table()[which]]
    refused = [line for line in lines if ": refused, " in line]
    assert len(lines) >= 160
    assert len(refused) <= (1.0 - READ_MIN) * len(lines), "\n".join(refused)


READ: Final = [line.partition(": ")[0] for which in SETS for line in table()[which] if ": refused, " not in line]


@pytest.mark.parametrize("name", [name if name.startswith(OWN) else pytest.param(name, marks=HEAVY) for name in READ])
def test_proposed_entries_run(name: str) -> None:
    """Each robot that is read starts on the floor, not in it, and no joint leaves its limits. Public ones do so in
    `make corpus` only."""
    which, _, path = name.partition("/")
    with Running(which, path) as robot:
        robot.step(0.2)
