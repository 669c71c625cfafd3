"""Running a player: what it is given, what it may do, and what is said when it does something else."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import Any, ClassVar

import numpy as np
import pytest

from foosim.client.core import NEVER_NS, ClientCore
from foosim.client.errors import PlayerError
from foosim.client.player import Commands, Packet, Player, Samples, Turn
from foosim.client.playing import PlayerLoop
from foosim.common.errors import BadValue
from foosim.deployment.loader import apply_sets
from foosim.deployment.schema import Deployment
from foosim.library.table.ball import BallPosition
from foosim.library.table.encoder import RodPosition
from foosim.library.table.rod_position import Command
from foosim.library.table.settings import LINE_NAMES
from foosim.protocol import channels
from foosim.protocol.actions import Publish
from foosim.protocol.codec import decode_any, encode
from foosim.protocol.messages import ClientWelcome, Done, Down, Go, Join, Received, Up
from foosim.simulation.run import rehearse
from tests.turns import BY_PERIOD

TABLE = Path(__file__).parents[2] / "deploy" / "table.yaml"
NAME = "player-red"
SOURCE_LINES = [line.strip() for line in Path(__file__).read_text().splitlines()]
RAISES = SOURCE_LINES.index("raise self.commands") + 1


class Scripted(Player):
    """A player that does what its test says, and keeps what it was given."""

    made: ClassVar[list[Scripted]] = []

    def __init__(self, deployment: Deployment, parameters: Mapping[str, Any]) -> None:
        self.parameters = dict(parameters)
        self.calls: list[tuple[int, dict[tuple[str, str], object]]] = []
        self.commands: Any = {}
        Scripted.made.append(self)

    def act(self, tick: int, samples: Samples) -> Commands | Turn:
        self.calls.append((tick, {pair: sample.value for pair, sample in samples.items()}))
        if isinstance(self.commands, BaseException):
            raise self.commands
        commands: Commands | Turn = self.commands
        return commands


def begun(*sets: str, load: Any = lambda path: Scripted) -> PlayerLoop:
    """A loop whose player has joined a run."""
    core = ClientCore(NAME, "one", 0)
    text = apply_sets(TABLE.read_text(), TABLE.name, [*BY_PERIOD, *sets])
    welcome = ClientWelcome(NAME, "one", "hub", 0, 0, TABLE.name, text)
    core.receive(channels.CLIENT_WELCOME, NAME, encode(welcome), 0)
    loop = PlayerLoop(core, load)
    loop.step(0)
    return loop


def said(loop: PlayerLoop) -> list[Join | Up | Done]:
    """What was sent since the last time."""
    messages = [decode_any(Join | Up | Done, a.payload) for a in loop.core.actions if isinstance(a, Publish)]
    loop.core.actions.clear()
    return messages


def go(loop: PlayerLoop, number: int, *packets: Received) -> None:
    """Give the player its turn number `number`."""
    loop.core.receive(channels.DOWN, NAME, encode(Go(number, 5 * number, 0, list(packets))), 0)
    loop.step(0)


def sample(source: str, channel: str, sequence: int, *numbers: float) -> Received:
    return Received(source, sequence, 0, channel, 0, 0, np.array(numbers, "<f8").tobytes())


# --- the loop --------------------------------------------------------------------------------------------------------


def test_samples_are_the_newest_of_each_channel() -> None:
    loop = begun()
    player = Scripted.made[-1]
    go(loop, 1)
    go(loop, 2, sample("camera", "ball", 3, 0.1, 0.2, 0.3), sample("red.goal", "encoder", 3, 0.01, 0.02))
    late = sample("camera", "ball", 2, 9.0, 9.0, 9.0)
    foreign = sample("blue.goal", "encoder", 9, 9.0, 9.0)
    go(loop, 3, late, foreign, sample("red.goal", "encoder", 4, 0.03, 0.04), sample("camera", "ball", 5, 1.0))
    ball = BallPosition(0.1, 0.2, 0.3)
    assert player.calls == [
        (5, {}),
        (10, {("camera", "ball"): ball, ("red.goal", "encoder"): RodPosition(0.01, 0.02)}),
        (15, {("camera", "ball"): ball, ("red.goal", "encoder"): RodPosition(0.03, 0.04)}),
    ]
    assert loop.newest.malformed == 1


def test_packets_leave_before_commands_which_are_packed_in_name_order_and_answer_the_go() -> None:
    loop = begun()
    said(loop)
    packets = [Packet("", "beacon", b"2"), Packet("player-blue", "word", b"1"), Packet("red.goal", "echo", b"")]
    commands = {"red.midfield": Command(0.01, 1.0), "red.attack": Command(-0.02, 2.0)}
    Scripted.made[-1].commands = Turn(commands, packets)
    go(loop, 1)
    (done,) = said(loop)
    assert isinstance(done, Done) and done.tick == 5
    sent = [Packet(p.destination, p.channel, p.payload) for p in done.packets]
    assert sent[:3] == packets
    assert [(*p[:2], np.frombuffer(p.payload).tolist()) for p in sent[3:]] == [
        ("red.attack", "position", [-0.02, 2.0]),
        ("red.midfield", "position", [0.01, 1.0]),
    ]
    assert loop.deadline_ns() == NEVER_NS


def test_it_hears_what_its_selectors_match_beside_its_robots() -> None:
    loop = begun("players.player-red.hears={'player-*': [beacon], 'blue.*': [encoder], camera: [echo]}")
    (join,) = said(loop)
    assert isinstance(join, Join) and join.period == 5
    assert Scripted.made[-1].parameters == {"team": "red"}
    heard = {(item.source, item.channel) for item in join.subscriptions}
    rods = {(f"{team}.{line}", "encoder") for team in ("red", "blue") for line in LINE_NAMES}
    assert heard == rods | {("camera", "ball"), ("player-blue", "beacon"), ("camera", "echo")}
    go(loop, 1, Received("player-blue", 3, 0, "beacon", 0, 0, b"\xff here"))
    assert Scripted.made[-1].calls == [(5, {("player-blue", "beacon"): b"\xff here"})]


def test_a_free_running_player_acts_at_its_rate() -> None:
    loop = begun("players.player-red.lockstep=false")
    (join,) = said(loop)
    assert isinstance(join, Join) and join.period == 0
    player = Scripted.made[-1]
    player.commands = {"red.goal": Command(0.0, 0.0)}
    assert loop.deadline_ns() == NEVER_NS, "it is not told yet that it exists"
    down = Down(1, 7, 0, [sample("camera", "ball", 1, 0.0, 0.0, 0.0)], False)
    loop.core.receive(channels.DOWN, NAME, encode(down), 0)
    loop.step(9_999_999)
    assert player.calls == [] and loop.deadline_ns() == 10_000_000
    loop.step(10_000_000)
    assert player.calls == [(7, {("camera", "ball"): BallPosition(0.0, 0.0, 0.0)})]
    (up,) = said(loop)
    assert isinstance(up, Up) and [packet.stamp_ns for packet in up.packets] == [10_000_000]
    assert loop.deadline_ns() == 20_000_000
    loop.step(95_000_000)
    assert loop.deadline_ns() == 105_000_000, "beats that were missed are not made up for"
    loop.core.receive(channels.DOWN, NAME, encode(Down(2, 8, 0, [], True)), 0)
    loop.step(200_000_000)
    assert (len(player.calls), loop.deadline_ns()) == (2, NEVER_NS)


def test_a_free_running_player_is_another_one_since_another_tick() -> None:
    """It acts while it exists, on what has reached it since, also where several messages come at once or late."""
    loop = begun("players.player-red.lockstep=false")
    before = Scripted.made[-1]

    def hear(*downs: Down) -> None:
        for down in downs:
            loop.core.receive(channels.DOWN, NAME, encode(down), 0)
        loop.step(loop.core.tick * 10_000_000)

    def ball(x: float, sequence: int) -> list[Received]:
        return [sample("camera", "ball", sequence, x, 0.0, 0.0)]

    hear(Down(1, 1, 0, ball(0.1, 1), False, 0, ["red.goal"]), Down(2, 2, 0, [], False, -1, []))
    assert before.calls == [] and loop.deadline_ns() == NEVER_NS
    hear(Down(3, 3, 0, ball(0.2, 2), False, 3, ["red.attack"]))
    hear(
        Down(4, 4, 0, ball(0.4, 9), False, 3),
        Down(6, 6, 0, ball(0.3, 3), False, 6),
        Down(5, 5, 0, ball(0.5, 8), False, 3, ["red.goal"]),
    )
    first, second = before, Scripted.made[-1]
    assert [tick for tick, _ in first.calls] == [3] and "red.attack" not in first.robots
    assert second.calls == [(6, {("camera", "ball"): BallPosition(0.3, 0.0, 0.0)})]
    assert second is not first and "red.attack" in second.robots and "red.goal" in second.robots


# --- what a player must not do ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("commands", "text"),
    [
        (ZeroDivisionError("division by zero"), "ZeroDivisionError: division by zero (PLACE)"),
        (KeyError(), "KeyError (PLACE)"),
        ({"red.gaol": Command(0.0, 0.0)}, "not one of its robots (there are: camera, red.attack, red.defence, red.goal,"
         " red.midfield), 'red.gaol', nearest is 'red.goal'"),
        ({"blue.goal": Command(0.0, 0.0)}, "not one of its robots (there are: camera, red.attack, red.defence,"
         " red.goal, red.midfield), 'blue.goal', nearest is 'red.goal'"),
        ({"red.goal": (0.0,)}, "red.goal/position takes slide (m), spin (rad): 1 number given (ACT)"),
        ({"red.goal": {"slide": 0.0, "spni": 0.0}},
         "red.goal/position takes slide (m), spin (rad): no such name, 'spni', nearest is 'spin' (ACT)"),
        ({"red.goal": Command(0.0, "up")},  # type: ignore[arg-type]
         "red.goal/position takes slide (m), spin (rad): spin is not a number, 'up' (ACT)"),
        ({"red.goal": Command(0.0, 0.0), 7: None}, "not one of its robots (there are: camera, red.attack, red.defence,"
         " red.goal, red.midfield), 7"),
        (Turn({}, [Packet("player-bleu", "beacon", b"")]), "unknown destination (there are: blue.attack, blue.defence,"
         " blue.goal, blue.midfield, camera, player-blue, player-red, red.attack, red.defence, red.goal, red.midfield),"
         " 'player-bleu', nearest is 'player-blue'"),
        (Turn({}, [Packet("blue.goal", "position", bytes(16))]), "not one of its robots (there are: camera, red.attack,"
         " red.defence, red.goal, red.midfield), 'blue.goal', nearest is 'red.goal'"),
        (Turn({}, [Packet("", "", b"")]), "channel '': not 1 to 32 characters"),
        (Turn({}, [Packet("", "beacon", "text")]), "a payload is a str; expected bytes"),  # type: ignore[arg-type]
        (Turn({}, b"x"), "packets is a bytes; expected a sequence of Packet"),  # type: ignore[arg-type]
        (None, "act returned a NoneType; expected a mapping from robots to commands"),
        ([Command(0.0, 0.0)], "act returned a list; expected a mapping from robots to commands"),
        ({"camera": Command(0.0, 0.0)}, "no robot that takes a Command (there are: blue.attack,"
         " blue.defence, blue.goal, blue.midfield, red.attack, red.defence, red.goal, red.midfield), 'camera' (ACT)"),
    ],
)  # fmt: skip
def test_what_a_player_must_not_do_ends_it(commands: Any, text: str) -> None:
    loop = begun()
    said(loop)
    Scripted.made[-1].commands = commands
    with pytest.raises(PlayerError) as error:
        go(loop, 1)
    place = f"tests/client/test_player.py:{RAISES}"
    act = f"tests/client/test_player.py:{Scripted.act.__code__.co_firstlineno}"
    assert str(error.value) == f"{NAME} failed at tick 5: {text.replace('PLACE', place).replace('ACT', act)}"
    assert error.value.exit_code == 1
    assert said(loop) == []


def test_whoever_says_too_much_at_once_is_named() -> None:
    loop = begun()
    much = Packet("", "talk", bytes(32 * 1024))
    Scripted.made[-1].commands = Turn({}, [much] * 40)
    with pytest.raises(PlayerError, match=rf"^{NAME} failed at tick 5: \d+ bytes in one answer, at most 1048576"):
        go(loop, 1)
    free = begun("players.player-red.lockstep=false")
    free.core.receive(channels.DOWN, NAME, encode(Down(1, 0, 0, [], False)), 0)
    Scripted.made[-1].commands = Turn({}, [Packet("", "talk", b"")] * 65_537)
    with pytest.raises(PlayerError, match=rf"^{NAME} failed at tick 0: 65537 packets at once, at most 65536"):
        free.step(10_000_000)


def test_a_player_that_cannot_be_made_says_why() -> None:
    class Fails(Player):
        def __init__(self, deployment: Deployment, parameters: Mapping[str, Any]) -> None:
            raise parameters["error"]

    class Refuses(Player):
        def __init__(self, deployment: Deployment, parameters: Mapping[str, Any]) -> None:
            raise BadValue("parameter team is not one of red, blue", "green")

    before = "player-red failed before its first tick"
    with pytest.raises(PlayerError, match=rf"^{before}: KeyError: 'error' \(tests/client/test_player.py:\d+\)"):
        begun(load=lambda path: Fails)
    with pytest.raises(PlayerError, match="player player-red: parameter team is not one of red, blue, 'green'"):
        begun(load=lambda path: Refuses)


def test_a_player_that_is_not_declared_is_no_player() -> None:
    sets = ("players={}", f"clients={{{NAME}: {{lockstep: false}}}}")
    with pytest.raises(PlayerError, match=r"not declared as a player \(there are: none\), 'player-red'"):
        begun(*sets)


# --- in a run ---------------------------------------------------------------------------------------------------------


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
