"""The command `foosim sweep`: options and study files, exit codes, Ctrl-C."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import pytest

from foosim.cli import sweep as command
from foosim.simulation.study.table import read_table
from tests.conftest import Typed

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"


def test_options_go_before_a_study_file_and_failed_rows_give_exit_code_1(typed: Typed, tmp_path: Path) -> None:
    study, out = tmp_path / "study.yaml", tmp_path / "out.csv"
    study.write_text(
        f"deployment: {TABLE}\nfor: 1h\nseeds: 1..9\nvary: {{table.ball.mass: [21 g, heavy]}}\nset: [engine=pure]\n"
    )
    for ran in ("2 in ", "0 in "):
        done = typed("sweep")(study, "--for", "20ms", "--seeds", "7", "--out", out, "--jobs", "1")
        assert done.code == 1, done.err
        assert done.out.startswith(f"2 of 2 runs, 1 failed, in {out}: {ran}")
    rows = read_table(out).rows
    assert [(row["seed"], row.get("ticks")) for row in rows] == [(7, 10), (7, None)]
    assert "heavy" in rows[1]["message"]


def test_ctrl_c_before_the_first_run_has_its_exit_code(
    typed: Typed, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(command, "sweep", interrupted)
    done = typed("sweep")(TABLE, "--for", "1s", "--out", tmp_path / "out.csv")
    assert done.code == 130 and done.err.startswith("interrupted, the same command continues the sweep")


@pytest.mark.parametrize(
    ("words", "code", "problem"),
    [
        ([], 2, "--for is missing"),
        (["--for", "1s", "--vary", "x"], 2, "--vary: not of the form PATH=VALUE,VALUE, 'x'"),
        (["--for", "1s", "--vary", "seed=1", "--vary", "seed=2"], 2, "--vary: the parameter is there twice, 'seed'"),
        (["--for", "1s", "--seeds", "5..1"], 2, "--seeds: a range without a value"),
        (["--for", "1s", "--limit", "fast"], 2, "--limit: not a time"),
        (["--for", "1s", "--jobs", "2", "--dask", "tcp://127.0.0.1:1"], 2, "--jobs: the workers of --dask"),
        (["--for", "1s", "--out", "nowhere/out.csv"], 1, "nowhere/out.csv: cannot be written"),
    ],
)
def test_bad_input_is_refused_without_a_traceback(typed: Typed, words: list[str], code: int, problem: str) -> None:
    done = typed("sweep")(TABLE, *words)
    assert done.code == code, done.err
    assert problem in done.err and "Traceback" not in done.err
