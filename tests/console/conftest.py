"""Captures of short runs, shared with the tests of replays."""

from tests.simulation.conftest import bad_files, run, split_run

__all__ = ["bad_files", "run", "split_run"]
