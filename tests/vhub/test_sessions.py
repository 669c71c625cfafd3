"""The clients' side of the vHub: who is let in, stop and wait in lockstep, what free-running clients send.

Clients go while the run waits for them, and come back as others.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import msgspec
import pytest

from foosim.common import limits
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.protocol import channels
from foosim.protocol.actions import Action, Journal, Log, Publish
from foosim.protocol.channels import Channel
from foosim.protocol.codec import decode, decode_any, encode
from foosim.protocol.hub_messages import ResumeGrant
from foosim.protocol.messages import (
    Build,
    ClientHello,
    ClientRefusal,
    ClientWelcome,
    Commit,
    Deliveries,
    Done,
    Down,
    End,
    Epoch,
    Failure,
    Go,
    Join,
    Ready,
    Samples,
    Sent,
    Subscription,
    Tempo,
    Up,
)
from foosim.vhub.core import HubCore
from foosim.vhub.network.memory import Joining
from foosim.vhub.sessions import BOOTS_KEPT, Sessions
from foosim.vhub.state.hub_state import HubState
from foosim.vhub.state.members import may_lockstep
from foosim.vhub.state.records import Closing, HubRecord, TickRecord
from foosim.vhub.state.resume import recall
from foosim.world.assembly.initial_state import initial_frame

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
SETS: Final = (
    "players={}",
    "network.links=[]",
    "clients={ear: {}, eye: {}, hand: {lockstep: true, rate: 100 Hz}, knee: {lockstep: true, rate: 50 Hz}}",
    *(f"robots.{line}.sensors.encoder.rate=10 Hz" for line in ("red.goal", "red.defence", "red.midfield")),
)
TEXT: Final = apply_sets(TABLE.read_text(), TABLE.name, SETS)
DEPLOYMENT: Final = load_deployment(TEXT, TABLE.name)
FRAME: Final = initial_frame(DEPLOYMENT)
OWNERS: Final = [(robot, "n1") for robot in DEPLOYMENT.robots]
MS: Final = 1_000_000
PERIODS: Final = {"hand": 5, "knee": 10}
HELLO: Final = ClientHello("ear", "boot-1", limits.PROTOCOL_VERSION, "", 0)
BUILD: Final = Build("vhub", "boot", "first", "run", "table.yaml", TEXT, "fast")


class Hub:
    """A vHub, its supervisor and nodes played by hand. `said` is what it published since the last look."""

    def __init__(self, build: Build = BUILD) -> None:
        self.core = HubCore("boot", bytes(32), 0)
        self.now_ns = 0
        self.say(channels.BUILD, "vhub", build)
        self.core.begin(None, 0)

    def say(self, channel: Channel, name: str, message: msgspec.Struct | bytes) -> None:
        payload = message if isinstance(message, bytes) else encode(message)
        self.core.receive(channel, name, payload, self.now_ns)
        self.core.advance(self.now_ns)

    def said(self, *kinds: Channel) -> list[Any]:
        """Take what was published on these channels; all that was said is forgotten."""
        actions = [action for action in self.core.actions if isinstance(action, Publish)]
        self.core.actions.clear()
        return [decode_any(a.channel.message, a.payload) for a in actions if a.channel in kinds]

    def lines(self) -> list[str]:
        return [action.text for action in self.core.actions if isinstance(action, Log)]

    def enter(self, name: str, period: int | None = None, boot: str = "one", wanted: Sequence[str] = ()) -> None:
        self.say(channels.CLIENT_HELLO, name, ClientHello(name, boot, limits.PROTOCOL_VERSION, "", 0))
        heard = [Subscription(robot, "encoder") for robot in wanted]
        self.say(channels.UP, name, Join(name, boot, PERIODS.get(name, 0) if period is None else period, heard))

    def begin(self) -> Hub:
        for name in PERIODS:
            self.enter(name)
        self.say(channels.EPOCH, "supervisor", Epoch(1, 0, FRAME.digest, ["n1"], OWNERS, b""))
        return self

    def commit(self, tick: int, last: bool = False) -> None:
        frame = type(FRAME)(tick, FRAME.layout, FRAME.values)
        self.say(channels.COMMIT, "vhub", Commit(1, tick, frame.digest, frame.values.tobytes(), [], [], last))
        robots = [robot.name for robot in FRAME.layout.robots]
        self.say(channels.SAMPLES, "n1", Samples(tick, frame.digest, "n1", robots, []))

    def done(self, name: str, tick: int, *packets: Sent, boot: str = "one") -> None:
        self.say(channels.UP, name, Done(name, boot, tick, list(packets)))

    def close(self, tick: int) -> None:
        self.commit(tick)
        for name, period in PERIODS.items():
            if tick % period == 0:
                self.done(name, tick)

    @property
    def state(self) -> HubState:
        assert self.core.state is not None
        return self.core.state


def sent(sequence: int, destination: str = "red.goal", payload: bytes = b"") -> Sent:
    return Sent(sequence, destination, "echo", 0, payload)


# --- who is let in ---------------------------------------------------------------------------------------------------


def greeted(hello: ClientHello, state: HubState | None = None, sessions: Sessions | None = None) -> Any:
    actions: list[Action] = []
    sessions = sessions or Sessions("hub-boot", actions)
    sessions._actions = actions
    sessions.hello(hello, BUILD, DEPLOYMENT, state or HubState(DEPLOYMENT))
    (action,) = actions
    assert isinstance(action, Publish) and action.name == hello.name
    return decode_any(action.channel.message, action.payload)


REFUSED: Final[dict[str, tuple[dict[str, Any], str]]] = {
    "version": ({"version": 9}, f"protocol version 9, this is {limits.PROTOCOL_VERSION}"),
    "world": ({"world": "mars"}, "world mars, this is table"),
    "name": ({"name": "eear"}, "no client eear is declared; declared are ear, eye, hand, knee, nearest is ear"),
    "a robot's name": ({"name": "camera"}, "no client camera is declared; declared are ear, eye, hand, knee"),
    "the vHub's name": ({"name": "vhub"}, "no client vhub is declared; declared are ear, eye, hand, knee"),
}


@pytest.mark.parametrize("what", REFUSED)
def test_who_does_not_fit_is_refused_with_the_reason(what: str) -> None:
    changes, reason = REFUSED[what]
    hello = msgspec.structs.replace(HELLO, **changes)
    assert greeted(hello) == ClientRefusal(hello.name, "boot-1", reason)


def test_who_is_let_in_gets_the_deployment_and_its_numbers() -> None:
    assert greeted(HELLO) == ClientWelcome("ear", "boot-1", "hub-boot", 0, 0, "table.yaml", TEXT, "run")
    state = HubState(DEPLOYMENT)
    state.join(Joining("ear", 0, []), 0)
    state.members["ear"].sequence, state.members["ear"].downlink = 17, 4
    welcome = greeted(msgspec.structs.replace(HELLO, boot="boot-2"), state)
    assert (welcome.sequence, welcome.downlink) == (17, 4), "who comes back goes on with its numbers"


def test_a_name_is_taken_while_its_client_is_here() -> None:
    sessions = Sessions("hub-boot", [])
    first, again = greeted(HELLO, sessions=sessions), greeted(HELLO, sessions=sessions)
    assert first == again and isinstance(first, ClientWelcome)
    twin = msgspec.structs.replace(HELLO, boot="boot-2")
    assert greeted(twin, sessions=sessions) == ClientRefusal("ear", "boot-2", "a client ear is already here")
    assert sessions.by_name["ear"].boot == "boot-1"


def test_only_declared_lockstep_clients_are_waited_for() -> None:
    assert [name for name in ("ear", "eye", "hand", "knee", "stranger") if may_lockstep(DEPLOYMENT, name)] == [
        "hand",
        "knee",
    ]
    hub = Hub()
    assert not hub.said(channels.READY) and hub.core.waiting_for == "join of hand, knee"
    hub.enter("ear")
    hub.enter("knee")
    assert not hub.said(channels.READY) and hub.core.waiting_for == "join of hand"
    hub.enter("hand")
    (ready,) = hub.said(channels.READY)
    assert isinstance(ready, Ready) and ready.layout == FRAME.layout.digest and hub.core.waiting_for == "epoch"


@pytest.mark.parametrize("period", [1, 5, 2**62])
def test_no_other_client_can_make_the_run_wait_for_it(period: int) -> None:
    hub = Hub().begin()
    hub.enter("ear", period)
    assert hub.core.malformed == 1
    assert "ear joins in lockstep, but is not declared lockstep" in hub.lines()[-1]
    for tick in range(12):
        hub.close(tick)
    assert hub.state.closed == 11 and "ear" not in hub.state.members


# --- lockstep --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "wrong",
    [
        Done("hand", "another boot", 0, [sent(1)]),
        Done("hand", "one", 5, [sent(1)]),
        Done("hand", "one", 1, [sent(1)]),
        Done("ear", "one", 0, [sent(1)]),
        Up("hand", "another boot", [sent(1)]),
    ],
)
def test_what_is_no_answer_to_this_go_is_not_taken(wrong: Done | Up) -> None:
    hub = Hub().begin()
    hub.enter("ear")
    hub.commit(0)
    hub.said()
    hub.say(channels.UP, wrong.name, wrong)
    assert hub.core.waiting_for == "Done of hand, knee" and hub.core.repeated == 1
    hub.done("knee", 0)
    hub.done("hand", 0)
    (deliveries,) = hub.said(channels.DELIVERIES)
    assert deliveries.packets == [], "nothing of it counts"


def test_a_go_is_said_again_with_doubling_waits_until_it_is_answered() -> None:
    hub = Hub().begin()
    hub.commit(0)
    first = hub.said(channels.DOWN)
    hub.done("knee", 0)
    said_ms = []
    for ms in range(0, 3500, 5):
        hub.core.wake(ms * MS)
        again = hub.said(channels.DOWN)
        assert again in ([], [first[0]]), "the same bytes, to who has not answered"
        said_ms += [ms] if again else []
    assert said_ms == [20, 60, 140, 300, 620, 1260, 2260, 3260]
    hub.done("hand", 0)
    hub.core.wake(10_000 * MS)
    assert not hub.said(channels.DOWN)


@pytest.mark.parametrize(("pace", "allowed_ms"), [("fast", 10_000), ("realtime", 2_000), ("2x", 2_000)])
def test_who_does_not_answer_within_its_deadline_is_lost(pace: str, allowed_ms: int) -> None:
    hub = Hub().begin()
    hub.say(channels.TEMPO, "supervisor", Tempo(pace, False))
    hub.commit(0)
    hub.done("knee", 0)
    hub.said()
    hub.core.wake((allowed_ms - 1) * MS)
    assert not any(beat.lost for beat in hub.said(channels.HEARTBEAT))
    hub.core.wake(allowed_ms * MS)
    lost = [beat.lost for beat in hub.said(channels.HEARTBEAT) if beat.lost]
    kind = "fast" if pace == "fast" else "realtime"
    assert lost == [f"hand has not answered tick 0 for {allowed_ms / 1000:g} s (deadlines.lockstep_{kind})"]
    hub.core.wake(2 * allowed_ms * MS)
    assert {beat.lost for beat in hub.said(channels.HEARTBEAT)} == set(lost), "and stays so"


def test_no_deadline_passes_while_the_run_is_paused() -> None:
    hub = Hub().begin()
    hub.say(channels.TEMPO, "supervisor", Tempo("realtime", True))
    hub.commit(0)
    for second in range(100):
        hub.core.wake(second * 1000 * MS)
    assert hub.core.lost == ""
    hub.say(channels.TEMPO, "supervisor", Tempo("realtime", False))
    hub.core.wake(99_900 * MS)
    assert hub.core.lost == ""
    hub.core.wake(102_000 * MS)
    assert hub.core.lost.startswith("hand has not answered tick 0 for 2 s")


# --- free-running ----------------------------------------------------------------------------------------------------


def test_packets_are_judged_in_the_order_of_their_numbers_whatever_the_order_of_arrival() -> None:
    hub = Hub().begin()
    hub.enter("ear")
    hub.enter("eye")
    hub.close(0)
    hub.said()
    hub.say(channels.UP, "eye", Up("eye", "one", [sent(2), sent(1)]))
    hub.say(channels.UP, "ear", Up("ear", "one", [sent(3)]))
    hub.say(channels.UP, "ear", Up("ear", "one", [sent(1), sent(2)]))
    hub.close(1)
    (deliveries,) = hub.said(channels.DELIVERIES)
    assert [(packet.source, packet.sequence) for packet in deliveries.packets] == [
        ("ear", 1), ("ear", 2), ("eye", 1), ("eye", 2),
    ], "nothing behind a gap is taken: it comes again"  # fmt: skip
    hub.say(channels.UP, "ear", Up("ear", "one", [sent(2), sent(3)]))
    hub.close(2)
    (deliveries,) = hub.said(channels.DELIVERIES)
    assert [packet.sequence for packet in deliveries.packets] == [3] and hub.state.refusals == {"duplicate": 1}


def test_repeats_strangers_and_packets_to_nobody_are_refused_and_counted() -> None:
    hub = Hub().begin()
    hub.enter("ear")
    hub.say(channels.CLIENT_HELLO, "eye", ClientHello("eye", "one", limits.PROTOCOL_VERSION, "", 0))
    hub.close(0)
    hub.say(channels.UP, "ear", Up("ear", "one", [sent(1), sent(1), sent(2, "nobody"), sent(3, "eye")]))
    hub.say(channels.UP, "ear", Up("ear", "one", [sent(2)]))
    hub.say(channels.UP, "eye", Up("eye", "one", [sent(1)]))
    hub.say(channels.UP, "stranger", Up("stranger", "one", [sent(1)]))
    hub.say(channels.UP, "ear", b"\xc1")
    hub.say(channels.UP, "ear", Up("eye", "one", [sent(9)]))
    hub.close(1)
    assert hub.state.refusals == {"duplicate": 2, "no_route": 1, "unknown_source": 1, "malformed": 2}
    assert (hub.state.packets.offered, hub.state.packets.refused) == (2, 6)


def test_a_full_inbox_refuses_and_counts() -> None:
    hub = Hub().begin()
    hub.enter("ear")
    hub.close(0)
    for first in (0, 40_000):
        hub.say(channels.UP, "ear", Up("ear", "one", [sent(first + number) for number in range(1, 40_001)]))
    hub.close(1)
    assert hub.state.refusals == {"inbox_full": 40_000} and hub.state.packets.offered == 40_000


@pytest.mark.parametrize("comes_back", [False, True])
def test_what_is_sent_before_the_join_is_taken_is_judged_with_it(comes_back: bool) -> None:
    """The join and the packets come while tick 5 waits for a Done: the join is taken at tick 6."""
    hub = Hub().begin()
    if comes_back:
        hub.enter("ear")
        hub.close(0)
        hub.core.client_gone("ear", 0)
    for tick in range(1 if comes_back else 0, 5):
        hub.close(tick)
    hub.commit(5)
    hub.enter("ear", boot="two")
    hub.say(channels.UP, "ear", Up("ear", "two", [sent(2), sent(1)]))
    hub.said()
    hub.done("hand", 5)
    while hub.state.closed < 5 or not hub.state.hears_clients:
        assert all(not deliveries.packets for deliveries in hub.said(channels.DELIVERIES))
        assert hub.state.packets.offered == 0
        hub.close(hub.state.closed + 1)
    hub.said()
    hub.say(channels.UP, "ear", Up("ear", "two", [sent(3), sent(2)]))
    hub.close(hub.state.closed + 1)
    (deliveries,) = hub.said(channels.DELIVERIES)
    assert [(packet.source, packet.sequence) for packet in deliveries.packets] == [("ear", 1), ("ear", 2), ("ear", 3)]
    assert hub.state.refusals == {"duplicate": 1}
    assert hub.state.members["ear"].joined_tick == hub.state.closed


def test_what_is_sent_without_ever_joining_is_refused() -> None:
    """One says hello and nothing more; the other is gone again before its join was taken."""
    hub = Hub().begin()
    hub.commit(0)
    hub.say(channels.CLIENT_HELLO, "eye", ClientHello("eye", "one", limits.PROTOCOL_VERSION, "", 0))
    hub.enter("ear")
    for name in ("ear", "eye"):
        hub.say(channels.UP, name, Up(name, "one", [sent(1)]))
    hub.core.client_gone("ear", 0)
    hub.done("hand", 0)
    hub.done("knee", 0)
    assert hub.state.closed == 0 and hub.state.refusals == {"unknown_source": 2}


def test_the_end_is_said_to_everyone_with_the_next_number() -> None:
    hub = Hub().begin()
    hub.enter("ear")
    for tick in range(6):
        hub.close(tick)
    hub.commit(6, last=True)
    hub.said()
    hub.say(channels.END, "supervisor", End(6, "enough", False))
    said = [action for action in hub.core.actions if isinstance(action, Publish) and action.channel is channels.DOWN]
    downs = {action.name: decode_any(action.channel.message, action.payload) for action in said}
    assert set(downs) == {"ear", "hand", "knee"}
    assert all(isinstance(down, Down) and down.ended and down.tick == 6 for down in downs.values())
    assert (downs["hand"].number, downs["knee"].number, downs["ear"].number) == (3, 2, 1)


def test_a_commit_whose_frame_is_another_is_refused_and_the_right_one_counts() -> None:
    hub = Hub().begin()
    values = bytearray(FRAME.values.tobytes())
    values[40] ^= 1
    hub.say(channels.COMMIT, "vhub", Commit(1, 0, FRAME.digest, bytes(values), [], [], False))
    assert hub.core.malformed == 1 and hub.core.waiting_for == "commit"
    hub.close(0)
    assert hub.state.closed == 0


def test_deliveries_zero_are_empty_and_said_with_the_first_epoch() -> None:
    hub = Hub()
    hub.said()
    hub.begin()
    assert [decode(Deliveries, encode(said)) for said in hub.said(channels.DELIVERIES)] == [Deliveries(0, [])]


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
    assert not hub.core.lost and hub.core.malformed == 1


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
