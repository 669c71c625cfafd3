"""Several players as one core: each gets what is its own, all speak together, and one that is refused ends all."""

from __future__ import annotations

import faulthandler
import signal
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
import typer

from foosim.client import main as client_main
from foosim.client.core import ClientCore
from foosim.client.errors import PlayerError
from foosim.client.player import Commands, Samples
from foosim.client.process_group import Crew
from foosim.deployment.loader import apply_sets
from foosim.deployment.schema import Deployment
from foosim.protocol import channels
from foosim.protocol.actions import Log, Publish
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
from tests.turns import BY_PERIOD

TABLE = Path(__file__).parents[2] / "deploy" / "table.yaml"
RED, BLUE = "player-red", "player-blue"


class Counts:
    """A player that counts its turns, and fails when it is told to."""

    fails = False

    def __init__(self, deployment: Deployment, parameters: Mapping[str, Any]) -> None:
        self.turns = 0

    def act(self, tick: int, samples: Samples) -> Commands:
        if self.fails:
            raise ValueError("too much")
        self.turns += 1
        return {}


def crew_of(*names: str) -> Crew:
    return Crew([ClientCore(name, "one", 0) for name in names], lambda path: Counts)


def say(crew: Crew, channel: channels.Channel, name: str, message: Any) -> list[Any]:
    """Let a message come to somebody, and all act; return what is said then, a line as its text."""
    crew.receive(channel, name, encode(message), 0)
    return heard(crew)


def heard(crew: Crew) -> list[Any]:
    crew.step(0)
    found = [
        action.text if isinstance(action, Log) else (action.name, decode_any(action.channel.message, action.payload))
        for action in crew.actions
        if isinstance(action, Publish | Log)
    ]
    crew.actions.clear()
    return found


def begun() -> Crew:
    crew = crew_of(RED, BLUE)
    for name in (RED, BLUE):
        say(crew, channels.CLIENT_WELCOME, name, ClientWelcome(name, "one", "hub", 0, 0, "t", TABLE.read_text()))
    return crew


def test_all_say_hello_and_join_under_their_own_names() -> None:
    crew = crew_of(RED, BLUE)
    crew.wake(0)
    hellos = heard(crew)
    assert [name for name, _ in hellos] == [RED, BLUE] and all(isinstance(said, ClientHello) for _, said in hellos)
    for name in (RED, BLUE):
        welcome = ClientWelcome(name, "one", "hub", 0, 0, "t", TABLE.read_text())
        ((joins, join),) = say(crew, channels.CLIENT_WELCOME, name, welcome)
        assert joins == name and isinstance(join, Join) and join.name == name
    assert not crew.is_over


def test_who_gets_a_go_acts_and_nobody_else() -> None:
    crew = begun()
    ((name, done),) = say(crew, channels.DOWN, BLUE, Go(1, 5, 0, []))
    assert name == BLUE and isinstance(done, Done) and (done.name, done.tick) == (BLUE, 5)
    turns = {name: player.player.turns for name, player in crew._players.items()}  # type: ignore[union-attr]
    assert turns == {RED: 0, BLUE: 1}


def test_one_that_acts_at_arrival_joins_so_and_acts_at_any_tick_beside_one_that_does_not() -> None:
    arrivals = "{camera: [ball], 'blue.*': [encoder]}"
    sets = [*BY_PERIOD, "players.player-blue.act=arrival", f"players.player-blue.arrivals={arrivals}"]
    text = apply_sets(TABLE.read_text(), TABLE.name, sets)
    crew = crew_of(RED, BLUE)
    joins = {}
    for name in (RED, BLUE):
        ((_, joins[name]),) = say(
            crew, channels.CLIENT_WELCOME, name, ClientWelcome(name, "one", "hub", 0, 0, "t", text)
        )
    assert joins[RED].arrivals == [] and len(joins[BLUE].arrivals) == 5
    assert Subscription("camera", "ball") in joins[BLUE].arrivals and joins[BLUE].period == 5
    ((name, done),) = say(crew, channels.DOWN, BLUE, Go(1, 7, 0, []))
    assert (name, done.tick) == (BLUE, 7)
    (line,) = say(crew, channels.DOWN, RED, Go(1, 7, 0, []))
    assert "Go for tick 7 to a client with a period of 5 ticks and an offset of 0" in line


def test_those_due_at_one_tick_speak_together_in_the_order_in_which_it_came() -> None:
    crew = begun()
    for name in (BLUE, RED):
        crew.receive(channels.DOWN, name, encode(Go(1, 5, 0, [])), 0)
    assert [name for name, _ in heard(crew)] == [BLUE, RED]


def test_what_names_nobody_here_is_refused_and_counted() -> None:
    crew = begun()
    (line,) = say(crew, channels.DOWN, "stranger", Go(1, 5, 0, []))
    assert line.startswith(f"{RED}: ") and "stranger" in line
    assert [core.statistics().malformed for core in crew.cores] == [1, 0]


def test_one_that_is_refused_ends_all() -> None:
    crew = crew_of(RED, BLUE)
    (line,) = say(crew, channels.CLIENT_REFUSAL, BLUE, ClientRefusal(BLUE, "one", "there is one already"))
    assert line == f"{BLUE}: refused by the vHub: there is one already"
    assert crew.is_over and crew.leave() == REFUSED


def test_one_that_fails_says_who_and_at_which_tick(monkeypatch: pytest.MonkeyPatch) -> None:
    crew = begun()
    monkeypatch.setattr(Counts, "fails", True)
    with pytest.raises(PlayerError, match=rf"^{BLUE} failed at tick 5: ValueError: too much \(.*raise ValueError"):
        say(crew, channels.DOWN, BLUE, Go(1, 5, 0, []))
    published = [action for action in crew.actions if isinstance(action, Publish)]
    said = [decode_any(action.channel.message, action.payload) for action in published]
    (failure,) = [message for message in said if isinstance(message, Failure)]
    assert failure.name == BLUE and failure.reason.startswith(f"{BLUE} failed at tick 5: ValueError: too much (")


def test_it_is_over_when_the_run_has_ended_for_all() -> None:
    crew = begun()
    over = []
    for name in (RED, BLUE):
        say(crew, channels.DOWN, name, Down(1, 9, 0, [], True))
        over.append(crew.is_over)
    assert over == [False, True] and crew.leave() == DONE


def test_a_vhub_that_is_gone_is_missed_by_all_and_lost_for_good_in_the_end() -> None:
    crew = begun()
    crew.hub_alive(False, 0)
    lines = heard(crew)
    assert [line.partition(":")[0] for line in lines] == [RED, BLUE]
    deployment = crew.cores[0].deployment
    assert deployment is not None
    assert crew.deadline_ns() <= deployment.deadlines.start_ns, "they were told nothing yet"
    over = []
    for now_ns in (deployment.deadlines.start_ns - 1, deployment.deadlines.start_ns):
        crew.actions.clear()
        crew.wake(now_ns)
        over.append(crew.is_over)
    assert over == [False, True] and crew.leave() == FAILED
    assert [action.text for action in crew.actions if isinstance(action, Log)] == [
        f"{name}: lost the vHub" for name in (RED, BLUE)
    ]


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
