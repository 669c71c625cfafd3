"""Limits: what clients send too much of is counted, costs others nothing, and fits into every message and record."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Final

import pytest

from foosim.analysis.explain import PacketName, explain_packet
from foosim.capture.reader import open_capture
from foosim.common import limits
from foosim.protocol import channels
from foosim.protocol.codec import decode, encode
from foosim.protocol.messages import Deliveries, Sent, Up
from foosim.runtime.journal import Journal, JournalError, read_journal
from foosim.vhub.state.hub_state import HubState
from foosim.vhub.state.records import Fold
from foosim.world.robot_packets import RobotPacket
from tests.links.offered import Hub, deployment_of
from tests.vhub.conftest import Driver, HubRun, drive, write_capture

SETS: Final = ("clients={loud-1: {}, loud-2: {}, quiet: {}}", "network.links=[]", "players={}")
LOUD: Final = ("loud-1", "loud-2")
TICKS: Final = 6
FLOODED: Final = 3


class Flood(Driver):
    """Two clients flood a robot and a third client, which says a word at each tick."""

    def __init__(self, packets: int, size: int) -> None:
        super().__init__(SETS)
        self.sent = dict.fromkeys((*LOUD, "quiet"), 0)
        self.said: Counter[str] = Counter()
        """Packets by client."""
        self._packets, self._payload = packets, bytes(size)

    def _samples(self, tick: int, robot: str) -> list[RobotPacket]:
        return []

    def _clients_before(self, tick: int) -> None:
        if tick == 0:
            for name in self.sent:
                self.join(name, 0, [])
            return
        if tick < TICKS:
            self._say("quiet", 1, "blue.goal")
        if tick == FLOODED:
            for name in LOUD:
                for part in range(4):
                    self._say(name, self._packets // 4, ("red.goal", "quiet")[part % 2])

    def _say(self, name: str, count: int, destination: str) -> None:
        """Log as many packets as fit into a message at a time."""
        at_once = limits.RADIO_MESSAGE_BYTES_MAX // (limits.PACKET_HEAD_BYTES_MAX + len(self._payload))
        while count > 0:
            numbers = range(self.sent[name] + 1, self.sent[name] + 1 + min(count, at_once))
            packets = [Sent(number, destination, "talk", 0, self._payload) for number in numbers]
            self.say(channels.UP, name, encode(Up(name, "one", packets)))
            self.sent[name] = numbers[-1]
            self.said[name] += len(numbers)
            count -= len(numbers)


def flooded(packets: int, size: int) -> tuple[Flood, HubRun]:
    driver = Flood(packets, size)
    driver.start()
    for _ in range(TICKS):
        driver.close()
    return driver, driver.end()


@pytest.mark.parametrize(("packets", "size"), [(60_000, 0), (2_000, 32_000)])
def test_a_flood_is_refused_and_dropped_and_counted_and_fits_into_every_message(
    packets: int, size: int, tmp_path: Path
) -> None:
    driver, run = flooded(packets, size)
    state = driver.core.state
    assert state is not None
    for payload in (payload for payloads in run.deliveries.values() for payload in payloads):
        decode(Deliveries, payload)
    for _, down in run.downs:
        decode(type(down), encode(down), limits.RADIO_MESSAGE_BYTES_MAX)
    fates = Counter(flight.cause for closing in run.closings for flight in closing.fates)
    account = state.packets
    assert fates["rx_full"] > 0 and fates["rx_full"] == account.dropped
    assert account.offered == fates.total() and account.in_flight == fates["in_flight"]
    behind_a_gap = driver.said.total() - account.offered - account.refused
    assert state.refusals.keys() == ({"inbox_full"} if size else set())
    assert behind_a_gap == 0 or size > 0, "what follows on what was refused is sent again by a client"
    with Journal(tmp_path, "vhub") as journal:
        for record in run.journal:
            journal.append(record)
    again = Fold(driver.deployment, run.journal)
    assert [*again] and again.state.snapshot() == run.snapshots[-1]


def test_a_flood_costs_others_no_packet() -> None:
    """The words of the quiet one all come; and it hears as much of each flood as fits, the first of it."""
    _, run = flooded(60_000, 0)
    words = [flight.cause for closing in run.closings for flight in closing.fates if flight.source == "quiet"]
    assert len(words) == TICKS - 1 and {*words} == {""}
    (heard,) = [down.packets for name, down in run.downs if name == "quiet" and down.packets]
    for name in LOUD:
        numbers = [packet.sequence for packet in heard if packet.source == name]
        assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))
        assert len(numbers) == limits.CLIENT_BYTES_PER_TICK_MAX // 2 // limits.PACKET_HEAD_BYTES_MAX


def test_a_flood_of_broadcasts_is_refused_from_a_bound_on(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each subscriber of the channel is one offered packet; a channel without subscribers offers none."""
    monkeypatch.setattr(limits, "PACKETS_PER_MESSAGE_MAX", 10)
    hub = Hub(deployment_of(), joined=("a", "b", "c"))
    offered = []
    for numbers, channel in ((range(1, 9), "news"), (range(9, 13), "news"), (range(13, 30), "unheard")):
        hub.close({"a": [Sent(number, "", channel, 0, b"here") for number in numbers]})
        offered.append(hub.state.packets.offered)
    assert offered == [10, 18, 18] and hub.state.refusals == {"broadcast_full": 3}, "each tick begins anew"


KIB: Final = 1024
MOST: Final = 64 * KIB
SIZE: Final = 1000
HELD: Final = MOST // 2 // (limits.FLIGHT_HEAD_BYTES + SIZE)
CLOG: Final = "network.events=[{at: 0 s, clog: {from: a, to: b}, for: 10 ms}]"


def words(destination: str, numbers: range, size: int = SIZE) -> list[Sent]:
    return [Sent(number, destination, "data", 0, bytes(size)) for number in numbers]


@pytest.mark.parametrize("restarts", [False, True])
def test_a_clog_holds_back_a_share_and_costs_others_nothing(restarts: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(limits, "TRANSIT_BYTES_MAX", MOST)
    hub = Hub(deployment_of(CLOG))
    hub.close({"a": words("b", range(1, 21))})
    if restarts:
        hub = Hub(hub.deployment, HubState.restore(hub.deployment, hub.state.snapshot()))
    hub.close({"a": words("b", range(21, 101)), "c": words("d", range(1, 3))})
    assert Counter(flight.cause for flight in hub.fates) == {"transit_full": 100 - HELD}
    assert len(hub.state.snapshot()) < MOST and hub.state.packets.in_flight == HELD + 2
    hub.close({"c": words("d", range(3, 41))})
    share = MOST // 2 // len(hub.deployment.endpoints()) // (limits.FLIGHT_HEAD_BYTES + SIZE)
    assert hub.state.packets.in_flight == HELD + share, "those of before are there; of others as many as a share has"
    again = HubState.restore(hub.deployment, hub.state.snapshot())
    assert again.snapshot() == hub.state.snapshot()
    for _ in range(4):
        hub.close({})
    assert hub.state.packets.in_flight == 0
    hub.close({"a": words("b", range(101, 101 + HELD))})
    assert hub.state.packets.in_flight == HELD, "there is room again"


def test_explain_says_that_there_was_no_room(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(limits, "TRANSIT_BYTES_MAX", 2 * KIB)
    run = drive(12)
    capture = open_capture(write_capture(tmp_path / "run.mcap", run).path)
    fates = [flight for closing in run.closings for flight in closing.fates]
    flight = next(flight for flight in fates if flight.cause == "transit_full")
    which = PacketName(flight.source, flight.sequence, flight.destination, flight.copy)
    explained = explain_packet(capture, which)
    assert explained.verdict == "dropped at sending: transit_full (receiver)" and explained.agrees
    assert explained.steps[-1].text == "the packets in flight in the whole run leave no room for it: transit_full"


def test_a_record_that_is_too_large_is_a_journal_that_fails(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(limits, "JOURNAL_BYTES_MAX", 100)
    journal = Journal(tmp_path, "vhub", sync_every_s=60)
    journal.append(bytes(100))
    why = "cannot be written, a record has 101 bytes, a file of it has 100 at most"
    for record in (bytes(101), b"behind it"):
        with pytest.raises(JournalError, match=why):
            journal.append(record)
    with pytest.raises(JournalError):
        journal.close()
    assert list(read_journal(tmp_path, "vhub")) == [bytes(100)]
