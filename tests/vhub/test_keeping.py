"""The order in which things leave the vHub: records, deliveries, packets of clients, closings for the capture."""

from __future__ import annotations

from typing import Final

import pytest

from foosim.common import limits
from foosim.common.json_text import decode_json
from foosim.common.limits import HEARTBEAT_NS
from foosim.protocol import channels
from foosim.protocol.actions import Journal, Publish
from foosim.protocol.codec import decode_any
from foosim.protocol.messages import Commit, End, Farewell, Tempo, Up
from foosim.vhub.core import HubCore
from foosim.vhub.main import needs_record
from foosim.vhub.network.packet import Flight
from foosim.vhub.paced_release import Release, Releases
from foosim.vhub.state.records import Closing
from foosim.vhub.status import LINKS_REPORTED_EVERY
from tests.vhub.test_sessions import FRAME, MS, PERIODS, Hub, sent

T: Final = 2 * MS
LATER_NS: Final = 3 * T + 7


def closing(tick: int) -> Closing:
    return Closing(type(FRAME)(tick, FRAME.layout, FRAME.values), b"", [], [])


class Later(Releases):
    """Lets everything leave `LATER_NS` after its tick was closed."""

    def add(
        self,
        client: str,
        number: int,
        tick: int,
        flights: list[Flight],
        now_ns: int,
        since: int = 0,
        absent: tuple[str, ...] = (),
    ) -> None:
        self._waiting.append(Release(now_ns + LATER_NS, client, number, tick, flights))


class Kept:
    """A hub in which `eye` sends a packet to `ear` in every tick, and what it gave to the capture."""

    def __init__(self) -> None:
        self.hub = Hub().begin()
        self.hub.core.releases = Later(T)
        self.hub.say(channels.TEMPO, "supervisor", Tempo("realtime", False))
        for name in ("ear", "eye"):
            self.hub.enter(name)
        self.journaled = 0
        self.kept: list[Closing] = []
        self.left: list[tuple[int, int]] = []
        """(number of the packet, when its Down was said)"""

    def close(self, tick: int) -> None:
        self.hub.now_ns = tick * T
        self.hub.say(channels.UP, "eye", Up("eye", "one", [sent(tick + 1, "ear")]))
        self.hub.close(tick)
        self.hub.core.wake(self.hub.now_ns)
        self.take()

    def take(self) -> None:
        actions = [*self.hub.core.actions]
        self.kept += [action for action in actions if isinstance(action, Closing)]
        self.journaled += sum(isinstance(action, Journal) for action in actions)
        for down in self.hub.said(channels.DOWN):
            self.left += [(packet.sequence, self.hub.now_ns) for packet in down.packets]

    @property
    def released(self) -> list[tuple[int, int]]:
        """(number of the packet, when it left as the capture has it)"""
        to_ear = [flight for closing in self.kept for flight in closing.fates if flight.destination == "ear"]
        return [(flight.sequence, flight.released_wall_ns) for flight in to_ear if not flight.cause]


def test_a_packet_that_leaves_later_is_kept_with_the_time_at_which_it_left() -> None:
    run = Kept()
    for tick in range(9):
        run.close(tick)
    assert run.journaled >= 9, "the journal waits for nothing"
    assert [closing.frame.tick for closing in run.kept] == [0, 1, 2, 3, 4], "packets of tick 5 still wait"
    assert run.left and run.released == run.left
    assert run.released == [(sequence, (sequence + 4) * T) for sequence in range(1, 5)]


def test_at_the_end_what_waits_leaves_and_all_closings_are_kept() -> None:
    run = Kept()
    for tick in range(9):
        run.close(tick)
    run.hub.commit(9, last=True)
    run.hub.say(channels.END, "supervisor", End(9, "enough", False))
    run.take()
    assert run.hub.core.finished and [closing.frame.tick for closing in run.kept] == list(range(10))
    assert run.released == run.left and [sequence for sequence, _ in run.left] == list(range(1, 9))
    assert all(wall_ns for _, wall_ns in run.released)


def ended_amid(hub: Hub, tick: int) -> list[Closing]:
    """What the capture gets of a run that ends at `tick` while the vHub waits for something before it."""
    kept = [action for action in hub.core.actions if isinstance(action, Closing)]
    hub.core.actions.clear()
    hub.say(channels.END, "supervisor", End(tick, "lost the journal", True))
    hub.now_ns += limits.DOWNLINK_KEPT_NS
    hub.core.wake(hub.now_ns)
    assert hub.core.finished
    return kept + [action for action in hub.core.actions if isinstance(action, Closing)]


def test_frames_behind_a_tick_that_is_half_closed_are_kept() -> None:
    """Deliveries of a tick let nodes compute the frame behind it, whoever its own closing waits for."""
    hub = Hub().begin()
    for tick in range(5):
        hub.close(tick)
    for tick in (5, 6):
        hub.commit(tick)
    assert hub.core.waiting_for == "Done of hand"
    kept = ended_amid(hub, 6)
    assert [closing.frame.tick for closing in kept] == list(range(7))
    assert kept[5].joins == kept[6].joins == [] and kept[6].delivered == hub.state.deliveries[5]


def test_so_are_those_behind_one_whose_samples_have_not_come() -> None:
    hub = Hub().begin()
    for tick in range(2):
        hub.close(tick)
    for tick in range(2, 5):
        frame = type(FRAME)(tick, FRAME.layout, FRAME.values, {FRAME.layout["red.goal"].index: b"to somebody"})
        content = frame.digest, frame.values.tobytes(), frame.outbox_items
        hub.say(channels.COMMIT, "vhub", Commit(1, tick, *content, [], False))
    assert hub.core.waiting_for.startswith("samples of ")
    assert [closing.frame.tick for closing in ended_amid(hub, 4)] == list(range(5))


def test_a_commit_that_an_ended_run_lacks_is_asked_for_while_a_client_is_waited_for() -> None:
    hub = Hub().begin()
    hub.commit(0)
    hub.said()
    hub.core.wake(limits.WANT_AFTER_NS)
    assert not hub.said(channels.WANT), "the tick waits for clients alone"
    hub.now_ns = limits.WANT_EVERY_NS_MAX
    hub.say(channels.END, "supervisor", End(2, "lost the journal", True))
    for lacking in (1, 2):
        hub.core.wake(hub.now_ns)
        (want,) = hub.said(channels.WANT)
        assert (want.kind, want.tick) == (channels.COMMIT.name, lacking)
        hub.commit(lacking)
        hub.now_ns += limits.WANT_EVERY_NS_MAX // 4
    hub.core.wake(hub.now_ns)
    assert not hub.said(channels.WANT) and not hub.core.finished
    assert [closing.frame.tick for closing in ended_amid(hub, 2)] == [0, 1, 2]


def test_a_vhub_whose_journal_has_failed_says_how_it_is_and_what_it_lacks() -> None:
    """All else tells of what is not written."""
    hub = Hub().begin()
    hub.close(0)
    hub.core.wake(limits.WANT_EVERY_NS_MAX)
    said = [action for action in hub.core.actions if isinstance(action, Publish)]
    assert {"want", "heartbeat"} == {each.channel.name for each in said if not needs_record(each)}
    assert {"deliveries", "down"} <= {each.channel.name for each in said if needs_record(each)}


def test_deliveries_may_leave_behind_their_record_and_before_the_rest_of_the_closing() -> None:
    hub = Hub().begin()
    hub.said()
    spoken: list[list[object]] = []
    with pytest.MonkeyPatch.context() as patch:

        def advance(core: HubCore, now_ns: int) -> None:
            while core.step(now_ns, now_ns + 7 * len(spoken)):
                spoken.append([*core.actions])

        patch.setattr(HubCore, "advance", advance)
        hub.close(0)
    actions, _ = spoken
    assert isinstance(actions[-2], Journal)
    assert isinstance(actions[-1], Publish) and actions[-1].channel is channels.DELIVERIES
    assert len(hub.core.actions) > len(actions), "the capture gets the closing when it is complete"


def test_what_clients_have_to_answer_is_waited_for_together() -> None:
    hub = Hub()
    assert hub.core.lacking == (channels.UP, 1), "somebody has to join"
    hub.begin()
    assert hub.core.lacking[0] is channels.COMMIT
    hub.commit(0)
    assert hub.core.lacking == (channels.UP, len(PERIODS))
    first, *others = PERIODS
    hub.done(first, 0)
    assert hub.core.lacking == (channels.UP, len(others))
    for name in others:
        hub.done(name, 0)
    assert hub.core.lacking[0] is channels.COMMIT


def test_what_is_sent_between_ticks_ends_no_wait() -> None:
    hub = Hub().begin()
    hub.say(channels.TEMPO, "supervisor", Tempo("realtime", False))
    hub.enter("ear")
    hub.close(0)
    before = hub.core.lacking
    hub.say(channels.UP, "ear", Up("ear", "one", [sent(1)]))
    assert hub.core.lacking == before and before[0] is channels.COMMIT


def test_heartbeats_share_the_lines_about_links_and_the_farewell_has_its_own() -> None:
    hub = Hub().begin()
    hub.enter("ear")
    counts = []
    for beat in range(2 * LINKS_REPORTED_EVERY + 2):
        hub.say(channels.UP, "ear", Up("ear", "one", [sent(beat + 1)]))
        hub.close(beat)
        hub.said()
        hub.core.wake(beat * HEARTBEAT_NS)
        (report,) = (decode_json(each.report) for each in hub.said(channels.HEARTBEAT))
        counts.append((report["packets"]["offered"], sum(link[2] for link in report["links"])))
    anew = [beat // LINKS_REPORTED_EVERY * LINKS_REPORTED_EVERY for beat in range(len(counts))]
    assert counts == [(beat + 1, told + 1) for beat, told in enumerate(anew)]
    last = decode_json(decode_any(Farewell, hub.core.farewell().payload).report)
    assert sum(link[2] for link in last["links"]) == len(counts)
