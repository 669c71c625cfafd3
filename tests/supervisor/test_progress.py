"""Who is waited for, who makes ticks late, who is lost: each kind of process delayed or stopped in turn is named."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from functools import cache, partial
from pathlib import Path
from typing import Any, Final

import pytest
from msgspec.structs import replace

from foosim.common.units import Pace, parse_pace
from foosim.node.core import NodeCore
from foosim.node.tick import Stepper
from foosim.protocol import channels
from foosim.protocol.channels import SUPERVISOR, VHUB
from foosim.protocol.codec import encode
from foosim.protocol.messages import CAPTURE, DONE_OF, SAMPLES_OF, Heartbeat, Request, Want
from foosim.simulation.run import rehearse, with_nodes
from foosim.simulation.system import IDLE_NS_MAX, OPERATOR, Settings, System
from foosim.supervisor.progress import ProgressMonitor
from foosim.supervisor.settings import RunSettings
from foosim.supervisor.state import RunState
from foosim.vhub.core import HubCore
from foosim.vhub.wait_times import WaitTimes
from foosim.world.frame import Frame
from foosim.world.layout import Entity
from foosim.world.robot_packets import RobotPacket
from tests.turns import BY_PERIOD

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
TEXT: Final = TABLE.read_text()
MS: Final = 1_000_000
T: Final = 2 * MS
TICKS: Final = 100
REALTIME: Final = Pace("realtime")
LONG: Final = tuple(f"deadlines.{name}=1 h" for name in ("heartbeat", "tick_named", "tick_lost", "lockstep_realtime"))


class Seen:
    """A rehearsal in realtime, and who was said to be late at every tick."""

    def __init__(self, nodes: int = 2, ticks: int = TICKS, pace: Pace = REALTIME, sets: Sequence[str] = LONG) -> None:
        self.nodes, self.ticks, self.pace, self.sets = nodes, ticks, pace, sets
        self.lines: list[str] = []
        self.late: dict[int, str] = {}
        self.settings = Settings(on_log=self._say, on_commit=lambda frame: self._look(frame.tick))
        self.prepare: Callable[[System], None] = lambda system: None

    def _say(self, process: str, level: str, text: str) -> None:
        self.lines.append(text)

    def _look(self, tick: int) -> None:
        """The frame before was judged when it was committed."""
        self.late[tick - 1] = self.system.supervisor.progress.late

    def go(self) -> Seen:
        def prepare(system: System) -> None:
            self.system = system
            self.prepare(system)

        sets = ["engine=pure", "on_node_loss=stop", *BY_PERIOD, *self.sets]
        self.result = rehearse(
            TEXT, TABLE.name, self.ticks, self.nodes, sets, self.settings, pace=self.pace, prepare=prepare
        ).json
        return self


@cache
def delayed(process: str, delay_ms: float, nodes: int = 2, pace: str = "realtime") -> Seen:
    seen = Seen(nodes, pace=parse_pace(pace))
    seen.settings.slow_ns = {process: int(delay_ms * MS)}
    return seen.go()


PROCESSES: Final = ("n1", "n2", VHUB, "player-red", "player-blue", SUPERVISOR)


@pytest.mark.parametrize(
    ("process", "delay_ms"), [*((process, 8) for process in PROCESSES), ("n2", 30), ("player-red", 30)]
)
def test_each_kind_of_process_delayed_is_named_in_the_lag_line(process: str, delay_ms: float) -> None:
    seen = delayed(process, delay_ms)
    assert seen.result["ticks"] == TICKS and seen.result["reason"] == "done"
    assert {name for tick, name in seen.late.items() if tick > 5} == {process}
    late = seen.system.supervisor.status(0)["late"]
    assert late["waited_for"] == process and 0 < late["tick"] <= TICKS
    lines = [line for line in seen.lines if "lag" in line]
    assert lines and all(f"ms, waited for {process}" in line for line in lines)
    assert seen.result["lag_ms"]["max"] >= delay_ms - 2 * T / MS


def test_a_run_in_time_names_nobody() -> None:
    seen = Seen().go()
    assert set(seen.late.values()) == {""} and not [line for line in seen.lines if "lag" in line]
    assert seen.system.supervisor.status(0)["late"] == {"lag_ms": 0.0, "waited_for": "", "tick": -1}


def test_in_fast_nobody_is_late() -> None:
    seen = delayed("n1", 8, pace="fast")
    assert set(seen.late.values()) == {""} and seen.result["lag_ms"] is None


def test_one_late_tick_is_blamed_once_and_the_ticks_that_catch_up_keep_the_name() -> None:
    seen = Seen()

    def stall(system: System) -> None:
        def begin() -> None:
            system.processes["n2"].busy_until_ns = system.bus.now_ns + 20 * MS

        system.at_tick(60, begin)

    seen.prepare = stall
    seen.go()
    assert {name for tick, name in seen.late.items() if tick < 60} == {""}
    assert {name for tick, name in seen.late.items() if tick > 62} == {"n2"}
    assert seen.system.supervisor.progress.late_tick in (61, 62, 63), "no tick after it was late by more"
    assert seen.result["lag_ms"]["max"] == pytest.approx(18.0, abs=2.1)


def test_late_ticks_are_logged_once_a_second_with_their_number() -> None:
    lines = [line for line in delayed("player-red", 30).lines if "late ticks" in line]
    assert lines[0] == "tick 2: lag 26.0 ms, waited for player-red (1 late ticks)"
    assert 1 <= len(lines) <= 3
    anchors = [line for line in delayed("player-red", 30).lines if "lag" in line and "late ticks" not in line]
    assert anchors and all(float(line.split("lag ")[1].split(" ms")[0]) > 100.0 for line in anchors)


# --- overdue, silent, gone -------------------------------------------------------------------------------------------

DEADLINES: Final = ("deadlines.heartbeat=1 h", "deadlines.tick_named=500 ms", "deadlines.tick_lost=1 s")


def ended(seen: Seen) -> tuple[str, int]:
    """How a run ended that had to end early: in order, with a result, everyone told."""
    core = seen.system.supervisor
    assert core.state.end is not None and core.state.finished
    assert seen.result["failed"] is True and seen.result["ticks"] == core.state.end.tick < seen.ticks
    assert seen.system.hub.finished, "the vHub has closed what it had"
    told = [name for name, solver in seen.system.solvers.items() if solver._core.ended is not None]
    assert told or seen.nodes == 1, "who still hears is told"
    return core.state.end.reason, core.state.end.tick


class _StuckNode(NodeCore):
    """n2 gets its work at tick 60 and never has it done; it hears and is heard."""

    def advance(self, now_ns: int) -> None:
        super().advance(now_ns)
        if self.name == "n2" and self.work is not None and self.work.tick == 60:
            self.work = None


def test_a_node_that_stops_answering_is_named_and_then_lost() -> None:
    seen = Seen(sets=DEADLINES, ticks=300)
    seen.settings.node = _StuckNode
    assert ended(seen.go()) == ("lost n2: tick 60 is overdue by 1.0 s", 60)
    named = [line for line in seen.lines if "waits for" in line]
    assert named == ["tick 60 waits for n2 since 0.6 s"]


class _BlindNode(NodeCore):
    """n2 says no samples from tick 60 on."""

    def receive(self, channel: channels.Channel, name: str, payload: bytes, now_ns: int) -> None:
        super().receive(channel, name, payload, now_ns)
        self._drop()

    def advance(self, now_ns: int) -> None:
        super().advance(now_ns)
        self._drop()

    def _drop(self) -> None:
        tick = 0 if self.frame is None else self.frame.tick
        if self.name == "n2" and tick >= 60:
            mute = [action for action in self.actions if getattr(action, "channel", None) is channels.SAMPLES]
            for action in mute:
                self.actions.remove(action)


def test_who_keeps_the_vhub_waiting_for_samples_is_lost_not_the_vhub() -> None:
    seen = Seen(sets=DEADLINES, ticks=300)
    seen.settings.node = _BlindNode
    reason, tick = ended(seen.go())  # by its heartbeats it may be the vHub that hears nobody: that would show by then
    assert reason == f"lost n2: tick {tick} is overdue by 1.6 s" and 60 <= tick <= 62


class _AskedNode(NodeCore):
    """Is asked five times for the samples of tick 60, as a node is whose sensors take long."""

    def advance(self, now_ns: int) -> None:
        super().advance(now_ns)
        if self.name == "n2" and self.frame is not None and self.frame.tick == 60:
            want = encode(Want("vhub", channels.SAMPLES.name, 60, self.epoch, []))
            for _ in range(5):
                self.receive(channels.WANT, "vhub", want, now_ns)


def test_a_node_that_is_asked_again_says_the_same_samples_and_measures_once(monkeypatch: pytest.MonkeyPatch) -> None:
    sensed: list[int] = []
    sense = Stepper.sense

    def counted(self: Stepper, frame: Frame, robots: Sequence[Entity]) -> tuple[list[RobotPacket], dict[int, float]]:
        sensed.append(frame.tick)
        return sense(self, frame, robots)

    monkeypatch.setattr(Stepper, "sense", counted)
    undisturbed = Seen(ticks=100).go()
    once, sensed[:] = sensed.count(60), []
    seen = Seen(ticks=100)
    seen.settings.node = _AskedNode
    seen.go()
    assert sensed.count(60) == once == 2, "each node measures once"
    assert seen.system.supervisor.state.chain == undisturbed.system.supervisor.state.chain


class _StuckHub(HubCore):
    """Closes no tick from 60 on."""

    def _close_clients(self, now_ns: int) -> bool:
        return self.state is not None and self.state.closed < 59 and super()._close_clients(now_ns)


def test_a_vhub_that_stops_closing_is_named_and_lost() -> None:
    """It says that it lives all the time: that does not bring it back."""
    seen = Seen(sets=(*DEADLINES, "deadlines.vhub_back=5 s"), ticks=300)
    seen.settings.hub = _StuckHub
    assert ended(seen.go()) == ("lost vhub: tick 61 is overdue by 1.0 s; it did not come back within 5 s", 61)


def stopped(process: str, **changes: Any) -> Seen:
    """A process that stops altogether when frame 60 is committed: it neither hears nor says anything any more."""
    seen = Seen(ticks=400, **changes)

    def prepare(system: System) -> None:
        def stop() -> None:
            system.processes[process].busy_until_ns = 10 * IDLE_NS_MAX

        system.at_tick(60, stop)

    seen.prepare = prepare
    return seen.go()


@pytest.mark.parametrize("process", ["n1", "n2"])
def test_a_silent_node_is_lost(process: str) -> None:
    seen = stopped(process, sets=("deadlines.heartbeat=1 s", "deadlines.tick_lost=1 h", "deadlines.tick_named=1 h"))
    reason, tick = ended(seen)
    assert reason == f"lost {process}: no heartbeat for 1 s" and 60 <= tick <= 62


def test_a_silent_vhub_is_lost_and_the_run_ends_without_its_farewell() -> None:
    sets = ("deadlines.heartbeat=1 s", "deadlines.tick_lost=1 h", "deadlines.tick_named=1 h", "deadlines.vhub_back=2 s")
    seen = stopped(VHUB, sets=sets)
    core = seen.system.supervisor
    assert core.state.end is not None
    assert core.state.end.reason == "lost vhub: no heartbeat for 1 s; it did not come back within 2 s"
    assert core.state.finished and not seen.system.hub.finished and seen.result["capture"] is None


@pytest.mark.parametrize("pace", [REALTIME, Pace("fast")], ids=str)
def test_a_lockstep_client_that_does_not_answer_is_lost(pace: Pace) -> None:
    """The vHub has its deadline: 2 s in realtime, 10 s in fast; meanwhile it is the one that is waited for."""
    waited: list[list[str]] = []
    seen = Seen(ticks=400, pace=pace, sets=())

    def prepare(system: System) -> None:
        def stop() -> None:
            system.processes["player-red"].busy_until_ns = 10 * IDLE_NS_MAX

        system.at_tick(60, stop)
        say = system.settings.on_log

        def listen(process: str, level: str, text: str) -> None:
            assert say is not None
            say(process, level, text)
            if process == VHUB and "has not answered" in text:
                waited.append(system.supervisor.progress.waiting_for())

        system.settings.on_log = listen

    seen.prepare = prepare
    reason, tick = ended(seen.go())
    allowed = r"10 s \(deadlines.lockstep_fast" if pace.kind == "fast" else r"2 s \(deadlines.lockstep_realtime"
    assert re.fullmatch(rf"player-red has not answered tick 6\d for {allowed}\)", reason)
    assert 60 <= tick <= 67 and waited == [["player-red"]]
    assert not [line for line in seen.lines if "overdue" in line or "waits for" in line], "only it can be overdue"


@pytest.mark.parametrize(
    ("silent_ms", "known"), [(0, ""), (1_200, ": it had not answered tick 60 for 1.2 s")], ids=["ended", "stopped"]
)
def test_a_lockstep_client_whose_connection_closes_is_lost(silent_ms: int, known: str) -> None:
    short = ("deadlines.client_back=300 ms", f"deadlines.lockstep_realtime={silent_ms + 300} ms")
    seen = Seen(ticks=400, sets=(*LONG, *short, "players.player-blue.restart=false"))

    def close(system: System) -> None:
        system.pause("player-blue", 3_600_000_000_000)  # nothing comes of it, as of one that is gone
        gone = partial(system.hub.client_gone, "player-blue")
        system.later(silent_ms * MS, lambda: gone(system.bus.now_ns))

    seen.prepare = lambda system: system.at_tick(60, partial(close, system))
    reason, _ = ended(seen.go())
    assert reason == f"lost player-blue: its connection closed{known}"


def presence_ends(process: str) -> Seen:
    seen = Seen(ticks=600)
    seen.prepare = lambda system: system.at_tick(
        60, lambda: system.supervisor.connection_closed(process, system.bus.now_ns)
    )
    return seen.go()


def test_a_vhub_whose_presence_ends_and_that_is_heard_later_is_back() -> None:
    """Only its connection was cut: it goes on with all that it has."""
    seen = presence_ends(VHUB)
    assert seen.result["reason"] == "done" and seen.result["ticks"] == 600
    (entry,) = seen.result["recoveries"]
    assert (entry["what"], entry["name"], entry["reason"]) == ("vhub", "vhub", "its connection closed")
    assert entry["tick"] >= 60 and entry["epoch"] == 1 and entry["outage_ms"] is not None
    assert any(line.startswith("lost the vHub: its connection closed; the run waits for it") for line in seen.lines)
    assert any(line.startswith("the vHub is back after 0.") for line in seen.lines)


@pytest.mark.parametrize(("waits_s", "lost"), [(5, False), (40, True)])
def test_a_vhub_that_waits_for_its_capture_is_not_taken_for_dead(waits_s: int, lost: bool) -> None:
    """Its loop stands still, as a full queue makes it, and it says what it waits for: it has `deadlines.close`."""
    seen = Seen(ticks=200, sets=("deadlines.vhub_back=1 h",))

    def prepare(system: System) -> None:
        def stand() -> None:
            told = encode(replace(system.hub.heartbeat(), waiting_for=CAPTURE))

            def say() -> None:
                system.supervisor.receive(channels.HEARTBEAT, VHUB, told, system.now_of(SUPERVISOR))

            for number in range(10 * waits_s):
                system.later(number * 100 * MS, say)
            system.pause(VHUB, waits_s * 1000 * MS)

        system.at_tick(60, stand)

    seen.prepare = prepare
    seen.go()
    assert seen.result["reason"] == "done"
    reasons = [entry["reason"] for entry in seen.result["recoveries"] if entry["what"] == "vhub"]
    assert [re.sub(r"[0-9.]+ s", "", reason) for reason in reasons] == (["tick 61 is overdue by "] if lost else [])


def never_there(absent: str, sets: Sequence[str] = ()) -> Seen:
    seen = Seen(sets=("deadlines.start=2 s", *sets))

    def prepare(system: System) -> None:
        system.processes[absent].busy_until_ns = 10 * IDLE_NS_MAX

    seen.prepare = prepare
    return seen


@pytest.mark.parametrize("absent", ["n2", VHUB, "player-red"])
def test_who_is_not_ready_in_time_ends_the_run_before_it_starts(absent: str) -> None:
    core = never_there(absent).go().system.supervisor
    assert core.state.end is not None and core.state.end.reason == f"lost {absent}: not ready within 2 s"


def test_who_is_started_by_hand_is_waited_for_without_end() -> None:
    text = with_nodes(TEXT, TABLE.name, 2, ["engine=pure", "deadlines.start=2 s", "nodes.n2.launch=manual"])
    system = System(RunSettings("run", TABLE.name, text, REALTIME, 10), Settings())
    system.processes["n2"].busy_until_ns = 30 * 1000 * MS
    system.run()
    assert system.supervisor.state.end is not None and system.supervisor.state.end.reason == "done"
    assert system.supervisor.state.frame.tick == 10


def test_nobody_is_overdue_while_the_run_is_paused() -> None:
    text = with_nodes(TEXT, TABLE.name, 2, ["engine=pure"])
    lines: list[str] = []
    settings = Settings(on_log=lambda process, level, said: lines.append(said))
    system = System(RunSettings("run", TABLE.name, text, REALTIME, TICKS), settings)
    system.at_tick(30, lambda: system.request("pause") and None)
    request = encode(Request(OPERATOR, "resume", "resume", b"{}"))
    system.bus.put(OPERATOR, channels.REQUEST, OPERATOR, request, 40 * 1000 * MS)
    system.run()
    assert system.supervisor.state.frame.tick == TICKS and system.answers["resume"].accepted
    assert lines == [f"run ends at tick {TICKS}: done"]


@pytest.mark.parametrize(
    ("waiting_for", "released", "busy", "delivered", "n1", "n2", "late"),
    [
        ("", 20, 0, 30, 31, 31, VHUB),
        ("commit", 20, 0, 30, 31, 31, VHUB),
        (DONE_OF + "player-red", 20, 0, 30, 31, 31, "player-red"),
        (SAMPLES_OF + "n2", 20, 0, 30, 31, 31, "n2"),
        ("", 20, 0, 24, 25, 30, "n2"),  # 6 ms from its inputs, after 4 ms of the vHub
        ("", 20, 8, 28, 29, 29, SUPERVISOR),
        ("", 40, 0, 21, 44, 41, "n1"),  # the 20 ms before belong to the clock
    ],
)
def test_a_late_tick_is_blamed_on_the_longest_share(
    waiting_for: str, released: int, busy: int, delivered: int, n1: int, n2: int, late: str
) -> None:
    """Times in ms. Tick 10 begins at 20 ms; its release is due at `released`, and then the supervisor is busy."""
    settings = RunSettings("run", TABLE.name, with_nodes(TEXT, TABLE.name, 2), REALTIME)
    monitor = ProgressMonitor(RunState(settings, bytes(32), "boot", "clock"), 0)
    monitor.committed(10, 0, 0, 20 * MS)
    monitor.released(10, released * MS)
    monitor.took(released * MS, (released + busy) * MS)
    for tick, cause in ((9, waiting_for), (7, DONE_OF + "player-blue")):
        monitor.on_heartbeat(Heartbeat(VHUB, tick, 1, cause, "", 0.0, b""))
    monitor.delivered(10, delivered * MS)
    monitor.part(10, "n1", n1 * MS)
    monitor.part(10, "n2", n2 * MS)
    line = monitor.committed(11, 9 * MS, released * MS, max(n1, n2) * MS)
    assert monitor.late == late and line == f"tick 11: lag 9.0 ms, waited for {late} (1 late ticks)"


@pytest.mark.parametrize(
    ("samples_ms", "done_ms", "busy_ms", "least_ms", "cause"),
    [
        (15, 18, 0, 1, "samples of n2"),
        (12, 18, 0, 1, "Done of player-red"),
        (10, 10, 0, 1, ""),
        (12, 15, 0, 4, ""),
        (10, 20, 10, 1, ""),
        (10, 20, 3, 7, "Done of player-red"),
    ],
)
def test_the_vhub_names_whom_it_waited_for_longest(
    samples_ms: int, done_ms: int, busy_ms: int, least_ms: int, cause: str
) -> None:
    """If that was long enough to matter, and without the time in which it was busy itself."""
    waits = WaitTimes()
    waits.node, waits.client = "n2", "player-red"
    waits.begin(10 * MS)
    waits.begin(11 * MS)
    waits.close_world(samples_ms * MS)
    waits.took(samples_ms * MS, (samples_ms + busy_ms) * MS)
    assert waits.close(done_ms * MS, least_ms * MS) == cause
