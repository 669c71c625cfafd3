"""Sweeps: the same table however it came to be, a row for each run whatever becomes of it, and what is refused."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np
import pytest

import foosim
from foosim.common.errors import BadValue, DeploymentError, Refused
from foosim.simulation.study.study import Study, seeds_of, study_of, text_of, values_of
from foosim.simulation.study.sweep import Progress, sweep
from foosim.simulation.study.table import Table, read_table, write_table
from foosim.simulation.workers import executor_here

TABLE: Final = Path(__file__).parents[3] / "deploy" / "table.yaml"
DELAY: Final = "network.links.0.delay"
RATE: Final = "robots.*.sensors.encoder.rate"
VARY: Final = {DELAY: ("0ms", "30ms"), RATE: ("100Hz", "50Hz")}
PURE: Final = ("engine=pure",)
PLAYER: Final = """
from foosim import Player, Turn
import math, os, time
class Odd(Player):
    def __init__(self, deployment, parameters):
        self.does, self.seed = parameters["does"], deployment.seed
    def act(self, tick, samples):
        turn = Turn({})
        turn.report("tick", tick)
        if self.seed == 2:
            exec(self.does)
        return turn
"""


def study(vary: dict[str, Sequence[object]], seeds: Sequence[int] = (1,), *sets: str, file: Path = TABLE) -> Study:
    return study_of(file, "100ms", vary, seeds, (*PURE, *sets))


class Stopped(Exception):
    """A sweep was interrupted."""


@pytest.mark.parametrize("ending", [".csv", ".jsonl", ".parquet"])
def test_a_sweep_that_was_interrupted_and_extended_has_the_table_of_one_that_was_not(
    ending: str, tmp_path: Path, whole: Table
) -> None:
    """Its rows are those of rehearsals, in the order of the study."""
    out = tmp_path / f"results{ending}"

    def stop(progress: Progress) -> None:
        if progress.ended == 1:
            raise Stopped

    ran: list[Progress] = []
    with executor_here(2) as executor:
        with pytest.raises(Stopped):
            sweep(study(VARY, [2]), executor, out, progress=stop)
        assert len(read_table(out).rows) == 1
        sweep(study(VARY, [2]), executor, out)
        again = sweep(study({RATE: VARY[RATE], DELAY: VARY[DELAY]}, [1, 2]), executor, out, progress=ran.append)
    assert [progress.known for progress in ran] == [4] * 5, "rows that exist are not run again"
    assert [row[DELAY] for row in again.rows[::2]] == ["0ms", "30ms"] * 2, "the order is that of the last study"
    write_table(tmp_path / f"whole{ending}", whole)
    found = read_table(tmp_path / f"whole{ending}")
    assert found.columns == whole.columns
    assert (
        found.rows == whole.rows == sorted(read_table(out).rows, key=lambda row: (row[DELAY], row[RATE], row["seed"]))
    )


@pytest.fixture(scope="module")
def whole() -> Table:
    with executor_here(2) as executor:
        return sweep(study(VARY, [1, 2]), executor)


def test_a_row_has_the_figures_of_a_rehearsal(whole: Table) -> None:
    sets = (f"{DELAY}=30ms", f"{RATE}=50Hz", "seed=2", *PURE)
    found = foosim.rehearse(TABLE, 50, sets=sets).json
    (row,) = [row for row in whole.rows if (row[DELAY], row[RATE], row["seed"]) == ("30ms", "50Hz", 2)]
    assert row["digest"] == found["digest"]["chain"] and row["ticks"] == 50 and not row["message"]
    assert {f"packets.{fate}": count for fate, count in found["packets"].items()}.items() <= row.items()
    assert found["metrics"].items() <= row.items() and "marks.goal" in row
    assert len({row["digest"] for row in whole.rows}) == len(whole.rows) == 8
    assert whole["network.encoder.delay_ms"].dtype == float and whole["seed"].tolist() == [1, 2] * 4
    frame = whole.to_pandas()
    assert [*frame.columns] == [*whole.columns] and frame["score.red"].tolist() == whole["score.red"].tolist()


@pytest.mark.parametrize(
    ("does", "message"),
    [
        ("1 / 0", "player-red failed at tick 6: ZeroDivisionError"),
        ("turn.report('shots', math.nan)", "shots"),
        ("os._exit(3)", "its process ended with exit code 3"),
        ("os.kill(os.getpid(), 9)", "its process was killed by SIGKILL"),
        ("time.sleep(600)", "not done after 3 s of wall time, its process was killed"),
    ],
)
def test_a_run_that_fails_costs_its_row(does: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "odd_player.py").write_text(PLAYER)
    (tmp_path / "table.yaml").write_bytes(TABLE.read_bytes())
    sets = "players.player-red.class=odd_player:Odd", f"players.player-red.parameters={{does: {does!r}}}"
    chosen = study({}, [1, 2, 3], *sets, "deadlines.lockstep_fast=60 s", file=tmp_path / "table.yaml")
    with executor_here(1) as executor:
        first, bad, last = sweep(chosen, executor, tmp_path / "results.csv", limit_s=3.0).rows
    assert message in bad["message"] and not bad["digest"] and "ticks" not in bad
    for row in (first, last):
        assert not row["message"] and row["players.player-red.tick"] >= 40.0
    assert read_table(tmp_path / "results.csv").rows == [first, bad, last]
    assert np.isnan(read_table(tmp_path / "results.csv")["players.player-red.tick"]).tolist() == [False, True, False]


def test_a_combination_that_the_deployment_refuses_has_a_row_that_says_why() -> None:
    with executor_here(1) as executor:
        rows = sweep(study({"table.ball.mass": ["heavy", "21 g"]}), executor).rows
    assert "table.ball.mass" in rows[0]["message"] and not rows[1]["message"]


@pytest.mark.parametrize(
    ("vary", "seeds", "error", "problem"),
    [
        ({"network.links.0.dealy": ["0ms", "1ms"]}, [1], DeploymentError, "'dealy', nearest is 'delay'"),
        ({"robots.*.sensors.encoder.raet": ["5Hz"]}, [1], DeploymentError, "nearest is 'rate'"),
        ({DELAY: []}, [1], BadValue, f"{DELAY}: there is no value"),
        ({DELAY: ["1ms", "1ms"]}, [1], BadValue, f"{DELAY}: a value is there twice, '1ms,1ms'"),
        ({}, [], BadValue, "seeds: there is no value"),
        ({"seed": [1]}, [1], BadValue, "the seed is no parameter"),
    ],
)
def test_a_study_that_cannot_be_run_is_refused(
    vary: dict[str, Sequence[object]], seeds: list[int], error: type[Refused], problem: str
) -> None:
    with pytest.raises(error) as refused:
        study(vary, seeds)
    assert problem in str(refused.value)


def test_results_of_another_study_version_or_place_are_refused_before_anything_runs(
    tmp_path: Path, whole: Table, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "results.csv"
    write_table(out, whole)
    before = out.read_bytes()

    def refused(chosen: Study, path: Path = out) -> str:
        with pytest.raises(Refused) as error:
            sweep(chosen, None, path)  # type: ignore[arg-type]  # nothing is run
        return str(error.value)

    assert "row 1 is of another study" in refused(study(VARY, [1, 2], "table.ball.mass=22 g"))
    assert f"its parameters are {DELAY}, {RATE}" in refused(study({DELAY: ["1ms"]}, [1, 2]))
    monkeypatch.setattr("foosim.simulation.study.run.version", lambda name: "0.0.1")
    assert "row 1 is of another version of foosim, 0.2.0+" in refused(study(VARY, [1, 2]))
    assert out.read_bytes() == before
    assert "cannot be written" in refused(study(VARY), tmp_path / "nowhere" / "results.csv")
    assert "ends with .csv, .jsonl, .parquet" in refused(study(VARY), tmp_path / "results.txt")
    out.write_text("a,b\n1,2\n")
    assert "not a results file of a sweep" in refused(study(VARY))


def test_values_are_texts_of_set_and_ranges_are_whole_numbers() -> None:
    assert values_of("10ms, [1, 2],'a,b',1..3,{k: 1}") == ["10ms", "[1, 2]", "'a,b'", "1", "2", "3", "{k: 1}"]
    assert [text_of(value) for value in (0.5, True, None, "1 m", [1, 2])] == ["0.5", "true", "null", "1 m", "[1, 2]"]
    assert seeds_of("1..3,7") == [1, 2, 3, 7]
    for bad in ("", "5..1", "[1", "1]", "1,,2"):
        with pytest.raises(BadValue):
            values_of(bad)
    with pytest.raises(BadValue, match="not a seed"):
        seeds_of("1..3,x")
