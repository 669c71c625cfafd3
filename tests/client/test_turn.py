"""Players that speak with each other: what they hear by selectors, and what a Turn sends."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import Any, ClassVar

import pytest

from foosim.client.core import ClientCore
from foosim.client.errors import PlayerError
from foosim.client.player import Packet, Player, Samples, Turn
from foosim.client.playing import PlayerLoop
from foosim.deployment.loader import apply_sets
from foosim.deployment.schema import Deployment
from foosim.protocol import channels
from foosim.protocol.actions import Publish
from foosim.protocol.codec import decode_any, encode
from foosim.protocol.messages import ClientWelcome, Done, Go, Join, Received, Up
from foosim.simulation.run import rehearse
from foosim.world.actuators.rod_position import Command

TABLE = Path(__file__).parents[2] / "deploy" / "table.yaml"
NAME = "player-red"
HEARS = "players.player-red.hears={'player-*': [beacon], 'blue.*': [encoder], camera: [echo]}"


class Speaks(Player):
    """Returns what its test says; keeps what it hears."""

    turn: ClassVar[Any] = Turn({})
    heard: ClassVar[dict[tuple[str, str], object]] = {}

    def __init__(self, deployment: Deployment, parameters: Mapping[str, Any]) -> None:
        pass

    def act(self, tick: int, samples: Samples) -> Turn:
        Speaks.heard = {pair: sample.value for pair, sample in samples.items()}
        turn: Turn = Speaks.turn
        return turn


def begun(*sets: str) -> tuple[PlayerLoop, Join]:
    core = ClientCore(NAME, "one", 0)
    welcome = ClientWelcome(NAME, "one", "hub", 0, 0, TABLE.name, apply_sets(TABLE.read_text(), TABLE.name, sets))
    core.receive(channels.CLIENT_WELCOME, NAME, encode(welcome), 0)
    loop = PlayerLoop(core, lambda path: Speaks)
    loop.step(0)
    (join,) = said(loop)
    assert isinstance(join, Join)
    return loop, join


def said(loop: PlayerLoop) -> list[Join | Up | Done]:
    messages = [decode_any(Join | Up | Done, a.payload) for a in loop.core.actions if isinstance(a, Publish)]
    loop.core.actions.clear()
    return messages


def go(loop: PlayerLoop, turn: object, *packets: Received) -> list[tuple[str, str, bytes]]:
    """Give the player its turn, at which it does this; return what it sent."""
    Speaks.turn = turn
    number = loop.core.statistics().downlinks + 1
    loop.core.receive(channels.DOWN, NAME, encode(Go(number, 5 * number, 0, list(packets))), 0)
    loop.step(0)
    (done,) = said(loop)
    assert isinstance(done, Done)
    return [(packet.destination, packet.channel, packet.payload) for packet in done.packets]


def test_it_hears_what_its_selectors_match_beside_its_robots() -> None:
    loop, join = begun(HEARS)
    heard = {(item.source, item.channel) for item in join.subscriptions}
    others = {(f"blue.{line}", "encoder") for line in ("attack", "defence", "goal", "midfield")}
    own = {(f"red.{line}", "encoder") for line in ("attack", "defence", "goal", "midfield")} | {("camera", "ball")}
    assert heard == own | others | {("player-blue", "beacon"), ("camera", "echo")}
    go(loop, Turn({}), Received("player-blue", 3, 0, "beacon", 0, 0, b"\xff here"))
    assert Speaks.heard == {("player-blue", "beacon"): b"\xff here"}


def test_packets_leave_before_commands_in_their_order() -> None:
    loop, _ = begun()
    packets = [Packet("", "beacon", b"2"), Packet("player-blue", "word", b"1"), Packet("red.goal", "echo", b"")]
    sent = go(loop, Turn({"red.goal": Command(0.0, 0.0)}, packets))
    assert sent[:3] == [("", "beacon", b"2"), ("player-blue", "word", b"1"), ("red.goal", "echo", b"")]
    assert sent[3][:2] == ("red.goal", "position")


@pytest.mark.parametrize(
    ("turn", "text"),
    [
        (Turn({}, [Packet("player-bleu", "beacon", b"")]), "unknown destination (there are: blue.attack,"),
        (Turn({}, [Packet("blue.goal", "position", bytes(16))]), "not one of its robots (there are: camera,"),
        (Turn({}, [Packet("", "", b"")]), "channel '': not 1 to 32 characters"),
        (Turn({}, [Packet("", "beacon", "text")]), "a payload is a str, not bytes"),  # type: ignore[arg-type]
        (Turn({}, b"x"), "a turn's packets are a bytes, not a sequence of Packet"),  # type: ignore[arg-type]
        (Turn(None), "act gave a value of type NoneType, not a mapping"),  # type: ignore[arg-type]
    ],
)
def test_a_turn_that_must_not_be_ends_the_player(turn: Turn, text: str) -> None:
    loop, _ = begun()
    with pytest.raises(PlayerError) as error:
        go(loop, turn)
    assert str(error.value).startswith(f"{NAME} failed at tick 5: {text}")


class Counts(Player):
    """Broadcasts the number of its turn; keeps what it has heard from the other."""

    heard: ClassVar[dict[str, list[tuple[int, bytes]]]] = {}

    def __init__(self, deployment: Deployment, parameters: Mapping[str, Any]) -> None:
        self.name = "player-" + parameters["team"]
        self.turns = 0
        Counts.heard[self.name] = []

    def act(self, tick: int, samples: Samples) -> Turn:
        self.turns += 1
        Counts.heard[self.name] += [(tick, sample.value) for sample in samples.values() if type(sample.value) is bytes]
        return Turn({}, [Packet("", "count", b"%d" % self.turns)])


def test_players_hear_each_other_in_a_run_a_link_s_delay_later(monkeypatch: pytest.MonkeyPatch) -> None:
    module = ModuleType("counting")
    module.Counts = Counts  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "counting", module)
    hears = [f"players.player-{one}.hears={{'player-*': [count]}}" for one in ("red", "blue")]
    classes = [f"players.player-{one}.class=counting:Counts" for one in ("red", "blue")]
    links = "network.links=[{id: slow, from: player-blue, to: player-red, delay: 13 ms},"
    links += " {id: dead, from: player-red, to: player-blue, loss: 100 %}]"
    rehearse(TABLE.read_text(), TABLE.name, 50, sets=["engine=pure", links, *hears, *classes])
    assert Counts.heard["player-blue"] == []
    # A turn begins with a picture, which the camera gives 10 ms late: the first one at tick 5.
    assert Counts.heard["player-red"] == [(tick, b"%d" % (tick // 5 - 2)) for tick in range(15, 50, 5)]
