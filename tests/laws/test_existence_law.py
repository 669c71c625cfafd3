"""Players exist while a robot of theirs is present: each time another one, the same on any number of nodes."""

from __future__ import annotations

from bisect import bisect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cache, partial
from pathlib import Path
from typing import Any, Final

import pytest

from foosim.capture.reader import open_capture
from foosim.client.player import Packet, Player, Samples, Turn
from foosim.common.errors import BadValue
from foosim.common.units import Pace
from foosim.deployment.loader import load_deployment
from foosim.deployment.schema import Deployment
from foosim.protocol import channels
from foosim.protocol.codec import decode, decode_any
from foosim.protocol.messages import Deliveries, Go, Received, Sent
from foosim.simulation.agents import Resident
from foosim.simulation.carriers import Bypass, Carrier
from foosim.simulation.journals import ENDINGS, Ending
from foosim.simulation.run import Rehearsed, rehearse, with_nodes
from foosim.simulation.settings import Process, Traced
from foosim.simulation.simulation import Simulation
from foosim.simulation.system import Settings, System
from foosim.simulation.verify import verify_capture
from foosim.simulation.what_if import what_if
from foosim.supervisor.settings import RunSettings
from foosim.vhub.stages.receiver import RECEIVER_DOWN
from foosim.vhub.state.existence import robots_it_lives_by
from foosim.vhub.state.records import Closing, HubRecord, TickRecord
from tests.deployed import DEPLOYMENT
from tests.kinematic_yard import yard_text

TICKS: Final = 140
TICK_NS: Final = 10_000_000
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


Change = tuple[int, str, str]
"""Tick, verb and name."""


def changes() -> list[Change]:
    """What leads to these frames."""
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


def text(events: Sequence[Change]) -> str:
    """Four carts, two of them spares, each with its pilot on board; one player of two carts, and one at arrivals."""
    path = f"{__name__}:{Counting.__name__}"
    pose = {"kind": "pose", "rate": "50 Hz"}
    about = {"class": path, "rate": "50 Hz", "lockstep": True}
    cart = {"model": "differential_drive", "count": 2, "spare": 2, "spacing": {"y": "3 m"}, "sensors": {"pose": pose}}
    players = {
        "pilot-$1": {**about, "each": "cart-*", "on": "$robot", "robots": {"$robot": ["pose"]}},
        "both": {
            **about,
            "rate": "25 Hz",
            "offset": "10 ms",
            "robots": {"cart-3": ["pose"], "cart-4": ["pose"]},
            "process": "one",
        },
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
    told = [{"at": f"{10 * tick} ms", "entity": name, verb: True} for tick, verb, name in events]
    return yard_text({"cart": cart}, players=players, network={"links": [link]}, events=told)


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
    events: Sequence[Change] | None = None,
    **chosen: Any,
) -> Seen:
    seen, events = Seen(), changes() if events is None else events
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
    seen, (period, offset) = usual(), (2 * PERIOD, 1) if player == "both" else (PERIOD, 0)
    spans = spans_of(*carts)
    turns = [[tick for tick in range(first, last) if tick % period == offset] for first, last in spans]
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
            assert all(first * TICK_NS <= packet.due_ns for packet in go.packets), "nor is told"
    assert any(said[2] for said in seen.said(player).values())


def test_who_acts_at_arrivals_is_neither_called_by_these_nor_by_time() -> None:
    seen, spans = usual(), spans_of("cart-4")
    ticks = [*seen.gos["waits"]]
    assert all(any(first <= tick < last for first, last in spans) for tick in ticks)
    firsts = [min(tick for tick in ticks if tick >= first) for first, _ in spans]
    assert [seen.said("waits")[tick][0] for tick in firsts] == ["1", "1"]
    assert len(ticks) > sum((last - first) // 20 for first, last in spans), "by packets, too"
    offered = [one for closing in seen.closings for one in closing.fates if one.destination == "waits"]
    sent = {one.sent_ns // TICK_NS for one in offered}
    assert all(any(first <= tick < last for first, last in spans) for tick in sent), "nothing is offered meanwhile"
    assert any(one.cause == RECEIVER_DOWN for one in offered), "what was in flight is lost"


def test_a_player_is_made_at_its_start_and_when_it_exists_again(monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[object] = []
    begin = Counting.__init__
    monkeypatch.setattr(Counting, "__init__", lambda self, *given: made.append(begin(self, *given)))
    systems: list[System] = []
    assert_the_same(fly(1, systems.append))
    spans = [spans_of(*carts) for carts in (*PLAYERS.values(), ("cart-4",))]
    assert len(made) == sum(map(len, spans)) + 1, "the one that is there at its start is the first that exists"
    state = systems[0].hub.state
    assert state is not None
    ages = [age for name in PLAYERS for one in state.ages.of(name, TICKS) for age in one.counts]
    assert ages and max(ages) < 10, "what the player before had heard is no age of this one"


def test_who_has_no_robot_always_exists() -> None:
    assert [*usual().gos[ALWAYS]] == [*range(0, TICKS, PERIOD)]
    assert {go.since for go in usual().gos[ALWAYS].values()} == {0}


def assert_the_same(seen: Seen) -> None:
    assert seen.run.digests == usual().run.digests
    assert seen.gos == usual().gos
    assert seen.fates() == usual().fates()


def test_by_requests_it_is_the_same_as_by_events_at_their_ticks(tmp_path: Path) -> None:
    asked: dict[str, tuple[str, str]] = {}

    def ask(system: System, verb: str, name: str) -> None:
        asked[system.request(verb, again_ns=3_000_000, name=name)] = verb, name

    def prepare(system: System) -> None:
        for tick, verb, name in changes():
            system.at_tick(tick - 5, partial(ask, system, verb, name))

    path = tmp_path / "asked.mcap"
    seen = fly(2, prepare, events=(), capture=path)
    answers = seen.run.answers
    assert all(answers[one].accepted for one in asked), answers
    events = sorted((answers[one].tick, *what) for one, what in asked.items())
    assert [what for _, *what in events] == [[*what] for _, *what in changes()]
    other = fly(1, events=events)
    assert (seen.run.digests, seen.gos, seen.fates()) == (other.run.digests, other.gos, other.fates())
    assert verify_capture(path, 3).equal
    assert what_if(open_capture(path)).changed == 0


@pytest.mark.parametrize("ending", ENDINGS)
def test_a_vhub_that_is_killed_between_remove_and_add_comes_back_and_nothing_changes(
    ending: Ending, tmp_path: Path
) -> None:
    """At a frame without cart-3 and one with it again, and while others are away."""

    def prepare(system: System) -> None:
        for tick in (20, 51, 52, 64, 85, 110, 135):
            system.at_tick(tick, partial(system.kill_hub, ending, 5_000_000))
        systems.append(system)

    systems: list[System] = []
    path = tmp_path / "killed.mcap"
    assert_the_same(fly(2, prepare, capture=path))
    assert verify_capture(path, 3).equal
    assert what_if(open_capture(path)).changed == 0
    (system,) = systems
    assert sum(entry["name"] == "vhub" for entry in system.supervisor.result()["recoveries"]) >= 5


@pytest.mark.parametrize("back_ms", [1, 3_000])
def test_a_player_that_is_lost_while_it_does_not_exist_holds_nothing_and_comes_back(back_ms: int) -> None:
    """The run waits for it where it is called again, not before."""
    times: dict[int, int] = {}

    def look(system: System, tick: int) -> None:
        times[tick] = system.bus.now_ns

    def prepare(system: System) -> None:
        def kill() -> None:
            for name in ("pilot-4", "waits"):
                system.kill(name)
                system.later(back_ms * 1_000_000, partial(system.start, name))

        system.at_tick(75, kill)
        for tick in (75, 109, 120):
            system.at_tick(tick, partial(look, system, tick))

    assert_the_same(fly(2, prepare))
    assert times[109] - times[75] < 1_000_000, "nobody waits"
    assert (times[120] - times[75] > 1_000_000_000) is (back_ms > 1000)


def test_in_realtime_a_run_that_continues_without_such_a_player_is_the_same() -> None:
    """It leaves after `client_back`, and joins again before its robot is added: to nobody was it away."""
    states: list[System] = []

    def prepare(system: System) -> None:
        states.append(system)

        def kill() -> None:
            system.kill("pilot-4")
            system.later(200_000_000, partial(system.start, "pilot-4"))

        system.at_tick(75, kill)

    sets = ("deadlines.client_back=100 ms", "deadlines.tick_lost=5 s")
    seen = fly(2, prepare, sets=sets, pace=Pace("realtime", Fraction(1)))
    assert_the_same(seen)
    state = states[0].hub.state
    assert state is not None
    assert 75 < state.members["pilot-4"].joined_tick < HERE["cart-4"][1][0]


def test_a_player_that_does_not_exist_any_more_is_not_waited_for() -> None:
    """In the end, either: its process is gone, and the run is done."""

    def prepare(system: System) -> None:
        system.at_tick(132, lambda: system.kill("pilot-4"))

    assert_the_same(fly(2, prepare))


class OfItsOwnTime(System):
    """A rehearsal with a player outside of lockstep."""

    def _enter_clients(self) -> None:
        for name in sorted(self.supervisor.state.deployment.players):
            self._enter_player(name, "boot")

    def _core_deadline_ns(self, process: Process) -> int:
        loop, due_ns = self.players.get(process.name), super()._core_deadline_ns(process)
        return due_ns if loop is None else min(due_ns, process.clock.when(loop.deadline_ns()))


def fly_freely(heard: str, *disturbances: tuple[int, Callable[[System], None]]) -> Seen:
    """The player of two carts runs by its own clock, at 100 Hz, and hears this of them; what happens at which ticks."""
    seen = Seen()
    about = f"class: {__name__}:{Counting.__name__}, rate: 100 Hz, lockstep: false"
    sets = (f"players.both={{{about}, robots: {{cart-3: [{heard}], cart-4: [{heard}]}}}}",)
    run = RunSettings("run", "yard.yaml", with_nodes(text(changes()), "yard.yaml", 2, sets), Pace("realtime"), TICKS)
    system = OfItsOwnTime(run, Settings(observer=seen.watch, on_closing=seen.closings.append))
    for tick, disturb in disturbances:
        system.at_tick(tick, partial(disturb, system))
    system.run()
    assert system.supervisor.result()["reason"] == "done"
    system.close()
    return seen


@pytest.mark.parametrize("kills", [(), (30, *range(47, 55), 81, 100)], ids=["undisturbed", "the vHub is killed"])
def test_a_free_running_player_hears_who_is_there_and_is_made_anew(kills: Sequence[int]) -> None:
    """As far as a process with a clock of its own can, which acts on what has reached it."""
    seen = fly_freely("pose", *((tick, lambda system: system.kill_hub("unpublished", 5_000_000)) for tick in kills))
    carts, spans, said, slack = PLAYERS["both"], spans_of("cart-3", "cart-4"), said_by_both(seen), 12 if kills else 4
    made = [at for at, (_, calls, _, _) in enumerate(said) if calls == "1"]
    assert len(made) == len(spans) and len(said) > 70, "another one at each coming"
    for at, (tick, _, robots, heard) in enumerate(said):
        first, last = spans[bisect(made, at) - 1]
        assert first <= tick <= last + slack, "it is not called while it does not exist"
        assert robots.split(",") in [
            [cart for cart in carts if is_here(cart, then)] for then in range(tick - slack, tick + 1)
        ]
        assert all(int(one.split("@")[1]) >= first for one in heard.split(",") if one), "it has heard nothing of before"


def said_by_both(seen: Seen) -> list[tuple[int, str, str, str]]:
    """Return the tick, the number of the call, who is there, and who was heard and when, call by call."""
    flights = [one for closing in seen.closings for one in closing.fates if one.source == "both"]
    logs = sorted((one.sequence, one.sent_ns // TICK_NS, one.payload) for one in flights if one.channel == "log")
    found = []
    for _, tick, payload in logs:
        calls, robots, heard = payload.decode().split(" ")
        found.append((tick, calls, robots, heard))
    return found


def is_here(cart: str, tick: int) -> bool:
    return any(first <= tick < last for first, last in HERE[cart])


@pytest.mark.parametrize("is_alone", [True, False])
def test_a_free_running_player_that_is_started_again_hears_who_is_there(is_alone: bool) -> None:
    """Also where no packet is for it, and where the vHub has ended as well and remembers the process before it."""

    def kill(system: System) -> None:
        if not is_alone:
            system.kill_hub("torn", 5_000_000)
        system.kill("both")
        system.later(20_000_000, partial(system.start, "both"))

    said = said_by_both(fly_freely("", (63, kill)))
    ((tick, robots),) = ((tick, robots) for tick, calls, robots, _ in said if calls == "1" and 60 < tick < 100)
    assert tick < 71 and robots == "cart-3,cart-4"


def quiet(events: Sequence[Change]) -> str:
    """Two carts that measure nothing, the second one a spare, with a pilot and a player that acts at arrivals."""
    about = {"class": f"{__name__}:{Counting.__name__}", "lockstep": True}
    cart = {"model": "differential_drive", "count": 1, "spare": 1, "spacing": {"y": "3 m"}}
    calls = {"act": "arrival", "arrivals": {"pilot-2": ["log"]}, "hears": {"pilot-2": ["log"]}}
    players = {
        "pilot-1": {**about, "rate": "1 Hz", "robots": {"cart-1": []}},
        "pilot-2": {**about, "rate": "10 Hz", "offset": "10 ms", "robots": {"cart-2": []}},
        "waits": {**about, "rate": "50 Hz", "robots": {"cart-2": []}, **calls},
    }
    told = [{"at": f"{10 * tick} ms", "entity": name, verb: True} for tick, verb, name in events]
    return yard_text({"cart": cart}, players=players, events=told)


@pytest.mark.parametrize("tick", range(50, 62))
def test_nodes_that_may_go_ahead_stop_where_a_player_may_exist_again(tick: int) -> None:
    """Deliveries are final ahead where nobody can send: not beyond a tick at which somebody may come and act."""
    seen, records = Seen(), []
    settings = Settings(observer=seen.watch)
    settings.on_journal = lambda name, record: records.append(record) if name == "vhub" else None
    run = rehearse(quiet([(tick, "add", "cart-2")]), "yard.yaml", 90, 2, settings=settings)
    assert run.json["reason"] == "done"
    closed = [record for raw in records if isinstance(record := decode_any(HubRecord, raw), TickRecord)]
    ahead = [decode(Deliveries, record.deliveries).following for record in closed]
    assert max(ahead[10:50]) == 2, "a tick at which nobody exists to whom something could happen"
    first, *_ = acts = [at for at in range(tick + 1, 90) if at % 10 == 1]
    assert [*seen.gos["pilot-2"]] == acts
    assert min(seen.gos["waits"]) == min(tick + 3, first + 1), "2 ticks after it exists, or at what it hears"
    assert {go.since for its in seen.gos.values() for go in its.values()} == {0, tick + 1}


def test_a_simulation_over_the_network_has_the_digests_of_the_run() -> None:
    with Simulation(load_deployment(text(changes()), "yard.yaml"), agents=[], network=True) as simulation:
        found = []
        for _ in range(TICKS):
            simulation.step()
            found.append(simulation.frame.digest)
    assert found == usual().run.digests


def test_without_a_network_its_players_come_and_go_as_well(monkeypatch: pytest.MonkeyPatch) -> None:
    """At each frame the newest command is that of the call at it: as many as since the player exists."""
    acted: dict[str, list[int]] = {}
    act, take = Resident.act, Bypass.take

    def noted(self: Resident, tick: int, now_ns: int, carrier: Carrier) -> list[Sent]:
        acted.setdefault(self.acting.name, []).append(tick)
        return act(self, tick, now_ns, carrier)

    def taken(self: Bypass, client: str) -> list[Received]:
        found = take(self, client)
        assert all(packet.sent_ns >= self.members[client].since * TICK_NS for packet in found)
        return found

    monkeypatch.setattr(Resident, "act", noted)
    monkeypatch.setattr(Bypass, "take", taken)
    with Simulation(load_deployment(text(()), "yard.yaml"), agents=[]) as simulation:
        for tick in range(TICKS):
            for at, verb, name in changes():
                if at == tick:
                    getattr(simulation, verb)(name)
            simulation.step()
            spans = [first for first, last in HERE["cart-1"] if first <= tick and tick + 1 < last]
            if spans:
                calls = sum(at % PERIOD == 0 for at in range(spans[-1], tick + 1))
                assert simulation.frame.vector("cart-1", "motion.set_point", 1) == [pytest.approx(calls / 1000.0)]
    for player in PLAYERS:
        assert acted[player] == [*usual().gos[player]]
    spans_of_waits = spans_of("cart-4")
    assert all(any(first <= tick < last for first, last in spans_of_waits) for tick in acted["waits"])
    assert len(acted["waits"]) > 20


@pytest.mark.parametrize(
    ("robots", "on", "lives_by"),
    [
        (["red.attack", "red.goal", "camera"], "camera", ("red.attack", "red.goal")),
        (["camera"], "red.goal", ("red.goal",)),
        (["camera"], None, ("camera",)),
        ([], "red.goal", ("red.goal",)),
        ([], None, ()),
    ],
)
def test_a_player_lives_by_robots_that_it_commands_is_on_or_hears(
    robots: list[str], on: str | None, lives_by: tuple[str, ...]
) -> None:
    deployment = DEPLOYMENT
    player = deployment.players["player-red"].model_copy(update={"robots": {name: [] for name in robots}, "on": on})
    assert robots_it_lives_by(deployment, player) == lives_by


def test_an_agent_that_comes_back_has_heard_nothing_and_commands_nothing_that_is_absent() -> None:
    with Simulation(load_deployment(text(()), "yard.yaml"), agents=["both"]) as simulation:
        agents = simulation.agents
        assert agents["both"].since == -1 and simulation.readings == {}
        with pytest.raises(BadValue, match="cart-3 is absent: add it first"):
            simulation.step({"cart-3": {"linear": 0.1, "angular": 0.0}})
        simulation.add("cart-3")
        simulation.step(ticks=3)
        assert agents["both"].since == 1 and [*simulation.readings] == [("cart-3", "pose")]
        with pytest.raises(BadValue, match="cart-4 is absent: add it first"):
            simulation.step({"cart-4": {"linear": 0.1, "angular": 0.0}})
        simulation.step({"cart-3": {"linear": 0.1, "angular": 0.0}})
        simulation.remove("cart-3")
        simulation.step(ticks=4)
        assert agents["both"].since == -1 and simulation.readings, "the last ones"
        simulation.add("cart-4")
        simulation.step()
        assert agents["both"].since == simulation.tick and not any(
            robot == "cart-3" for robot, _ in simulation.readings
        )
