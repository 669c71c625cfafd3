"""When the vHub speaks and what it waits for: deliveries before the rest of a closing, answers of clients together."""

from __future__ import annotations

import pytest

from foosim.common.json_text import decode_json
from foosim.common.limits import HEARTBEAT_NS
from foosim.protocol import channels
from foosim.protocol.actions import Journal, Publish
from foosim.protocol.codec import decode_any
from foosim.protocol.messages import Farewell, Tempo, Up
from foosim.vhub.core import HubCore
from foosim.vhub.status import LINKS_REPORTED_EVERY
from tests.vhub.test_sessions import PERIODS, Hub, sent


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
