"""Several players in one process: each gets what is its own, one that is refused ends all, one that fails ends alone.

The vHub is a role of the same process here, so players reach it over the in-memory bus.
"""

from __future__ import annotations

import faulthandler
import logging
import signal
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Final

import pytest
import typer

from foosim.client import main as client_main
from foosim.client.errors import PlayerError
from foosim.client.main import ClientShell, run_players
from foosim.client.player import Commands, Player, Samples
from foosim.common.errors import BadValue
from foosim.deployment.loader import apply_sets
from foosim.deployment.schema import Deployment
from foosim.protocol import channels
from foosim.protocol.channels import VHUB, Channel, Plane
from foosim.protocol.codec import decode_any, encode
from foosim.protocol.messages import (
    ClientHello,
    ClientRefusal,
    ClientWelcome,
    Done,
    Down,
    Failure,
    Go,
    Join,
    Subscription,
)
from foosim.runtime.command import DONE, FAILED, REFUSED
from foosim.runtime.process import STACK_SIGNAL
from foosim.runtime.roles import loop
from foosim.runtime.roles.role import Role
from foosim.runtime.roles.shell import Process
from foosim.runtime.transport.session import Session
from tests.turns import BY_PERIOD

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
RED, BLUE = "player-red", "player-blue"
NS_PER_S: Final = 1_000_000_000
LATER_NS: Final = 2**62


class Counts(Player):
    """A player that counts its turns, and fails when it is told to."""

    fails = False
    turns: Final[list[str]] = []

    def __init__(self, deployment: Deployment, parameters: Mapping[str, Any]) -> None:
        self._team = parameters["team"]

    def act(self, tick: int, samples: Samples) -> Commands:
        if self.fails:
            raise ValueError("too much")
        self.turns.append(self._team)
        return {}


class Hub:
    """A core in the vHub's place, which keeps what it is sent."""

    def __init__(self) -> None:
        self.actions: list[Any] = []
        self.heard: list[tuple[str, Any]] = []

    def receive(self, channel: Channel, name: str, payload: bytes, now_ns: int) -> None:
        self.heard.append((name, decode_any(channel.message, payload)))

    def wake(self, now_ns: int) -> None: ...


class Bench:
    """A process with two players and a vHub; `say` lets a message come to a player and returns the answers."""

    def __init__(self, plane: Session) -> None:
        self.rings = 0
        self.process = Process("players", is_shared=True, on_offer=self._ring)
        self.hub = Hub()
        self.hub_role = Role(VHUB, self.hub, logging.getLogger("hub"), lambda now_ns: LATER_NS)
        wire = self.process.wire(plane, Plane.RADIO, VHUB)
        self.hub_role.connect(wire)
        wire.read(channels.VHUB_READS)
        self.process.loop.add(self.hub_role)
        self.players = {name: ClientShell(self.process, name, plane) for name in (RED, BLUE)}
        for player in self.players.values():
            self.process.add(player)

    def say(self, *messages: tuple[Channel, str, Any]) -> list[tuple[str, Any]]:
        for channel, name, message in messages:
            self.process.inbox.offer((channel.key, name, encode(message)))
        self.process.inbox.wake()
        self.hub.heard.clear()
        for _ in range(3):  # the players' turns, the vHub's, and one in which nothing is left
            self.process.inbox.wake()
            self.process.loop.go_round()
        return list(self.hub.heard)

    def _ring(self) -> None:
        self.rings += 1

    def welcome(self, name: str, text: str = "") -> list[tuple[str, Any]]:
        boot = self.players[name].core.boot
        message = ClientWelcome(name, boot, "hub", 0, 0, "t", text or TABLE.read_text())
        return self.say((channels.CLIENT_WELCOME, name, message))

    def run(self) -> int:
        """Run to the end of the players, as if the vHub's role were elsewhere."""
        self.process.loop.remove(self.hub_role)
        return self.process.run()


@pytest.fixture(scope="module")
def plane() -> Iterator[Session]:
    with Session.router("tcp/127.0.0.1:0") as session:
        yield session


@pytest.fixture
def bench(plane: Session, monkeypatch: pytest.MonkeyPatch) -> Iterator[Bench]:
    monkeypatch.setattr(client_main, "load_player", lambda path: Counts)
    later_ns = time.monotonic_ns() + NS_PER_S  # when hello is due, and nothing is repeated: time stands still
    monkeypatch.setattr(loop, "time", SimpleNamespace(monotonic_ns=lambda: later_ns))
    Counts.turns.clear()
    made = Bench(plane)
    yield made
    for name in (RED, BLUE):
        plane.end_alive(f"foosim/radio/alive/{name}")


@pytest.fixture
def begun(bench: Bench) -> Bench:
    for name in (RED, BLUE):
        bench.welcome(name)
    return bench


def test_all_say_hello_and_join_under_their_own_names(bench: Bench) -> None:
    hellos = bench.say()
    assert [name for name, _ in hellos] == [RED, BLUE] and all(isinstance(said, ClientHello) for _, said in hellos)
    for name in (RED, BLUE):
        ((joins, join),) = bench.welcome(name)
        assert joins == name and isinstance(join, Join) and join.name == name
        assert not bench.players[name].is_over()


def test_a_go_reaches_its_player_alone_and_those_due_at_one_tick_act_in_the_order_of_the_process(begun: Bench) -> None:
    assert begun.say((channels.DOWN, "stranger", Go(1, 5, 0, []))) == []
    answers = begun.say(*((channels.DOWN, name, Go(1, 5, 0, [])) for name in (BLUE, RED)))
    assert [name for name, _ in answers] == [RED, BLUE]
    ((name, done),) = begun.say((channels.DOWN, BLUE, Go(2, 10, 0, [])))
    assert name == BLUE and isinstance(done, Done) and (done.name, done.tick) == (BLUE, 10)
    assert Counts.turns == ["red", "blue", "blue"]
    assert [player.core.statistics().malformed for player in begun.players.values()] == [0, 0]


def test_one_that_acts_at_arrival_joins_so_and_acts_at_any_tick_beside_one_that_does_not(bench: Bench) -> None:
    arrivals = "{camera: [ball], 'blue.*': [encoder]}"
    sets = [*BY_PERIOD, "players.player-blue.act=arrival", f"players.player-blue.arrivals={arrivals}"]
    text = apply_sets(TABLE.read_text(), TABLE.name, sets)
    bench.say()
    joins = {name: bench.welcome(name, text)[0][1] for name in (RED, BLUE)}
    assert joins[RED].arrivals == [] and len(joins[BLUE].arrivals) == 5
    assert Subscription("camera", "ball") in joins[BLUE].arrivals and joins[BLUE].period == 5
    ((name, done),) = bench.say((channels.DOWN, BLUE, Go(1, 7, 0, [])))
    assert (name, done.tick) == (BLUE, 7)
    assert bench.say((channels.DOWN, RED, Go(1, 7, 0, []))) == [], "it has a period of 5 ticks"


def test_one_that_is_refused_ends_all(bench: Bench) -> None:
    boot = bench.players[BLUE].core.boot
    bench.say((channels.CLIENT_REFUSAL, BLUE, ClientRefusal(BLUE, boot, "there is one already")))
    assert not bench.players[RED].is_over() and bench.players[BLUE].is_over()
    assert bench.run() == REFUSED


def test_one_that_fails_says_who_and_at_which_tick_and_the_others_go_on_to_the_end_of_the_run(
    begun: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Counts, "fails", True)
    ((name, failure),) = begun.say((channels.DOWN, BLUE, Go(1, 5, 0, [])))
    assert isinstance(failure, Failure) and failure.name == name == BLUE
    assert failure.reason.startswith(f"{BLUE} failed at tick 5: ValueError: too much (")
    assert begun.players[BLUE].is_over() and not begun.players[RED].is_over()
    begun.say((channels.DOWN, RED, Down(1, 9, 0, [], True)))
    with pytest.raises(PlayerError, match=rf"^{BLUE} failed at tick 5: ValueError: too much \(tests.client.test"):
        begun.run()


def test_it_is_over_when_the_run_has_ended_for_all(begun: Bench) -> None:
    for name in (RED, BLUE):
        begun.say((channels.DOWN, name, Down(1, 9, 0, [], True)))
        assert begun.players[name].is_over()
    assert begun.run() == DONE


def test_another_event_loop_may_drive_the_process_and_it_ends_in_the_same_way(begun: Bench) -> None:
    process = begun.process
    begun.hub.heard.clear()

    def offered(name: str, message: Any) -> int | None:
        rings = begun.rings
        process.inbox.offer((channels.DOWN.key, name, encode(message)))
        process.inbox.offer(("stranger", name, b""))
        assert begun.rings == rings + 1, "once for what one step takes"
        return process.step()

    assert offered(BLUE, Go(1, 5, 0, [])) == 0 and begun.hub.heard == [], "the answer is on the bus"
    due_ns = process.step()
    assert due_ns is not None and due_ns > 0 and [name for name, _ in begun.hub.heard] == [BLUE]
    process.loop.remove(begun.hub_role)
    assert offered(RED, Down(1, 9, 0, [], True)) == due_ns
    assert offered(BLUE, Down(2, 9, 0, [], True)) is None and process.end() == DONE


def test_a_vhub_that_is_gone_is_missed_by_all_and_lost_for_good_in_the_end(
    begun: Bench, caplog: pytest.LogCaptureFixture
) -> None:
    for player in begun.players.values():
        core = player.core
        assert core.deployment is not None
        core.hub_gone(0)
        deadline_ns = core.deployment.deadlines.vhub_back_ns
        assert core.deadline_ns() <= deadline_ns, "they were told nothing yet"
        over = []
        for now_ns in (deadline_ns - 1, deadline_ns):
            core.actions.clear()
            core.wake(now_ns)
            over.append(player.is_over())
        assert over == [False, True]
        assert player.finish() == FAILED


@pytest.mark.parametrize(("names", "text"), [(["a", "B"], "not a name for a player"), (["a", "a"], "named twice")])
def test_names_are_looked_at_before_anything_is_opened(names: list[str], text: str) -> None:
    with pytest.raises(BadValue, match=text):
        run_players(names, "tcp/127.0.0.1:1")


def test_the_process_shows_its_stack_when_it_is_asked_for_it(monkeypatch: pytest.MonkeyPatch) -> None:
    before = signal.getsignal(STACK_SIGNAL)
    asked: list[object] = []

    def play(*given: object) -> int:
        was_registered: object = faulthandler.unregister(STACK_SIGNAL)  # type: ignore[func-returns-value]
        asked.append(was_registered)
        return DONE

    monkeypatch.setattr(client_main, "run_players", play)
    with pytest.raises(typer.Exit):
        client_main.player([RED], "tcp/127.0.0.1:1")
    signal.signal(STACK_SIGNAL, before)
    assert asked == [True]
