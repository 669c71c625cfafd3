"""Each command that reads a deployment, with one whose robots are files: they are found from any folder."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import pytest

from tests.conftest import Typed

YARD: Final = Path(__file__).parents[2] / "deploy" / "yard.yaml"
NO_SIDES: Final = f"{YARD}: a match needs a world with a rule that keeps the score of two sides\n"


@pytest.mark.parametrize(
    ("words", "code", "err"),
    [
        (("match", "team", "team", "--deployment", YARD), 2, NO_SIDES),
        (("net", "lint", YARD), 0, ""),
        (("check", YARD), 0, ""),
        (("rehearse", YARD, "--for", "10 ms"), 0, ""),
    ],
)
def test_files_of_robots_are_found(words: tuple[Any, ...], code: int, err: str, typed: Typed) -> None:
    done = typed()(*words)
    assert done.code == code and done.err.startswith(err), done.err
