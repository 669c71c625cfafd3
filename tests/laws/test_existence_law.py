"""Players exist while a robot of theirs is present: each time another one, the same on any number of nodes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache, partial
from pathlib import Path
from typing import Any, Final

import pytest

from foosim.client.player import Packet, Player, Samples, Turn
from foosim.common.errors import BadValue
from foosim.deployment.schema import Deployment
from foosim.protocol import channels
from foosim.protocol.codec import decode_any
from foosim.protocol.messages import Go
from foosim.rehearsal.journals import ENDINGS, Ending
from foosim.rehearsal.run import Rehearsed, rehearse
from foosim.rehearsal.simulation import Simulation
from foosim.rehearsal.system import Settings, System
from foosim.rehearsal.trace import Traced
from foosim.replay.verify import verify_capture
from foosim.vhub.stages.receiver import RECEIVER_DOWN
from foosim.vhub.state.records import Closing
from tests.kinematic_yard import yard_text

TICKS: Final = 140
PERIOD: Final = 2
"""Ticks of 10 ms: players act at 50 Hz."""
ALWAYS: Final = "looker"
HERE: Final[Mapping[str, tuple[tuple[int, int], ...]]] = {
    "cart-1": ((0, 31), (91, TICKS)),
    "cart-2": ((0, TICKS),),
    "cart-3": ((21, 51), (52, 81), (101, TICKS)),
    "cart-4": ((61, 71), (111, 131)),
}
"""From which frame on a cart is present, and from which one on it is not. cart-3 and cart-4 are spares."""


def changes() -> list[tuple[int, str, str]]:
    """Tick, verb and name of what leads to these frames."""
    spans = [(name, span) for name, spans in HERE.items() for span in spans]
    found = [(first - 1, "add", name) for name, (first, _) in spans if first]
    return sorted(found + [(last - 1, "remove", name) for name, (_, last) in spans if last < TICKS])


class Counting(Player):
    """Tells, as its command, how often it was called, and in packets whom it has heard and who is there."""

    def __init__(self, deployment: Deployment, parameters: Mapping[str, Any]) -> None:
        self._calls = 0

    def act(self, tick: int, samples: Samples) -> Turn:
        self._calls += 1
        command = {"linear": self._calls / 1000.0, "angular": len(samples) / 10.0}
        heard = [f"{source}@{sample.sent_ns // 10_000_000}" for (source, _), sample in samples.items()]
        said = f"{self._calls} {','.join(self.robots)} {','.join(heard)}".encode()
        return Turn(dict.fromkeys(self.robots, command), [Packet("", "log", said)])


def text(events: bool = True) -> str:
    path = f"{__name__}:{Counting.__name__}"
    pose = {"kind": "pose", "rate": "50 Hz"}
    about = {"class": path, "rate": "50 Hz", "lockstep": True}
    cart = {"model": "differential_drive", "count": 2, "spare": 2, "spacing": {"y": "3 m"}, "sensors": {"pose": pose}}
    players = {
        "pilot-$1": {**about, "each": "cart-*", "on": "$robot", "robots": {"$robot": ["pose"]}},
        "both": {**about, "rate": "25 Hz", "robots": {"cart-3": ["pose"], "cart-4": ["pose"]}, "process": "one"},
        "waits": {
            **about,
            "rate": "5 Hz",
            "act": "arrival",
            "arrivals": {"cart-4": ["pose"], "pilot-*": ["log"]},
            "hears": {"pilot-*": ["log"]},
            "robots": {"cart-4": ["pose"]},
            "process": "one",
        },
        ALWAYS: {**about, "hears": {"*": ["log"]}},
    }
    link = {"id": "all", "from": "*", "to": "*", "delay": "7 ms", "loss": "10 %"}
    told = [{"at": f"{10 * tick} ms", "entity": name, verb: True} for tick, verb, name in changes()]
    return yard_text(
        {"cart": cart}, players=players, network={"links": [link]}, events=told if events else []
    )


@dataclass
class Seen:
    """A run: its frames, the Gos by player and tick, what players said by tick, and the fates of all packets."""

    run: Rehearsed = field(default_factory=lambda: Rehearsed({}))
    gos: dict[str, dict[int, Go]] = field(default_factory=dict)
    closings: list[Closing] = field(default_factory=list)

    def watch(self, traced: Traced) -> None:
        if traced.what == "publish" and traced.channel == channels.DOWN.name:
            message = decode_any(channels.DOWN.message, traced.payload)
            if isinstance(message, Go):
                known = self.gos.setdefault(traced.name, {}).setdefault(message.tick, message)
                assert known == message, "a Go is said in one way"

    def said(self, player: str) -> dict[int, list[str]]:
        """The number of the call, who is there, who was heard and when: by the tick of the call."""
        flights = [one for closing in self.closings for one in closing.fates if one.source == player]
        logs = {one.sent_ns // 10_000_000: one.payload.decode() for one in flights if one.channel == "log"}
        return {tick: log.split(" ") for tick, log in sorted(logs.items())}

    def fates(self) -> list[tuple[Any, ...]]:
        found = [one for closing in self.closings for one in closing.fates]
        return [(one.source, one.destination, one.channel, one.sequence, one.payload, one.cause) for one in found]


def fly(
    nodes: int = 1,
    prepare: Callable[[System], None] | None = None,
    events: bool = True,
    **chosen: Any,
) -> Seen:
    seen = Seen()
    settings = Settings(observer=seen.watch, on_closing=seen.closings.append)
    seen.run = rehearse(text(events), "yard.yaml", TICKS, nodes, settings=settings, prepare=prepare, **chosen)
    assert seen.run.json["reason"] == "done", seen.run.json
    return seen


@cache
def usual() -> Seen:
    return fly()


def spans_of(*carts: str) -> list[tuple[int, int]]:
    """From which frame on one of these is there, and from which one on none is."""
    here = [any(first <= tick < last for cart in carts for first, last in HERE[cart]) for tick in range(TICKS)]
    begins = [tick for tick in range(TICKS) if here[tick] and not (tick and here[tick - 1])]
    return [(tick, here.index(False, tick) if False in here[tick:] else TICKS) for tick in begins]


PLAYERS: Final = {
    **{f"pilot-{number}": (f"cart-{number}",) for number in range(1, 5)},
    "both": ("cart-3", "cart-4"),
}


@pytest.mark.parametrize(("player", "carts"), PLAYERS.items(), ids=PLAYERS)
def test_it_is_called_while_a_robot_of_its_own_is_there_and_each_time_is_another_one(
    player: str, carts: tuple[str, ...]
) -> None:
    seen, period = usual(), 2 * PERIOD if player == "both" else PERIOD
    spans = spans_of(*carts)
    turns = [[tick for tick in range(first, last) if tick % period == 0] for first, last in spans]
    assert [*seen.gos[player]] == [tick for ticks in turns for tick in ticks], "no Go while it does not exist"
    for (first, _), ticks in zip(spans, turns, strict=True):
        for number, tick in enumerate(ticks, 1):
            go, (calls, robots, heard) = seen.gos[player][tick], seen.said(player)[tick]
            here = [cart for cart in carts if any(begin <= tick < end for begin, end in HERE[cart])]
            assert int(calls) == number, "its memory is its own"
            assert robots.split(",") == here
            assert go.since == first and go.absent == [cart for cart in carts if cart not in here]
            sent = [int(one.split("@")[1]) for one in heard.split(",") if one]
            assert all(first <= at <= tick for at in sent), "it has heard nothing of before"
    assert any(said[2] for said in seen.said(player).values())


def test_who_acts_at_arrivals_is_neither_called_by_these_nor_by_time() -> None:
    seen, spans = usual(), spans_of("cart-4")
    ticks = [*seen.gos["waits"]]
    assert all(any(first <= tick < last for first, last in spans) for tick in ticks)
    firsts = [min(tick for tick in ticks if tick >= first) for first, _ in spans]
    assert [seen.said("waits")[tick][0] for tick in firsts] == ["1", "1"]
    assert len(ticks) > sum((last - first) // 20 for first, last in spans), "by packets, too"
    lost = [one for one in seen.fates() if one[1] == "waits" and one[5] == RECEIVER_DOWN]
    assert len(lost) > 20, "what others send to it meanwhile is lost"


def test_who_has_no_robot_always_exists() -> None:
    assert [*usual().gos[ALWAYS]] == [*range(0, TICKS, PERIOD)]
    assert {go.since for go in usual().gos[ALWAYS].values()} == {0}


@pytest.mark.parametrize("nodes", [2, 3])
def test_the_run_is_the_same_on_any_number_of_nodes(nodes: int) -> None:
    assert_the_same(fly(nodes))


def assert_the_same(seen: Seen) -> None:
    assert seen.run.digests == usual().run.digests
    assert seen.gos == usual().gos
    assert seen.fates() == usual().fates()


def test_by_requests_it_is_the_same_as_by_events() -> None:
    """Each request is answered with the tick of the order that has it; the run stands until that is there."""
    asked: dict[str, tuple[int, str, str]] = {}

    def ask(system: System, tick: int, verb: str, name: str) -> None:
        asked[system.request(verb, again_ns=3_000_000, name=name)] = tick, verb, name

    def prepare(system: System) -> None:
        for tick, verb, name in changes():
            system.at_tick(max(1, tick - 5), partial(ask, system, tick, verb, name))

    seen = fly(2, prepare, events=False)
    answered = {identity: seen.run.answers[identity] for identity in asked}
    assert all(answer.accepted for answer in answered.values()), answered
    for player, carts in PLAYERS.items():
        begun = sorted({go.since for go in seen.gos.get(player, {}).values()})
        added = [answered[one].tick + 1 for one, (_, verb, name) in asked.items() if (verb, name) == ("add", carts[0])]
        if len(carts) == 1:
            assert [tick for tick in begun if tick] == added, player
