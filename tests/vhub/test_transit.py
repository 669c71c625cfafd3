"""What is on its way in a whole run is bounded, by sender; so is a record of the journal that holds it."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Final

import pytest

from foosim.analysis.explain import PacketName, explain_packet
from foosim.capture.reader import open_capture
from foosim.common import limits
from foosim.protocol.messages import Sent
from foosim.runtime.journal import Journal, JournalError, read_journal
from foosim.vhub.state.hub_state import HubState
from tests.links.offered import Hub, deployment_of
from tests.vhub.conftest import drive, write_capture

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
