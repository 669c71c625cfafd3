"""When the vHub speaks and what it waits for: deliveries before the rest of a closing, answers of clients together."""

from __future__ import annotations

from foosim.protocol import channels
from foosim.protocol.actions import Journal, Publish
from foosim.protocol.codec import decode_json
from foosim.protocol.messages import Tempo, Up
from foosim.vhub.report import report
from tests.vhub.test_sessions import DEPLOYMENT, MS, PERIODS, Hub, sent


def test_deliveries_may_leave_behind_their_record_and_before_the_rest_of_the_closing() -> None:
    hub = Hub().begin()
    hub.said()
    spoken: list[list[object]] = []

    def speak(now_ns: int) -> int:
        spoken.append([*hub.core.actions])
        return now_ns + 7

    hub.core.speak = speak
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


def test_its_report_tells_how_late_packets_left() -> None:
    """One tick is closed 7 ms late, so what was due within it leaves that much later than the clock said."""
    hub = Hub()
    hub.say(channels.TEMPO, "supervisor", Tempo("realtime", False))
    hub.begin()
    hub.enter("ear")
    assert decode_json(report(hub.core))["lateness_ms"] is None
    hub.commit(0)
    for name in PERIODS:
        hub.done(name, 0, *([sent(1, "ear")] if name == "hand" else []))
    hub.now_ns = DEPLOYMENT.tick_ns + 7 * MS
    hub.commit(1)
    hub.core.wake(hub.now_ns)
    (down,) = [down for down in hub.said(channels.DOWN) if down.packets]
    late = hub.now_ns - max(packet.due_ns for packet in down.packets)
    assert late >= 7 * MS
    assert decode_json(report(hub.core))["lateness_ms"] == {"p50": late / MS, "p99": late / MS, "max": late / MS}
