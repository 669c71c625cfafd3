"""Clients that go while the run waits for them, and come back as others."""

from __future__ import annotations

from typing import Final

import msgspec
import pytest

from foosim.common import limits
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.protocol import channels
from foosim.protocol.actions import Journal, Publish
from foosim.protocol.codec import decode_any
from foosim.protocol.hub_messages import ResumeGrant
from foosim.protocol.messages import ClientHello, ClientRefusal, ClientWelcome, Down, Epoch, Failure, Go, Join, Tempo
from foosim.vhub.core import HubCore
from foosim.vhub.sessions import BOOTS_KEPT
from foosim.vhub.state.records import Closing, HubRecord, TickRecord
from foosim.vhub.state.resume import recall
from tests.vhub.test_sessions import BUILD, FRAME, MS, OWNERS, PERIODS, TABLE, Hub

PLAYERS: Final = apply_sets(TABLE.read_text(), TABLE.name, ("network.links=[]",))
RED: Final = "player-red"
BLUE: Final = "player-blue"


@pytest.mark.parametrize("answers", [False, True])
def test_whoever_has_the_name_of_a_client_that_a_tick_waits_for_is_waited_for(answers: bool) -> None:
    """A lockstep client dies amid its tick, another program joins free-running under its name, and goes too."""
    hub = Hub().begin()
    hub.commit(0)
    hub.done("knee", 0)
    hub.core.client_gone("hand", 0)
    hub.enter("hand", period=0, boot="two")
    if answers:
        hub.done("hand", 0, boot="two")
    hub.core.client_gone("hand", 0)
    assert hub.core.deadline_ns() >= 0
    hub.core.wake(9_999 * MS)
    assert not hub.core.lost, "it may come back, or go on: in fast an answer has 10 s"
    hub.core.wake(10_000 * MS)
    assert hub.core.lost == ("" if answers else "lost hand: its connection closed")
    assert hub.state.closed == (0 if answers else -1)


def test_a_vhub_that_stood_still_is_no_orphan_by_that() -> None:
    hub = Hub().begin()
    orphan_ns = hub.core.deployment.deadlines.orphan_ns  # type: ignore[union-attr]
    hub.core.orphan.hear(False, 0)
    hub.core.rest(2 * orphan_ns, 2 * orphan_ns)
    assert not hub.core.orphan.is_over(hub.core.deployment, 3 * orphan_ns - 1)
    assert hub.core.orphan.is_over(hub.core.deployment, 3 * orphan_ns)


def test_a_client_leaves_once_however_often_it_comes_and_goes() -> None:
    hub = Hub().begin()
    hub.enter("ear")
    hub.close(0)
    for boot in ("two", "three"):
        hub.core.client_gone("ear", 0)
        hub.enter("ear", boot=boot)
    hub.core.client_gone("ear", 0)
    for tick in range(1, 5):
        hub.close(tick)
    left = [action.leaves for action in hub.core.actions if isinstance(action, Closing)]
    assert [leaves for leaves in left if leaves] == [["ear"]]
    for tick in range(5, 15):
        if hub.state.hears_clients:
            hub.enter("ear", boot=f"at {tick}")
            hub.core.client_gone("ear", 0)
        hub.close(tick)
    left = [action.leaves for action in hub.core.actions if isinstance(action, Closing)]
    assert [leaves for leaves in left if leaves] == [["ear"]], "who has left cannot leave"


def hello(hub: Hub, name: str, boot: str, returns: int = 0) -> list[ClientWelcome | ClientRefusal]:
    """What a hello is answered."""
    hub.said()
    hub.say(channels.CLIENT_HELLO, name, ClientHello(name, boot, limits.PROTOCOL_VERSION, "", 0, returns))
    return hub.said(channels.CLIENT_WELCOME, channels.CLIENT_REFUSAL)


def test_what_comes_late_of_a_process_that_is_gone_is_of_nobody() -> None:
    """Its hello or its Join would make it one that is here, and for whom all wait."""
    hub = Hub().begin()
    hub.commit(0)
    hub.core.client_gone("hand", 0)
    assert hello(hub, "hand", "one") == [], "said before it went"
    hub.say(channels.UP, "hand", Join("hand", "one", PERIODS["hand"], []))
    assert hub.core.sessions.by_name["hand"].away_ns == 2_000 * MS
    (welcome,) = hello(hub, "hand", "two")
    assert isinstance(welcome, ClientWelcome)
    assert hello(hub, "hand", "one") == [], "another one has its place"
    (refusal,) = hello(hub, "hand", "three")
    assert isinstance(refusal, ClientRefusal) and refusal.reason == "a client hand is already here"
    hub.core.client_gone("hand", 0)
    (again,) = hello(hub, "hand", "two", returns=1)
    assert isinstance(again, ClientWelcome), "the same, whose connection was cut"


def test_a_client_that_is_no_player_does_not_end_the_run_by_saying_so() -> None:
    hub = Hub().begin()
    hub.say(channels.UP, "hand", Failure("hand", "one", "hand failed at tick 0: it says so"))
    assert not hub.core.lost and hub.core.statistics().malformed == 1


# --- hellos of which it is not known who lives -----------------------------------------------------------------------


def table() -> Hub:
    """A vHub of a table whose players are started again when they end."""
    return Hub(msgspec.structs.replace(BUILD, deployment=PLAYERS))


def playing() -> Hub:
    """One whose players wait for their second tick."""
    hub = table()
    for name in (RED, BLUE):
        hub.enter(name, 5)
    hub.say(channels.EPOCH, "supervisor", Epoch(1, 0, FRAME.digest, ["n1"], OWNERS, b""))
    for tick in range(5):
        hub.commit(tick)
        if not tick:
            hub.done(RED, tick)
            hub.done(BLUE, tick)
    assert hub.state.closed == 4
    return hub


def restarted(hub: Hub, proceeds: bool = True) -> Hub:
    """The vHub is started again."""
    records = [action.record for action in hub.core.actions if isinstance(action, Journal)]
    hub.core = HubCore("boot-2", bytes(32), 0)
    hub.say(channels.BUILD, "vhub", msgspec.structs.replace(BUILD, deployment=PLAYERS, boot="boot-2"))
    hub.core.begin(recall(load_deployment(PLAYERS, TABLE.name), BUILD.run, records, None, 0), 0)
    if proceeds:
        hub.say(channels.RESUME_GRANT, "vhub", ResumeGrant("vhub", "boot-2", 0))
    return hub


def join(hub: Hub, name: str, boot: str) -> list[ClientRefusal]:
    hub.said()
    hub.say(channels.UP, name, Join(name, boot, 5, []))
    return hub.said(channels.CLIENT_REFUSAL)


def test_a_player_that_fails_before_it_joins_is_heard_whoever_has_its_name() -> None:
    hub = table()
    hello(hub, RED, "dead")
    hello(hub, RED, "living")
    hub.say(channels.UP, RED, Failure(RED, "living", "no such class"))
    assert hub.core.lost == "no such class"
    hub = table()
    hello(hub, RED, "living")
    hello(hub, RED, "twin")
    join(hub, RED, "living")
    hub.say(channels.UP, RED, Failure(RED, "twin", "no such class"))
    assert not hub.core.lost, "another one plays"


@pytest.mark.parametrize(("living", "entries"), [(("one", 2), 0), (("two", 0), 1)])
@pytest.mark.parametrize("said", [None, ("one", 1), ("dead", 0)], ids=["nothing", "its hello", "a late hello"])
def test_a_player_that_only_loses_its_connection_again_is_not_lost(
    said: tuple[str, int] | None, living: tuple[str, int], entries: int
) -> None:
    """The connection to a vHub that was started again closes before the player joins."""
    hub = restarted(playing())
    if said is not None:
        hello(hub, RED, *said)
    hub.core.client_gone(RED, 0)
    assert len(hello(hub, RED, *living)) == 1
    assert join(hub, RED, living[0]) == []
    report = hub.core.clients.absences.report()
    assert (report["away"], len(report["over"])) == ([], entries)


def test_of_processes_that_come_and_go_under_one_name_the_last_are_kept() -> None:
    """However long a run is, and whether they join or not; what comes late of the last ones is of nobody still."""
    hub = table()
    for number in range(3 * BOOTS_KEPT):
        hub.enter(RED, 5, f"joins {number}")
        hub.core.client_gone(RED, 0)
        assert hello(hub, RED, f"joins {number}") == []
    session = hub.core.sessions.by_name[RED]
    for number in range(3 * BOOTS_KEPT):
        hello(hub, RED, "lives")
        hello(hub, RED, f"ends {number}")
        assert len(session.before) <= BOOTS_KEPT and len(session.claims) <= BOOTS_KEPT and "lives" in session.claims
    assert hello(hub, RED, "joins 94") == [] and join(hub, RED, "lives") == []
    assert session.boot == "lives"


@pytest.mark.parametrize("is_started", [False, True], ids=["ends before its hello", "is welcomed and joins late"])
def test_what_a_player_that_leaves_owing_was_not_told_is_said_behind_the_record(is_started: bool) -> None:
    """Its Go was for a process that had not joined: it counts as delivered, and has its number among its downlinks."""
    hub = restarted(playing())
    hub.say(channels.TEMPO, "supervisor", Tempo("realtime", False))
    hub.core.client_gone(RED, 0)
    if is_started:
        hello(hub, RED, "two")
    hub.commit(5)
    hello(hub, BLUE, "one", 1)
    join(hub, BLUE, "one")
    hub.done(BLUE, 5)
    assert hub.core.clients.waited == [RED] and not hub.said(channels.DOWN)
    hub.now_ns = 30_000 * MS
    hub.core.wake(hub.now_ns)
    hub.core.advance(hub.now_ns)
    actions = hub.core.actions
    (written,) = (at for at, action in enumerate(actions) if isinstance(action, Journal) and _is_of_tick(action, 5))
    (said,) = (at for at, action in enumerate(actions) if isinstance(action, Publish) and action.name == RED)
    assert written < said and hub.state.closed == 5
    number = hub.state.members[RED].downlink
    (down,) = hub.said(channels.DOWN)
    assert down == Down(number, 5, 0, [], False)
    if is_started:
        hub.say(channels.UP, RED, Join(RED, "two", 5, []))
        assert hub.said(channels.DOWN) == [down], "it may not have heard it before"


def told(hub: Hub, name: str) -> list[Go | Down]:
    """What was said to a client so far."""
    said = [action for action in hub.core.actions if isinstance(action, Publish) and action.channel is channels.DOWN]
    return [decode_any(Go | Down, action.payload) for action in said if action.name == name]


def left_owing() -> tuple[Hub, Go]:
    """A player was told its Go and died; the next process was welcomed, and has not joined when the run goes on."""
    hub = playing()
    hub.say(channels.TEMPO, "supervisor", Tempo("realtime", False))
    hub.commit(5)
    go = told(hub, RED)[-1]
    assert isinstance(go, Go) and go.tick == 5
    hub.core.client_gone(RED, 0)
    hub.say(channels.CLIENT_HELLO, RED, ClientHello(RED, "two", limits.PROTOCOL_VERSION, "", 0))
    hub.now_ns = 30_000 * MS
    hub.core.wake(hub.now_ns)
    assert hub.core.clients.waited == [BLUE]
    return hub, go


@pytest.mark.parametrize("joins", ["before the tick is closed", "late", "late, a vHub that was started again"])
def test_the_numbers_of_who_joins_behind_a_said_go_have_no_gap(joins: str) -> None:
    """It was welcomed when the Go was open, so it counts from there: what that had is said to it, with its number."""
    hub, go = left_owing()
    if joins.startswith("before"):
        hub.say(channels.UP, RED, Join(RED, "two", 5, []))
        assert told(hub, RED)[-1] == go, "nobody is to answer it any more"
    hub.done(BLUE, 5)
    assert hub.state.closed == 5
    boot, returns = "two", 0
    if joins.endswith("again"):
        hub, returns = restarted(hub), 1
        hub.say(channels.CLIENT_HELLO, RED, ClientHello(RED, boot, limits.PROTOCOL_VERSION, "", go.number - 1, returns))
    hub.say(channels.UP, RED, Join(RED, boot, 5, []))
    assert told(hub, RED)[-1] == Down(go.number, 5, go.acknowledged, go.packets, False)


def test_a_vhub_that_dies_behind_the_record_of_who_left_owing_leaves_nothing_unsaid() -> None:
    """It was written and not said; the next one says it when it may proceed, as it says the deliveries."""
    hub, go = left_owing()
    hub.done(BLUE, 5)
    owed = Down(go.number, 5, go.acknowledged, go.packets, False)
    (at,) = (at for at, action in enumerate(hub.core.actions) if isinstance(action, Journal) and _is_of_tick(action, 5))
    assert owed in told(hub, RED)
    del hub.core.actions[at + 1 :]
    assert owed not in told(hub, RED)
    hub = restarted(hub, proceeds=False)
    assert told(hub, RED) == []
    hub.say(channels.RESUME_GRANT, "vhub", ResumeGrant("vhub", "boot-2", 0))
    assert told(hub, RED) == [owed]


def _is_of_tick(action: Journal, tick: int) -> bool:
    record = decode_any(HubRecord, action.record)
    return isinstance(record, TickRecord) and (record.tick, record.owing) == (tick, [RED])
