"""Captures of short runs, shared with the tests of replays."""

from pathlib import Path

import pytest

from foosim.simulation.run import rehearse
from tests.simulation.conftest import SETS, TABLE, TICKS, bad_files, disturb, run

__all__ = ["bad_files", "run", "split_run"]


@pytest.fixture(scope="session")
def split_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same run in several files; not to be changed."""
    path = tmp_path_factory.mktemp("split") / "run.mcap"
    sets = (*SETS, "capture.split_time=150 ms")
    rehearse(TABLE.read_text(), TABLE.name, TICKS, 2, sets, prepare=disturb, capture=path)
    return path
