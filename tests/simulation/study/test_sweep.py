"""Sweeps: the same table however it came to be, a row for each run whatever becomes of it, and what is refused."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future
from dataclasses import replace
from pathlib import Path
from typing import Any, Final
from weakref import ref

import numpy as np
import pytest

import foosim
from foosim.common.errors import BadValue, DeploymentError, Failed, Refused
from foosim.simulation.study.run import OtherVersion, Ran
from foosim.simulation.study.study import Study, seeds_of, study_of, text_of, values_of
from foosim.simulation.study.sweep import Progress, Results, sweep
from foosim.simulation.study.table import Table, read_table, write_table
from foosim.simulation.workers import executor_here

TABLE: Final = Path(__file__).parents[3] / "deploy" / "table.yaml"
DELAY: Final = "network.links.0.delay"
RATE: Final = "robots.*.sensors.encoder.rate"
VARY: Final = {DELAY: ("0ms", "30ms"), RATE: ("100Hz", "50Hz")}
PURE: Final = ("engine=pure",)
RED: Final = "players.player-red"
FREE: Final = "{class: 'tests.waving:Waver', rate: 50 Hz, lockstep: false, robots: {red.goal: [encoder]}}"
PLAYER: Final = """
from foosim import Player, Turn
import math, os, time
class Odd(Player):
    def __init__(self, deployment, parameters):
        self.does = parameters["does"]
    def act(self, tick, samples):
        turn = Turn({})
        turn.report("tick", tick)
        exec(self.does)
        return turn
"""


def study(vary: Mapping[str, Sequence[object]], seeds: Sequence[int] = (1,), *sets: str, file: Path = TABLE) -> Study:
    return study_of(file, "100ms", vary, seeds, (*PURE, *sets))


class Stopped(Exception):
    """A sweep was interrupted."""


def test_a_sweep_that_was_interrupted_and_extended_has_the_table_of_one_that_was_not(
    tmp_path: Path, whole: Table, executor: Executor
) -> None:
    """In the order of the study, whatever the file."""
    out = tmp_path / "results.csv"
    ran: list[Progress] = []

    def stop(progress: Progress) -> None:
        if progress.ended == 1:
            raise Stopped

    with pytest.raises(Stopped):
        sweep(study(VARY, [2]), executor, out, progress=stop)
    assert len(read_table(out).rows) == 1
    again = sweep(study({RATE: VARY[RATE], DELAY: VARY[DELAY]}, [1, 2]), executor, out, progress=ran.append)
    assert [progress.known for progress in ran] == [1] * 8, "rows that exist are not run again"
    assert [row[DELAY] for row in again.rows[::2]] == ["0ms", "30ms"] * 2, "the order is that of the last study"
    order = sorted(read_table(out).rows, key=lambda row: (row[DELAY], row[RATE], row["seed"]))
    for ending in (".csv", ".jsonl", ".parquet"):
        write_table(tmp_path / f"whole{ending}", whole)
        found = read_table(tmp_path / f"whole{ending}")
        assert found.columns == whole.columns and found.rows == whole.rows == order


@pytest.fixture(scope="module")
def executor() -> Iterator[Executor]:
    with executor_here(2) as found:
        yield found


@pytest.fixture(scope="module")
def whole(executor: Executor) -> Table:
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


def test_a_run_that_fails_costs_its_row(tmp_path: Path, executor: Executor) -> None:
    (tmp_path / "odd_player.py").write_text(PLAYER)
    file = tmp_path / "table.yaml"
    file.write_bytes(TABLE.read_bytes())
    fates = {
        "1 / 0": "player-red failed at tick 6: ZeroDivisionError",
        "turn.report('shots', math.nan)": "player-red failed at tick 6: BadValue: metric shots",
        "os._exit(3)": "its process ended with exit code 3",
        "os.kill(os.getpid(), 9)": "its process was killed by SIGKILL",
        "turn.report('shots', 1.5)": "",
    }
    does = "players.player-red.parameters.does"
    sets = "players.player-red.class=odd_player:Odd", "players.player-red.parameters={does: ''}"
    rows = sweep(study({does: [*fates]}, [2], *sets, file=file), executor, tmp_path / "results.csv").rows
    hangs = study({}, [2], *sets, f"{does}=time.sleep(600)", "deadlines.lockstep_fast=60 s", file=file)
    (late,) = sweep(hangs, executor, limit_s=0.5).rows
    assert late["message"] == "not done after 0.5 s of wall time, its process was killed"
    for row, message in zip(rows, fates.values(), strict=True):
        assert row["message"].startswith(message) and bool(row["message"]) == bool(message)
        assert bool(row["digest"]) == ("ticks" in row) == (not message)
    assert rows[-1]["players.player-red.tick"] >= 40.0 and rows[-1]["players.player-red.shots"] == 1.5
    table = read_table(tmp_path / "results.csv")
    assert table.rows == rows and np.isnan(table["players.player-red.tick"]).tolist() == [True] * 4 + [False]


class Ends(Executor):
    """Gives each run at once; the last one is cancelled, as by a Dask client whose scheduler has ended."""

    def __init__(self, runs: int) -> None:
        self.futures: list[ref[Future[Ran]]] = []
        self.runs = runs

    def submit(self, *_: object, **__: object) -> Any:
        future: Future[Ran] = Future()
        self.futures.append(ref(future))
        if len(self.futures) < self.runs:
            future.set_result(Ran({}, ""))
        else:
            future.cancel()
            future.set_running_or_notify_cancel()
        return future


def test_an_executor_that_ends_or_has_another_version_makes_no_row(tmp_path: Path, executor: Executor) -> None:
    """And a result that has been taken is not kept: Dask would compute it again if its worker died."""
    ends, kept = Ends(5), list[int]()
    sweep(study({}, range(4)), ends, progress=lambda _: kept.append(sum(one() is not None for one in ends.futures)))
    assert kept == [0, 4, 3, 2, 1], "all, but for those that have been taken before the last one"
    with pytest.raises(BrokenExecutor, match="were cancelled"):
        sweep(study({}, [5]), ends, tmp_path / "results.csv")
    older = replace(study({}, range(5)), version="0.0.1")
    with pytest.raises(OtherVersion, match=r"the study has 0\.0\.1"):
        sweep(older, executor, tmp_path / "results.csv")
    assert not [*tmp_path.iterdir()]


def test_a_combination_that_the_deployment_refuses_has_a_row_that_says_why(executor: Executor) -> None:
    rows = sweep(study({"table.ball.mass": ["heavy", "21 g"]}), executor).rows
    assert "table.ball.mass" in rows[0]["message"] and not rows[1]["message"]


@pytest.mark.parametrize(
    ("vary", "seeds", "error", "problem"),
    [
        (
            {"network.links.0.dealy": ["0ms", "1ms"]},
            [1],
            DeploymentError,
            "--vary network.links.0.dealy: network.links[0]: unknown key, 'dealy', nearest is 'delay'",
        ),
        ({"robots.*.sensors.encoder.raet": ["5Hz"]}, [1], DeploymentError, "nearest is 'rate'"),
        ({DELAY: []}, [1], BadValue, f"{DELAY}: there is no value"),
        ({DELAY: ["1ms", "1ms"]}, [1], BadValue, f"{DELAY}: a value is there twice, '1ms,1ms'"),
        ({DELAY: "1ms"}, [1], BadValue, f"{DELAY}: a text"),
        ({DELAY: [object()]}, [1], BadValue, "not a value of a deployment"),
        ({}, [], BadValue, "seeds: there is no value"),
        ({"seed": [1]}, [1], BadValue, "the seed is no parameter"),
        ({RED: [FREE]}, [1], BadValue, "these are free-running, 'player-red'"),
    ],
)
def test_a_study_that_cannot_be_run_is_refused(
    vary: dict[str, Sequence[object]], seeds: list[int], error: type[Refused], problem: str
) -> None:
    with pytest.raises(error) as refused:
        study(vary, seeds)
    assert problem in str(refused.value)


def test_a_seed_among_the_sets_is_refused() -> None:
    with pytest.raises(BadValue, match="the seed is no parameter"):
        study({}, [1], "seed=2")


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
    with pytest.raises(BadValue, match="more than 0 s"):
        sweep(study(VARY), None, limit_s=0.0)  # type: ignore[arg-type]
    assert "ends with .csv, .jsonl, .parquet" in refused(study(VARY), tmp_path / "results.txt")
    out.write_text("a,b\n1,2\n")
    assert "not a results file of a sweep" in refused(study(VARY))
    cut, twice = before.rpartition(b",")[0], before + before.splitlines(keepends=True)[1]
    for damaged, problem in (cut, "row 8: foosim is no text"), (twice, "row 9: an earlier row has its parameters"):
        out.write_bytes(damaged)
        assert problem in refused(study(VARY, [1, 2]))


def test_a_file_that_another_sweep_writes_keeps_its_rows(tmp_path: Path) -> None:
    out = tmp_path / "results.csv"
    first, second = Results(study({}, [1]), out), Results(study({}, [2]), out)
    second.add((2,), Ran({}, ""))
    with pytest.raises(Failed, match="another process has written it"):
        first.add((1,), Ran({}, ""))
    assert [row["seed"] for row in read_table(out).rows] == [2]


def test_values_are_texts_of_set_and_ranges_are_whole_numbers() -> None:
    assert values_of("10ms, [1, 2],'a,b',1..3,{k: 1}") == ["10ms", "[1, 2]", "'a,b'", "1", "2", "3", "{k: 1}"]
    assert [text_of(value) for value in (np.float64(0.5), True, None, "1 m", np.arange(1, 3))] == [
        *("0.5", "true", "null", "1 m", "[1, 2]")
    ]
    assert seeds_of("1..3,7") == [1, 2, 3, 7]
    for bad in ("", "5..1", "[1", "1]", "1,,2"):
        with pytest.raises(BadValue):
            values_of(bad)
    assert type(study({}, np.arange(2)).seeds[0]) is int  # type: ignore[arg-type]
    with pytest.raises(BadValue, match="not a seed"):
        seeds_of("1..3,x")
