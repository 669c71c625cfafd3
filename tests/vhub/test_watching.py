"""What the vHub keeps of links and readings that somebody looks at, that nothing is kept of what nobody looks at, and
that the run is the same whoever looks. In rehearsal, on virtual time.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Any, Final

import pytest
from msgspec.structs import replace

from foosim.analysis.explain import Explained, explain_row
from foosim.capture.rows import ClientRow, PacketRow
from foosim.common import limits
from foosim.common.json_text import decode_json, encode_json
from foosim.common.units import Pace
from foosim.console.live.watched import WatchList as Shown
from foosim.console.live.watched import explain_drops
from foosim.console.shown.source import Link
from foosim.protocol import channels
from foosim.protocol.codec import decode
from foosim.protocol.messages import Heartbeat, Watched
from foosim.simulation.settings import Traced
from foosim.simulation.system import Settings, System
from foosim.supervisor.settings import RunSettings
from foosim.vhub.network.packet import DROPPED, Flight
from foosim.vhub.recording.rows_of_closing import packet_row
from foosim.vhub.stages.explanation import Evidence
from foosim.vhub.state.records import Closing
from foosim.vhub.watching import DROPS_KEPT, READINGS_KEPT, REPORT_BYTES_MAX, WatchList
from foosim.world.edits import Disrupt
from foosim.world.frame import Frame
from foosim.world.robot_packets import RobotPacket
from tests.cli.test_net import text_of

TICKS: Final = 320
LINK: Final = ("camera", "player-red")
READING: Final = ("camera", "ball")
VIEWER: Final = "desk.1"
WIDER: Final[dict[str, Any]] = {"hz": 50, "links": [("camera", "player-blue")]}


@dataclass
class Run:
    """A run on radios, in which a link is cut, and what was seen of it."""

    ticks: int = TICKS
    closings: list[Closing] = field(default_factory=list)
    reports: list[dict[str, Any]] = field(default_factory=list)
    told: list[Watched] = field(default_factory=list)
    asked: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        settings = Settings(
            observer=self._observe, observes=("publish",), on_closing=self.closings.append, keeps_journals=True
        )
        self.system = System(RunSettings("run", "t.yaml", text_of(), Pace("realtime"), self.ticks), settings)
        cut = {"partition": [["camera"], ["rest"]], "for": "60 ms"}
        self.at(150, "network", event=cut)

    def _observe(self, traced: Traced) -> None:
        if traced.channel == channels.WATCHED.name:
            self.told.append(decode(Watched, traced.payload))
        elif traced.channel == channels.HEARTBEAT.name and traced.process == channels.VHUB:
            status = decode(Heartbeat, traced.payload).report
            if status:
                self.reports.append(decode_json(status))

    def at(self, tick: int, verb: str, **arguments: Any) -> Run:
        self.system.at_tick(tick, lambda: self.asked.append(self.system.request(verb, **arguments)))
        return self

    def do(self, tick: int, action: Callable[[], object]) -> Run:
        self.system.at_tick(tick, action)
        return self

    def go(self) -> Run:
        self.system.run()
        self.system.close()
        return self

    @property
    def watched(self) -> dict[str, Any]:
        """What the vHub reported last of what is looked at."""
        return next(status["watched"] for status in reversed(self.reports) if "watched" in status)


@cache
def unseen() -> Run:
    return Run().go()


@cache
def seen() -> Run:
    """The same run, at which two look: at frames and at everything that can be watched of a link and of a sensor."""
    run = Run().at(20, "watch", hz=100, links=[LINK], readings=[READING]).at(20, "describe")
    people = run.system.people
    for tick in range(30, TICKS, 40):
        run.do(tick, lambda: people.request("status", 0, {}, VIEWER, only_looks=True))
        run.do(tick, lambda: people.request("watch", 0, WIDER, VIEWER, only_looks=True))
    return run.go()


def drops_on(run: Run, link: tuple[str, str]) -> list[Flight]:
    fates = [flight for closing in run.closings for flight in closing.fates]
    return [f for f in fates if (f.source, f.destination) == link and packet_row(f).fate == DROPPED]


def test_a_run_is_the_same_whoever_looks() -> None:
    alone, looked_at = unseen(), seen()
    assert looked_at.system.people.viewed and looked_at.watched["readings"]
    one, other = alone.system, looked_at.system
    assert (
        one.supervisor.state.chain == other.supervisor.state.chain
        and one.hub.state is not None
        and other.hub.state is not None
    )
    assert one.hub.state.snapshot() == other.hub.state.snapshot()
    rows = [[packet_row(flight) for closing in run.closings for flight in closing.fates] for run in (alone, looked_at)]
    assert len(rows[0]) > 300 and rows[0] == rows[1]


def test_while_nobody_looks_nothing_is_kept_nor_said() -> None:
    run = unseen()
    assert run.reports and not any("watched" in status for status in run.reports) and not run.told
    assert not run.system.people.viewed


def test_the_last_drops_of_a_watched_link_are_told_as_rows() -> None:
    run = seen()
    told = run.watched
    assert set(told["drops"]) == {"camera>player-red", "camera>player-blue"}
    rows = [row for row, _ in drops(run, LINK)]
    assert len(rows) == DROPS_KEPT
    dropped = [replace(packet_row(flight), payload=b"", wall_released_ns=0) for flight in drops_on(run, LINK)]
    at = dropped.index(rows[-1])
    assert rows == dropped[at + 1 - DROPS_KEPT : at + 1] and len(dropped) - at < 20, "the last ones when it was told"


def test_the_readings_of_a_watched_sensor_are_told_with_their_ticks() -> None:
    told = seen().watched["readings"]
    assert set(told) == {"camera/ball"}
    readings = told["camera/ball"]
    ticks = [tick for tick, _ in readings]
    assert ticks == list(range(ticks[0], ticks[-1] + 1, 5)), "at 100 Hz, of ticks of 2 ms"
    frames = {closing.frame.tick: closing.frame for closing in seen().closings}
    for tick, numbers in readings:
        assert numbers == pytest.approx(frames[tick].vector("ball", "position", 3), abs=0.05)


def drops(run: Run, link: Link, frames: Mapping[int, Frame] | None = None) -> list[tuple[PacketRow, Explained]]:
    return explain_drops(run.system.supervisor.state.deployment, run.watched, link, (frames or {}).get)


def everything(run: Run) -> Evidence:
    """All that was known of a run: what a capture would have."""
    edits = [(closing.frame.tick, edit) for closing in run.closings for edit in closing.edits]
    joins = [(closing.frame.tick, joining) for closing in run.closings for joining in closing.joins]
    return Evidence(
        run.system.supervisor.state.deployment,
        {},
        [(tick, edit.event) for tick, edit in edits if isinstance(edit, Disrupt)],
        {closing.frame.tick: closing.frame for closing in run.closings}.get,
        lambda: [ClientRow(tick, joining.name, "joins", joining.period, []) for tick, joining in joins],
    )


def test_a_drop_is_explained_without_a_capture_as_it_is_with_one() -> None:
    run = seen()
    frames = {closing.frame.tick: closing.frame for closing in run.closings}
    causes = set()
    for link in (LINK, ("camera", "player-blue")):
        told = drops(run, link, frames)
        assert [explained for _, explained in told] == [explain_row(everything(run), row) for row, _ in told]
        assert all(explained.agrees and explained.verdict.startswith("dropped ") for _, explained in told)
        causes |= {row.cause for row, _ in told}
    assert len(causes) >= 2, causes
    assert drops(run, ("player-red", "camera")) == [], "nobody looks at that one"


def test_an_event_that_was_asked_for_is_known_in_an_explanation() -> None:
    """A cut while it lasts: all the last drops of the link are by it."""
    cut = {"partition": [["camera"], ["rest"]], "for": "200 ms"}
    run = Run(ticks=260).at(20, "watch", links=[LINK]).at(190, "network", event=cut).go()
    told = drops(run, LINK)
    assert {row.cause for row, _ in told} == {"partition"}
    policy = [step.text for _, explained in told for step in explained.steps if step.stage == "policy"]
    assert all("cut by request 1" in text for text in policy)
    deployment = run.system.supervisor.state.deployment
    console, (tick, _) = Shown(deployment), run.watched["events"][-1]
    calm = {**run.watched, "drops": {f"{LINK[0]}>{LINK[1]}": []}}
    (before,) = console.drops(calm, [LINK], (tick - 1) * deployment.tick_ns, {tick: "browser 3"})
    assert "cut" not in before["rule"] and console.drops(calm, [LINK], (tick - 1) * deployment.tick_ns) == []
    (after,) = console.drops(calm, [LINK], tick * deployment.tick_ns, {tick: "browser 3"})
    assert after["rule"].startswith(f"{before['rule']}\ncut by a partition: nothing passes, since ")
    assert f"(tick {tick}), requested by browser 3 until " in after["rule"]


def test_nobody_looks_any_more_and_nothing_is_kept() -> None:
    run = Run(ticks=200).at(20, "watch", links=[LINK], readings=[READING]).at(100, "watch").go()
    assert run.told[0] == Watched([LINK], [READING]) and run.told[1:] in ([Watched([], [])], [Watched([], [])] * 2)
    assert not run.system.hub.watching.links and not run.system.hub.watching.readings
    assert "watched" not in run.reports[-1]


def test_a_vhub_that_was_started_again_is_told_what_is_looked_at() -> None:
    run = Run().at(20, "watch", links=[LINK], readings=[READING])
    run.do(60, run.system.kill_hub).go()
    assert set(map(str, run.told)) == {str(Watched([LINK], [READING]))} and 2 <= len(run.told) <= 4
    assert list(run.system.hub.watching.links) == [LINK]


def test_a_supervisor_that_was_started_again_knows_no_lease_and_tells_the_vhub_so() -> None:
    run = Run().at(20, "watch", hz=50, links=[LINK])
    system = run.system
    run.do(120, lambda: system.kill(channels.SUPERVISOR)).do(120, lambda: system.start(channels.SUPERVISOR)).go()
    assert run.told[0].links and run.told[-1] == Watched([], [])
    assert not system.hub.watching.links and not system.supervisor.viewing.is_shown


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"links": "all"}, "links: a list of at most 64 pairs of names is needed"),
        ({"links": [LINK] * 65}, "links: a list of at most 64 pairs of names is needed"),
        ({"links": [["camera"]]}, "links: a pair of names is needed, not a list of 1"),
        ({"links": [["camera", 3]]}, "links: a pair of names is needed, not a list of 2"),
        ({"links": [["camera", "player-rad"]]}, "no endpoint 'player-rad'; there are "),
        ({"readings": [["player-red", "ball"]]}, "no robot 'player-red'; there are "),
        ({"readings": [["camera", "bal"]]}, "no sensor of camera 'bal'; there are ball, nearest is ball"),
    ],
)
def test_what_cannot_be_looked_at_is_refused(arguments: dict[str, Any], text: str) -> None:
    run = Run(ticks=30).at(20, "watch", **arguments).go()
    answer = run.system.answers[run.asked[-1]]
    assert not answer.accepted and answer.text.startswith(text), answer.text


def test_so_much_is_looked_at_together_and_no_more() -> None:
    run = Run(ticks=30)
    ends = run.system.supervisor.state.deployment.endpoints()
    pairs = [(a, b) for a in ends for b in ends]
    answers: list[str] = []
    asked = (("one", pairs[:40]), ("other", pairs[20:60]), ("third", pairs[60:90]))
    ask = run.system.people.request
    run.do(20, lambda: answers.extend(ask("watch", 0, {"links": links}, who) for who, links in asked)).go()
    told = [run.system.answers[identity] for identity in answers]
    assert [answer.accepted for answer in told] == [True, True, False]
    assert told[2].text == "links: at most 64 can be watched at once, these would be 90"


def test_a_report_of_what_is_looked_at_has_a_size() -> None:
    state = unseen().system.hub.state
    assert state is not None
    watching = WatchList()
    ranges = [("rover", f"ranges-{n}") for n in range(limits.WATCHED_MAX)]
    watching.take(Watched([LINK], ranges), b"", 0)
    for tick in range(2 * READINGS_KEPT):
        numbers = struct.pack("<64d", *(tick + n / 3 for n in range(64)))
        watching.sensed(tick, [RobotPacket(robot, 0, "", channel, numbers) for robot, channel in ranges])
    flight = Flight(*LINK, "ball", 1, 0, 0, b"x")
    flight.cause, flight.walls = "snr", tuple(f"wall-{n}" * 20 for n in range(64))
    watching.judged([flight] * 20)
    content = encode_json(watching.report(state))
    assert len(content) < 3 * REPORT_BYTES_MAX
    told = decode_json(content)
    assert isinstance(told, dict)
    assert {len(readings) for readings in told["watched"]["readings"].values()} == {1}, "the newest of each"
    assert told["watched"]["readings"]["rover/ranges-0"][-1][0] == 2 * READINGS_KEPT - 1
    assert len(told["watched"]["drops"]["camera>player-red"]) == DROPS_KEPT
