"""Who was lost and came back stands in the capture: each once, as the result has it, whoever was started again."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Final

import pytest
from typer.testing import CliRunner

from foosim.capture.reader import open_capture
from foosim.cli.capture.command import app
from foosim.common import limits
from foosim.protocol.channels import SUPERVISOR
from foosim.protocol.codec import decode_any
from foosim.simulation.run import Rehearsed, rehearse
from foosim.simulation.system import Settings, System
from foosim.simulation.verify import verify_capture
from foosim.supervisor.records import (
    CommitRecord,
    Record,
    Recovered,
    RecoveredRecord,
    close_outages,
)

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
TICKS: Final = 300
MS: Final = 1_000_000
SETS: Final = ("engine=pure", "table.rules.kickoff_delay=20 ms")


def restart(system: System) -> None:
    """Kill the supervisor and start another one at once."""
    system.kill(SUPERVISOR)
    system.start(SUPERVISOR)


def lose_and_restart(system: System) -> None:
    """The supervisor notes that a node is lost, and dies before the commit that would tell of it."""
    system.kill("n2")
    restart(system)


def lose_what_was_committed(system: System) -> None:
    """A node is lost; then the machine of the supervisor is, with all commits that were journalled behind the loss."""
    system.kill("n1")
    system.at_tick(system.supervisor.state.frame.tick + 3, partial(cut_behind_the_loss, system))


def cut_behind_the_loss(system: System) -> None:
    system.kill(SUPERVISOR)
    kinds = [type(decode_any(Record, raw)) for raw in system.journal]
    noted = kinds.index(RecoveredRecord)
    del system.journal[kinds.index(CommitRecord, noted) :]
    system.start(SUPERVISOR)


def captured(path: Path, *faults: tuple[int, Callable[[System], object]]) -> Rehearsed:
    def prepare(system: System) -> None:
        for tick, fault in faults:
            system.at_tick(tick, partial(fault, system))

    settings = Settings(keeps_journals=True)
    return rehearse(TABLE.read_text(), TABLE.name, TICKS, 2, SETS, settings, prepare=prepare, capture=path)


def rows(path: Path) -> list[tuple[str, str, str, int, int]]:
    return [(row.what, row.name, row.reason, row.tick, row.epoch) for row in open_capture(path).recoveries]


def test_what_the_result_has_the_capture_has(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    run = captured(
        path,
        (40, lambda system: system.kill("n2")),
        (80, lambda system: system.start("n2")),
        (120, lambda system: system.kill_hub("unpublished", 300 * MS)),
        (150, restart),
        (200, lose_and_restart),
        (230, lambda system: system.start("n2")),
        (TICKS - 1, lambda system: system.kill("n1")),
    )
    told = run.json["recoveries"]
    kinds = ["node", "join", "vhub", "supervisor", "node", "supervisor", "join", "node"]
    assert [entry["what"] for entry in told] == kinds and told[-1]["tick"] == TICKS - 1
    recoveries = open_capture(path).recoveries
    assert rows(path) == [tuple(entry[key] for key in ("what", "name", "reason", "tick", "epoch")) for entry in told]
    assert [row.wall_outage_ns for row in recoveries] == [round(entry["outage_ms"] * 1e6) for entry in told]
    assert recoveries[2].wall_outage_ns >= 300 * MS
    assert verify_capture(path).equal
    shown = CliRunner().invoke(app, ["info", str(path)])
    assert shown.exit_code == 0 and f"\n  recoveries {len(kinds)}\n" in shown.stdout
    assert f"\n    /recoveries: {len(kinds)}\n" in shown.stdout


def test_a_supervisor_that_lost_its_commits_tells_nothing_twice(tmp_path: Path) -> None:
    run = captured(tmp_path / "run.mcap", (100, lose_what_was_committed), (150, lambda system: system.start("n1")))
    assert run.json["reason"] == "done"
    told = rows(tmp_path / "run.mcap")
    assert [what for what, *_ in told] == ["node", "supervisor", "join"] and len({*told}) == 3
    assert [entry["what"] for entry in run.json["recoveries"]] == ["node", "supervisor", "join"]


@pytest.mark.parametrize("more", [0, 1, limits.RECOVERIES_PER_COMMIT_MAX])
def test_what_a_commit_cannot_tell_the_next_ones_do(more: int) -> None:
    """Nodes may come and go for as long as the world stands still."""
    count = limits.RECOVERIES_PER_COMMIT_MAX + more
    recovered = [Recovered("node", "n1", "", tick, 1) for tick in range(count)]
    first, second = close_outages(recovered, 10, 30), close_outages(recovered, 30, 35)
    assert first + second == recovered and len(first) == limits.RECOVERIES_PER_COMMIT_MAX
    assert [entry.outage_ns for entry in recovered] == [20] * len(first) + [5] * more
    assert close_outages(recovered, 35, 40) == []
