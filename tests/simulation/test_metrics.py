"""What players report, and the network's figures: the same wherever a run is computed and whoever is lost meanwhile."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from random import Random
from typing import Any, Final

import numpy as np
import pytest

from foosim.capture.cut import cut_capture
from foosim.capture.info import capture_info
from foosim.capture.reader import open_capture
from foosim.capture.rows import CLIENTS, PACKETS
from foosim.client.client import Client
from foosim.client.player import Player, Samples, Turn
from foosim.common import limits
from foosim.common.units import Pace
from foosim.console.recorded.capture_curves import curve_points, status_at
from foosim.console.recorded.capture_history import CaptureHistory
from foosim.console.recorded.recording import Recording
from foosim.console.shown.source import Curve
from foosim.deployment.schema import Deployment
from foosim.protocol.channels import SUPERVISOR
from foosim.simulation.run import Rehearsed, rehearse
from foosim.simulation.simulation import Simulation
from foosim.simulation.system import Settings, System
from foosim.simulation.verify import verify_capture
from tests.client.scripted import Program, refused
from tests.simulation.conftest import TABLE

TICKS: Final = 560
"""Of 2 ms: rows of the network's figures are due once before the end."""
MS: Final = 1_000_000


class Reporter(Player):
    """Moves a rod, and reports as its parameters say."""

    def __init__(self, deployment: Deployment, parameters: Mapping[str, Any]) -> None:
        self._reports = parameters["reports"]

    def act(self, tick: int, samples: Samples) -> Turn:
        turn = Turn({self.robots[0]: {"slide": 0.02 * (tick // 40 % 2), "spin": 0.0}})
        if self._reports == "well":
            turn.report("tick", tick)
            if tick == 10:
                turn.report("once", 0.5)
            turn.report("is_odd", np.bool_(tick // 20 % 2 == 1))  # type: ignore[arg-type]
        elif tick >= 20:
            self._report_badly(turn, tick)
        return turn

    def _report_badly(self, turn: Turn, tick: int) -> None:
        if self._reports == "nan":
            turn.report("speed", float("nan"))
        elif self._reports == "name":
            turn.report("a.b", 1)
        elif self._reports == "text":
            turn.report("speed", "fast")  # type: ignore[arg-type]
        elif self._reports == "unchecked":
            turn.metrics["speed"] = "fast"  # type: ignore[assignment]
        elif self._reports == "many":
            for number in range(limits.METRICS_MAX + 1):
                turn.report(f"metric-{number}", number)


def sets(reports: str) -> list[str]:
    path = f"{__name__}:{Reporter.__name__}"
    about = f"{{class: '{path}', rate: 50 Hz, lockstep: true, robots: {{red.goal: [encoder]}},"
    return [
        "engine=pure",
        "network.links.0.loss=5 %",
        f"players={{reporter: {about} parameters: {{reports: {reports}}}}}}}",
    ]


def run(reports: str = "well", nodes: int = 1, capture: Path | None = None, faults: Faults = ()) -> Rehearsed:
    def prepare(system: System) -> None:
        for tick, fault in faults:
            system.at_tick(tick, partial(fault, system))

    settings = Settings(keeps_journals=True)
    return rehearse(
        TABLE.read_text(), TABLE.name, TICKS, nodes, sets(reports), settings, prepare=prepare, capture=capture
    )


def restart(name: str, system: System) -> None:
    system.kill(name)
    system.start(name)


Faults = tuple[tuple[int, Callable[[System], object]], ...]


def faults_of(seed: int, nodes: int) -> Faults:
    dice = Random(seed)
    kinds: list[Callable[[System], object]] = [
        partial(restart, SUPERVISOR),
        partial(restart, "reporter"),
        lambda system: system.kill_hub(dice.choice(("now", "unpublished", "torn")), 300 * MS),
    ]
    kinds += [partial(restart, f"n{nodes}")] if nodes > 1 else []
    ticks = dice.sample(range(20, TICKS - 60, 15), 2 * len(kinds))
    return tuple(zip(ticks, kinds * 2, strict=True))


@pytest.fixture(scope="module")
def captured(tmp_path_factory: pytest.TempPathFactory) -> tuple[Rehearsed, Path]:
    path = tmp_path_factory.mktemp("metrics") / "run.mcap"
    return run(capture=path), path


@pytest.mark.parametrize(("seed", "nodes"), [(1, 1), (2, 2), (3, 3)])
def test_metrics_are_the_same_on_any_nodes_and_through_faults(
    captured: tuple[Rehearsed, Path], seed: int, nodes: int
) -> None:
    calm, faulty = captured[0], run(nodes=nodes, faults=faults_of(seed, nodes))
    assert len(faulty.json["recoveries"]) >= 3 and faulty.digests == calm.digests
    metrics = calm.json["metrics"]
    assert faulty.json["metrics"] == metrics
    assert metrics["players.reporter.tick"] == 550.0 and metrics["players.reporter.is_odd"] == 1.0
    assert metrics["players.reporter.once"] == 0.5, "by a player of before, and a vHub of before"
    assert metrics["score.red"] == 0 and metrics["is_over"] == 0, "status values of rules"
    assert 0.0 < metrics["network.encoder.loss"] < 0.1 < metrics["network.encoder.delay_ms"] < 5.0
    assert metrics["network.encoder.age_ms"] >= 2.0


def test_a_run_has_a_bounded_number_of_metrics(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(limits, "METRICS_OF_RUN_MAX", 2)
    result = run().json
    assert result["failed"] and result["reason"] == "reporter reports more metrics; a run has at most 2"


def test_a_report_changes_neither_the_world_nor_the_fate_of_a_packet(captured: tuple[Rehearsed, Path]) -> None:
    silent, reporting = run("nothing"), captured[0]
    assert silent.digests == reporting.digests and silent.json["packets"] == reporting.json["packets"]
    own = {name: value for name, value in reporting.json["metrics"].items() if not name.startswith("players.")}
    assert silent.json["metrics"] == own and len(own) < len(reporting.json["metrics"])


@pytest.mark.parametrize(
    ("reports", "why"),
    [
        ("nan", "BadValue: metric speed is no finite int, float or bool, nan"),
        ("text", "BadValue: metric speed is no finite int, float or bool, 'fast'"),
        ("name", "BadValue: not a name of a metric: a name is a lower case letter, "),
        ("unchecked", "metric speed is no finite int, float or bool, 'fast'"),
        ("many", "a client reports at most 64 metrics; one more is, 'metric-64'"),
    ],
)
def test_an_invalid_report_ends_the_run(reports: str, why: str) -> None:
    result = run(reports).json
    assert result["failed"] and result["reason"].startswith("reporter failed at tick 20: ")
    assert why in result["reason"] and "test_metrics.py:" in result["reason"]


def test_a_capture_has_the_metrics_of_the_result(captured: tuple[Rehearsed, Path], tmp_path: Path) -> None:
    run, path = captured
    reported = {name: value for name, value in run.json["metrics"].items() if name.startswith(("players.", "network."))}
    series = open_capture(path).metrics()
    assert {name: values[-1] for name, (_, values) in series.items()} == reported == capture_info(path).metrics
    ticks, values = series["players.reporter.is_odd"]
    assert ticks.tolist() == [*range(0, TICKS, 20)] and values.tolist() == [
        tick // 20 % 2 for tick in range(0, TICKS, 20)
    ]
    assert series["network.encoder.loss"][0].tolist() == [499, 559], "each second, and at the end"
    assert verify_capture(path).equal
    cut_capture(path, tmp_path / "cut.mcap", 1_110 * MS)
    cut = open_capture(tmp_path / "cut.mcap").metrics()
    assert cut["players.reporter.tick"][0].tolist() == [540, 550] and cut.keys() == series.keys(), (
        "also what came before"
    )


def test_the_console_plots_the_metrics_of_a_capture(captured: tuple[Rehearsed, Path]) -> None:
    run, path = captured
    history = CaptureHistory(Recording(path, (PACKETS, CLIENTS)))
    seen = status_at(history.recording, {}, TICKS, history.recording.look(TICKS))["metrics"]
    assert seen == run.json["metrics"]
    assert status_at(history.recording, {}, 498, None)["metrics"] == {
        "players.reporter.is_odd": 0.0,
        "players.reporter.once": 0.5,
        "players.reporter.tick": 490.0,
    }
    odd = curve_points(history, Curve("a", status="metrics.players.reporter.is_odd"), TICKS)
    assert len(odd) > 100 and all(value == tick // 20 % 2 for tick, value in odd if tick < TICKS)
    score = curve_points(history, Curve("b", status="metrics.score.red"), TICKS)
    assert len(score) > 100 and {value for _, value in score} == {0.0}


@pytest.mark.parametrize("network", [False, True])
def test_a_simulation_has_the_metrics_of_a_run(captured: tuple[Rehearsed, Path], network: bool) -> None:
    with Simulation(TABLE, agents=(), network=network, sets=sets("well")) as simulation:
        simulation.step(ticks=TICKS)
        found = simulation.metrics
    of_run = captured[0].json["metrics"]
    assert [*found] == [name for name in of_run if network or not name.startswith("network.")]
    same = [name for name in found if not name.startswith("network.")]
    assert {name: found[name] for name in same} == {name: of_run[name] for name in same}


@pytest.mark.parametrize("lockstep", [True, False])
def test_an_external_client_reports(lockstep: bool) -> None:
    def script(client: Client) -> None:
        assert "NotJoined" in refused(lambda: client.report("goals", 1))
        if not lockstep:
            client.listen([("red.goal", "encoder")])
        for tick in client.lockstep() if lockstep else range(3):
            client.report("goals", 2 * tick)
            assert "BadValue: metric goals is no finite" in refused(lambda: client.report("goals", float("inf")))
            assert "BadValue: not a name of a metric" in refused(lambda: client.report("Goals", 1))
            if not lockstep:
                client.receive(0.0)

    program = Program(script)
    declared = "{lockstep: true, rate: 50 Hz}" if lockstep else "{}"
    settings = Settings(clients={"hand": program})
    clients = ["engine=pure", "players={}", f"clients={{hand: {declared}}}"]
    pace = Pace("fast" if lockstep else "realtime")
    found = rehearse(TABLE.read_text(), TABLE.name, TICKS, 1, clients, settings, pace=pace)
    assert program.is_over and found.json["metrics"]["players.hand.goals"] == (1100.0 if lockstep else 4.0)
