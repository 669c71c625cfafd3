"""What happened in a capture: marks to the tick, windows of links at any time, the last drops explained."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from math import isnan
from pathlib import Path
from typing import Literal

import numpy as np
import pytest

from foosim.analysis.explain import PacketName, explain_packet
from foosim.capture.reader import open_capture
from foosim.capture.rows import CLIENTS, PACKETS, TICK, EditRow, EpochRow, OwnerRow, RecoveryRow
from foosim.console.recorded.capture_curves import curve_points, reading_points
from foosim.console.recorded.capture_history import CaptureHistory
from foosim.console.recorded.link_history import LinkHistory, PacketMark
from foosim.console.recorded.recording import Recording
from foosim.console.shown.source import Curve
from foosim.console.shown.timeline import MARKS_MAX, Mark, Timeline, WorldEvents, edit_text
from foosim.deployment.loader import load_deployment
from foosim.deployment.schema import Deployment
from foosim.library.table.football import kickoff_ticks
from foosim.library.table.table import BALL
from foosim.world.assembly.initial_state import initial_frame
from foosim.world.frame import Frame
from foosim.world.layout import WORLD
from tests.simulation.conftest import TABLE, TICK_NS, TICKS, added_tick

SECOND_NS = 1_000_000_000


@pytest.fixture(scope="module")
def table() -> Deployment:
    return load_deployment(TABLE.read_text(), TABLE.name)


def opened(path: Path) -> CaptureHistory:
    """A history that was read to its end."""
    history = CaptureHistory(Recording(path, (PACKETS, CLIENTS)))
    while not history.is_complete:
        history.gather(97)
    return history


@pytest.fixture(scope="module")
def history(run: Path) -> CaptureHistory:
    return opened(run)


# --- marks -----------------------------------------------------------------------------------------------------------


class Played:
    """Frames of a table in which the rules' memory is what a test writes."""

    def __init__(self, deployment: Deployment) -> None:
        self.frame = initial_frame(deployment)
        self.events = WorldEvents(deployment)
        self.events.take(self.frame)

    def at(self, tick: int, **slots: float) -> list[Mark]:
        """What is found at a frame with these slots: of the ball, or score_red, kickoffs."""
        values = np.array(self.frame.values)
        for name, value in slots.items():
            entity, field, offset = {
                "score_red": (WORLD, "football.score", 0),
                "score_blue": (WORLD, "football.score", 1),
                "kickoffs": (WORLD, "football.kickoffs", 0),
                "quarantined": (BALL, "quarantined", 0),
            }.get(name, (BALL, f"football.{name}", 0))
            values[self.frame.layout[entity].offsets[field] + offset] = value
        self.frame = Frame(tick, self.frame.layout, values)
        return self.events.take(self.frame)


def test_what_the_rules_did_is_found_to_the_tick_between_frames(table: Deployment) -> None:
    wait = kickoff_ticks(table)
    played = Played(table)
    assert played.at(wait - 6, wait_ticks=6) == []
    assert played.at(wait + 6, wait_ticks=0, kickoffs=1) == [Mark(wait, "kickoff", "kick-off of ball")]
    assert played.at(1000, wait_ticks=wait - 3, score_red=1) == [Mark(997, "goal", "goal of red, 1 : 0")]
    assert played.at(1010, wait_ticks=wait - 13) == []
    assert played.at(2000, wait_ticks=0, kickoffs=2) == [Mark(997 + wait, "kickoff", "kick-off of ball")]
    assert played.at(2100, out_ticks=40, still_ticks=1, quarantined=1) == [
        Mark(2100, "quarantine", "ball is in quarantine")
    ]
    assert played.at(2200, wait_ticks=wait, out_ticks=0, quarantined=0) == [Mark(2200, "out", "ball left the table")]
    assert played.at(2200 + wait, wait_ticks=0, kickoffs=3)[0].tick == 2200 + wait
    played.at(4000, still_ticks=900)
    assert played.at(4010, wait_ticks=wait - 2, still_ticks=0) == [Mark(4008, "dead", "ball lay still")]
    late = played.at(9000, wait_ticks=0, kickoffs=6, score_red=2, score_blue=1)
    assert [mark.text for mark in late if mark.kind == "goal"] == ["goal of red, 2 : 0", "goal of blue, 2 : 1"]
    assert [mark.kind for mark in late if mark.kind != "goal"] == ["kickoff"] * 3, "those that no frame shows, too"
    assert played.at(10, wait_ticks=wait) == [], "an earlier frame begins anew"


def test_an_empty_battery_is_marked_once(fleet_text: Callable[..., str]) -> None:
    deployment = load_deployment(fleet_text(2), "hall")
    frame, events = initial_frame(deployment), WorldEvents(deployment)
    events.take(frame)
    marks = []
    for tick, charge in ((10, 1.0), (20, 0.0), (30, 0.0), (40, 5.0), (50, 0.0)):
        values = np.array(frame.values)
        values[frame.layout["rover02"].offsets["charge"]] = charge
        frame = Frame(tick, frame.layout, values)
        marks += events.take(frame)
    text = "the battery of rover02 is empty"
    assert marks == [Mark(20, "empty", text), Mark(50, "empty", text)]


def test_who_comes_and_goes_is_marked_by_the_event_alone(fleet_text: Callable[..., str]) -> None:
    """A robot that is absent is down in the frame, which is no mark."""
    sets = ("robots.rover02.spare=true", "events=[{at: 200 ms, entity: rover02, add: true}]")
    deployment = load_deployment(fleet_text(2, *sets), "hall")
    frame, events = initial_frame(deployment), WorldEvents(deployment)
    absent, down = (frame.layout["rover02"].offsets[slot] for slot in ("absent", "down"))
    assert (frame.values[absent], frame.values[down], events.take(frame)) == (1.0, 1.0, [])
    marks = []
    for tick, numbers in ((10, (1, 1)), (30, (0, 0)), (40, (0, 1)), (50, (1, 1)), (60, (0, 0))):
        values = np.array(frame.values)
        values[[absent, down]] = numbers
        marks += events.take(Frame(tick, frame.layout, values))
    added = 1 + 200_000_000 // deployment.tick_ns
    assert marks == [Mark(added, "event", "rover02 is added"), Mark(40, "down", "rover02 is out of service")]


def epoch(tick: int, number: int, roster: list[str], **owners: str) -> EpochRow:
    return EpochRow(tick, number, "0" * 64, roster, [OwnerRow(*pair) for pair in sorted(owners.items())], "")


def test_epochs_moves_recoveries_requests_and_drops_are_marks(table: Deployment) -> None:
    timeline = Timeline(table)
    timeline.take_epoch(epoch(0, 1, ["n1", "n2"], a="n1", b="n2"))
    timeline.take_epoch(epoch(50, 2, ["n1", "n2"], a="n2", b="n2"))
    timeline.take_epoch(epoch(90, 3, ["n1"], a="n1", b="n1"))
    timeline.take_recovery(RecoveryRow("node", "n2", "silent", 89, 3, 120_000_000))
    push = EditRow("push", "ball", impulse=[0.1, 0.0, 0.0])
    timeline.take_edits(21, [push, EditRow("set", "a", field="down", numbers=[1.0]), EditRow("network", event="{")])
    timeline.take_edits(26, [EditRow("add", "ball-2", numbers=[0.0] * 25)])
    timeline.take_edits(29, [EditRow("remove", "ball-2")])
    cut = '{"partition": [["player-red"], ["camera"]]}'
    timeline.take_edits(30, [EditRow("network", event=cut)])
    for at_ns in (0, 1, 30 * SECOND_NS):
        timeline.take_drop(at_ns, "blocked")
    timeline.take_drop(2, "random_loss")
    assert timeline.news() == [
        Mark(0, "drops", "3 dropped: blocked 2, random_loss 1"),
        Mark(20, "push", edit_text(push)),
        Mark(20, "set", "a is out of service"),
        Mark(21, "network", "an event of the network that cannot be read"),
        Mark(25, "add", "ball-2 was added"),
        Mark(28, "remove", "ball-2 was removed"),
        Mark(30, "network", "partition player-red | camera"),
        Mark(50, "move", "move a from n1 to n2"),
        Mark(89, "recovery", "node n2: silent, 120 ms without a commit"),
        Mark(90, "epoch", "epoch 3 without n2"),
        Mark(15_000, "drops", "1 dropped: blocked 1"),
    ]
    assert timeline.news() == []
    for tick in range(MARKS_MAX + 5):
        timeline.take_edits(tick + 1, [push])
    assert len(timeline.news()) == MARKS_MAX - 1, "bounded"


def test_drops_of_a_long_run_are_counted_in_longer_spans(table: Deployment) -> None:
    timeline = Timeline(table)
    drops = 20_000
    for second in range(drops):
        timeline.take_drop(second * SECOND_NS, "snr")
    marks = timeline.news()
    assert len(marks) <= 121 and sum(int(mark.text.split()[0]) for mark in marks) == drops


def test_a_run_has_its_marks(history: CaptureHistory, table: Deployment) -> None:
    recording = history.recording
    rows = [recording.row(TICK, number) for number in range(TICKS + 1)]
    asked = [(row.tick - 1, edit.kind, edit_text(edit)) for row in rows for edit in row.edits]
    assert sorted(kind for _, kind, _ in asked) == ["add", "push"]
    marks = [(mark.tick, mark.kind, mark.text) for mark in opened(recording.path).news()]
    assert [mark for mark in marks if mark[1] != "drops"] == [
        *asked,
        (kickoff_ticks(table), "kickoff", "kick-off of ball"),
    ]
    assert history.share == 1.0


# --- links -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("at", "window"), [(TICKS, TICKS), (150, 50), (37, 10), (0, 10), (299, 1)])
def test_a_window_has_what_the_packets_say(history: CaptureHistory, at: int, window: int) -> None:
    packets = open_capture(history.recording.path).packets
    at_ns, after_ns = at * TICK_NS, (at - window) * TICK_NS
    arrived_ns = np.where(packets.arrival_tick < 0, packets.sent_ns, packets.arrival_tick * TICK_NS)
    told = {(link["from"], link["to"], link["rule"]): link for link in history.links.windows(at_ns, window * TICK_NS)}
    used = packets.where(packets.sent_ns <= at_ns)
    assert told.keys() == set(zip(used.source, used.destination, used.rule, strict=True))
    for (source, destination, rule), link in told.items():
        own = (packets.source == source) & (packets.destination == destination) & (packets.rule == rule)
        sent = own & (packets.sent_ns > after_ns) & (packets.sent_ns <= at_ns)
        came = own & (arrived_ns > after_ns) & (arrived_ns <= at_ns)
        delivered, dropped = came & (packets.fate == "delivered"), came & (packets.fate == "dropped")
        assert (link["offered"], link["delivered"], link["dropped"]) == (sent.sum(), delivered.sum(), dropped.sum())
        assert link["causes"] == dict(Counter(packets.cause[dropped]))
        delays = (packets.due_ns - packets.sent_ns)[delivered]
        assert link["delay_ms"] == (pytest.approx(delays.mean() / 1e6) if len(delays) else None)
    only = history.links.windows(at_ns, window * TICK_NS, ("camera", "player-red"))
    assert only == [link for key, link in told.items() if key[:2] == ("camera", "player-red")]
    totals = history.links.totals(at_ns)
    assert totals["offered"] == len(used) and totals["delivered"] + totals["dropped"] + totals["in_flight"] == len(used)


def test_a_packet_is_dropped_when_it_is_sent_or_when_it_arrives_and_a_window_ends_with_its_last_moment() -> None:
    links = LinkHistory(TICK_NS)

    def add(sequence: int, sent: int, arrival: int, fate: Literal["delivered", "dropped", "in_flight"]) -> int:
        due_ns = arrival * TICK_NS - 1 if arrival >= 0 else -1
        cause = "snr" if fate == "dropped" else ""
        return links.add(PacketMark("a", sequence, "b", sent * TICK_NS, due_ns, arrival, fate, cause, "r"), sequence)

    assert add(1, 10, -1, "dropped") == 10 * TICK_NS
    assert add(2, 10, 14, "dropped") == 14 * TICK_NS
    assert add(3, 12, 13, "delivered") == add(4, 13, 20, "in_flight") == -1
    figures = {
        at: [(link["offered"], link["delivered"], link["dropped"]) for link in links.windows(at * TICK_NS, 2 * TICK_NS)]
        for at in (9, 10, 12, 13, 14, 16)
    }
    assert figures == {9: [], 10: [(2, 0, 1)], 12: [(1, 0, 0)], 13: [(2, 1, 0)], 14: [(1, 1, 1)], 16: [(0, 0, 0)]}
    assert links.last_drops("a", "b", 13 * TICK_NS) == [1] and links.last_drops("a", "b", 14 * TICK_NS) == [1, 2]
    assert links.windows(13 * TICK_NS, 2 * TICK_NS)[0]["delay_ms"] == pytest.approx((TICK_NS - 1) / 1e6)


def test_the_last_drops_of_a_link_are_explained_as_the_command_does(history: CaptureHistory) -> None:
    capture = open_capture(history.recording.path)
    packets = capture.packets
    lost = packets.where(packets.fate == "dropped")
    assert len(lost) > 3
    for number in range(len(lost)):
        source, destination = lost.source[number], lost.destination[number]
        at_ns = int(max(lost.sent_ns[number], lost.arrival_tick[number] * TICK_NS))
        told = history.watched(source, destination, at_ns)
        assert told["link"] == [source, destination] and "rule everything, from * to *: delay 1 ms" in told["rule"]
        name = PacketName(source, int(lost.sequence[number]), destination, int(lost.copy[number]))
        expected = explain_packet(capture, name)
        (drop,) = [drop for drop in told["drops"] if drop["head"] == expected.head]
        assert drop["verdict"] == expected.verdict and drop["cause"] == lost.cause[number]
        assert [step["text"] for step in drop["steps"]] == [step.text for step in expected.steps]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(history, "_requested", [(50, '{"set": {"link": "everything", "delay": "20 ms"}}')])
        rules = [history.watched("camera", "player-red", tick * TICK_NS)["rule"].splitlines() for tick in (49, 50)]
    assert "changed: delay 20 ms, since 0.1 s (tick 50), requested" in rules[1] and "mean 20" not in rules[0][-1]
    assert [len(lines) for lines in rules] == [3, 4] and rules[0][-1] != rules[1][-1]
    assert history.watched("nobody", "nobody", 0) == {"link": ["nobody", "nobody"], "rule": "", "drops": []}


# --- curves ----------------------------------------------------------------------------------------------------------


def test_curves_of_a_run_are_what_the_capture_has(history: CaptureHistory) -> None:
    recording = history.recording
    frames = [*open_capture(recording.path).each_frame()]
    place = frames[0].layout[BALL].offsets["position"]
    every = [(frame.tick, float(frame.values[place])) for frame in frames]
    assert curve_points(history, Curve("a", field=place), TICKS) == every
    spare = curve_points(history, Curve("s", field=frames[0].layout["ball-2"].offsets["position"]), TICKS)
    assert [tick for tick, _ in spare] == [tick for tick, _ in every]
    assert [isnan(value) for _, value in spare] == [tick < added_tick(recording.path) for tick, _ in every]
    score = curve_points(history, Curve("b", status="score.red"), TICKS)
    assert len(score) > 100 and {value for _, value in score} == {0.0}
    offered = curve_points(history, Curve("c", status="packets.offered"), TICKS)
    assert offered[-1][1] == history.links.totals(SECOND_NS)["offered"] and offered == sorted(offered)
    link = curve_points(history, Curve("d", link=("camera", "player-red"), figure="delivered"), TICKS)
    (window,) = history.links.windows(TICKS * TICK_NS, 5 * SECOND_NS, ("camera", "player-red"))
    assert [link[-1]] == [(TICKS, window["delivered"])]
    readings = reading_points(history, "camera", "ball", -1, TICKS * TICK_NS)
    assert len(readings) > 20 and all(len(numbers) == 3 for _, numbers in readings)
    assert curve_points(history, Curve("e", reading=("camera", "ball"), index=2), TICKS) == [
        (tick, numbers[2]) for tick, numbers in readings
    ]
    assert curve_points(history, Curve("f", reading=("camera", "nothing")), TICKS) == []
