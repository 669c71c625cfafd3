"""Laws 1 to 3 where sensors and players do not act in step: whoever computes and whoever dies, the same world."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache, partial
from pathlib import Path
from typing import Any, Final

import pytest

from foosim.capture.reader import open_capture
from foosim.client.player import Packet, Player, Samples, Turn
from foosim.common import limits
from foosim.common.json_text import encode_json
from foosim.deployment.loader import apply_sets
from foosim.deployment.schema import Deployment
from foosim.library.table.players.football import Team
from foosim.protocol import channels
from foosim.protocol.codec import decode
from foosim.protocol.messages import Deliveries, Go
from foosim.simulation import journals
from foosim.simulation.run import Rehearsed, rehearse
from foosim.simulation.settings import Traced
from foosim.simulation.system import Settings, System
from foosim.simulation.verify import verify_capture
from foosim.simulation.what_if import what_if
from foosim.world.edits import Disrupt
from tests.deployed import TABLE
from tests.laws.test_hub_recovery_law import SETS, Fault, Seen, assert_the_same, fly, kill_hub
from tests.swarm.campaign import fly as fly_seed
from tests.swarm.faults import TICKS as SWARM_TICKS
from tests.turns import BY_PERIOD

TICKS: Final = 120
OFFSETS: Final = (
    *SETS,
    *BY_PERIOD,
    "robots.camera.sensors.ball.offset=2 ms",
    "robots.red.goal.sensors.encoder.offset=6 ms",
    "players.player-red.offset=4 ms",
    "players.player-blue.rate=50 Hz",
    "players.player-blue.offset=16 ms",
)


@cache
def with_offsets() -> Seen:
    return fly([], TICKS, OFFSETS)


def run(nodes: int, sets: tuple[str, ...]) -> tuple[Rehearsed, list[Deliveries]]:
    """Rehearse the table on so many nodes; return the result, and what the vHub said to nodes."""
    said: list[Deliveries] = []

    def watch(traced: Traced) -> None:
        if traced.channel == channels.DELIVERIES.name:
            said.append(decode(Deliveries, traced.payload))

    settings = Settings(observer=watch, observes=("publish",))
    return rehearse(TABLE.read_text(), TABLE.name, TICKS, nodes, sets, settings), said


def test_players_and_sensors_with_offsets_act_at_their_ticks() -> None:
    seen = with_offsets()
    assert seen.told.keys() == {"player-red", "player-blue"}
    sent = {(f.source, f.channel, f.sent_ns // 2_000_000 % 10) for c in seen.closings for f in c.fates}
    assert {at for source, _, at in sent if source == "player-red"} == {2, 7}
    assert {at for source, _, at in sent if source == "player-blue"} == {8}
    assert {at for source, _, at in sent if source == "camera"} == {1, 6}
    assert {at for source, _, at in sent if source == "red.goal"} == {3, 8}
    assert {at for source, _, at in sent if source == "red.attack"} == {0, 5}
    joined = {joining.name: closing.frame.tick for closing in seen.closings for joining in closing.joins}
    assert joined == {"player-red": 2, "player-blue": 8}


UNEVEN: Final = (
    *SETS,
    *BY_PERIOD,
    "robots.camera.sensors.ball.rate=30 Hz",
    "robots.camera.sensors.ball.modifiers=[{kind: delay, time: 70 ms}, {kind: bias_walk, walk: 1 mm}]",
    "robots.red.goal.sensors.encoder.rate=333 Hz",
    "robots.red.goal.sensors.encoder.offset=1001 us",
    "robots.red.goal.sensors.encoder.modifiers=[{kind: gaussian_noise, std: {slide: 1 mm}}]",
)


def test_sensors_at_uneven_rates_measure_at_their_ticks_and_are_the_same_world_on_one_node_or_two() -> None:
    seen = fly([], TICKS, UNEVEN)
    alone, _ = run(1, UNEVEN)
    two, _ = run(2, UNEVEN)
    assert alone.digests == two.digests == seen.run.digests
    sent = {(f.source, f.sent_ns) for c in seen.closings for f in c.fates}
    ticks = {name: sorted(ns // 2_000_000 for source, ns in sent if source == name) for name in ("camera", "red.goal")}
    assert all(ns % 2_000_000 == 0 for _, ns in sent), "the time of a reading is that of its frame"
    due = [-(-number * 500 // 30) for number in range(TICKS * 30 // 500 + 1)]
    assert ticks["camera"] == [tick for tick in due if 50 <= tick < TICKS], "those before have waited for their delay"
    times = [1_001_000 + number * 1_000_000_000 / 333 for number in range(TICKS)]
    assert ticks["red.goal"] == [tick for tick in (int(-(-ns // 2_000_000)) for ns in times) if tick < TICKS]


# --- who acts at arrival ---------------------------------------------------------------------------------------------


class Talker(Player):
    """Plays, and says something to the other player each time it is asked; it remembers how often that was."""

    def __init__(self, deployment: Deployment, parameters: Mapping[str, Any]) -> None:
        self._team = Team(deployment, parameters)
        self._other = "player-blue" if parameters["team"] == "red" else "player-red"
        self._calls = 0

    def act(self, tick: int, samples: Samples) -> Turn:
        self._calls += 1
        said = Packet(self._other, "news", f"{self._calls}".encode()), Packet("", "gossip", b"all")
        return Turn(self._team.act(tick, samples), said)


PERIOD: Final = 10
ARRIVALS: Final = {"player-red": {("camera", "ball")}, "player-blue": {("player-red", "news")}}
TALKERS: Final = (
    *SETS,
    "robots.camera.sensors.ball.offset=2 ms",
    *(f"players.{name}.class=tests.laws.test_timing_laws:Talker" for name in ARRIVALS),
    *(f"players.{name}.act=arrival" for name in ARRIVALS),
    *(f"players.{name}.rate=50 Hz" for name in ARRIVALS),
    "players.player-red.arrivals={camera: [ball]}",
    "players.player-red.hears={player-blue: [gossip]}",
    "players.player-blue.hears={player-red: [news]}",
    "players.player-blue.arrivals={'player-*': [news]}",
)
NETWORKS: Final = {
    "as deployed": (),
    "no delay": ("network.links=[]",),
    "losses and copies": (
        "network.links=[{id: w, from: '*', to: '*', delay: 1 ms, jitter: {shape: gamma, sd: 3 ms}, loss: 40 %,"
        " duplicate: 20 %, order: free}]",
    ),
    "long": ("network.links=[{id: w, from: '*', to: '*', delay: 23 ms}]",),
    "wifi": (
        "network={radios: {w: {preset: wifi_5_indoor, duplicate: 3 %}}, robots: {'*': [w]},"
        " places: {player-red: [-2 m, 3 m, 1 m], player-blue: [3 m, 0 m, 1 m], camera: [0 m, 0 m, 2 m]}}",
    ),
}


def disturb(system: System) -> None:
    """Order clogs, heals of them, and a partition, for known ticks."""
    for tick, event in (
        (20, {"clog": {"from": "camera", "to": "player-red"}}),
        (37, {"heal": "clogs"}),
        (44, {"clog": {"from": "player-red", "to": "player-blue"}, "for": "30 ms"}),
        (52, {"heal": "all"}),
        (60, {"partition": [["camera"], ["player-red"]], "for": "34 ms"}),
        (85, {"clog": {"from": "*", "to": "player-*"}, "for": "16 ms"}),
    ):
        system.supervisor.state.order(tick, [Disrupt(encode_json(event).decode())])


@cache
def talk(network: str, nodes: int = 2, is_disturbed: bool = True, *faults: Fault) -> Seen:
    seen = Seen()
    chosen = Settings(observer=seen.watch, on_closing=seen.closings.append)

    def prepare(system: System) -> None:
        seen.systems.append(system)
        if is_disturbed:
            disturb(system)
        for tick, fault in faults:
            system.at_tick(tick, partial(fault, system))

    sets = (*TALKERS, *NETWORKS[network])
    seen.run = rehearse(TABLE.read_text(), TABLE.name, TICKS, nodes, sets, chosen, prepare=prepare)
    return seen


def asked_at(seen: Seen, name: str) -> list[int]:
    """The ticks at which a player was asked."""
    (gos,) = [[decode(Go, payload) for payloads in told.values() for payload in payloads]
              for player, told in seen.told.items() if player == name]  # fmt: skip
    return sorted(go.tick for go in gos)


@pytest.mark.parametrize("network", NETWORKS)
def test_who_acts_at_arrival_is_asked_then_and_when_its_period_is_over(network: str) -> None:
    """By what the rows say alone: a call at each tick at which something came, and a period after the last one."""
    seen = talk(network)
    packets = [flight for closing in seen.closings for flight in closing.fates]
    for name, arrivals in ARRIVALS.items():
        arrived = {
            flight.arrival_tick
            for flight in packets
            if not flight.cause and flight.destination == name and (flight.source, flight.channel) in arrivals
        }
        (last,) = [closing.frame.tick for closing in seen.closings for j in closing.joins if j.name == name]
        expected = []
        for tick in range(last, TICKS):
            if tick in arrived or tick - last == PERIOD:
                expected.append(tick)
                last = tick
        asked = asked_at(seen, name)
        assert asked == expected and set(asked) & arrived and set(asked) - arrived, "by packets, and without one"
        got = {flight.arrival_tick for flight in packets if not flight.cause and flight.destination == name}
        assert got <= set(asked), "all that it hears comes with a call"


@pytest.mark.parametrize("network", NETWORKS)
def test_who_acts_at_arrival_does_so_on_any_number_of_nodes_and_whoever_dies(
    network: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A fold begins at a state that was written down a few ticks before, too."""
    usual = talk(network)
    assert usual.run.json["reason"] == "done" and len(usual.run.digests) == TICKS
    assert talk(network, 1).run.digests == talk(network, 3).run.digests == usual.run.digests
    monkeypatch.setattr(limits, "CHECKPOINT_TICKS", 7)
    monkeypatch.setattr(journals, "HEADS_KEPT", 2)
    kills = (
        (22, kill_hub("now")),
        (38, kill_hub("torn")),
        (46, kill_hub("unpublished")),
        (90, kill_hub("now", 5_000_000)),
    )
    assert_the_same(talk(network, 2, True, *kills), usual)


def test_between_their_calls_deliveries_are_final() -> None:
    """A slow network leaves ticks at which nobody can act, and they are said to be without packets ahead."""
    for network, is_disturbed in (("as deployed", False), ("long", True)):
        seen = talk(network, 2, is_disturbed)
        said = [decode(Deliveries, payload) for payloads in seen.deliveries.values() for payload in payloads]
        assert sum(deliveries.following > 0 for deliveries in said) > 5
        acting = {tick for name in ARRIVALS for tick in asked_at(seen, name)}
        final = {d.tick + n for d in said for n in range(1, d.following + 1)}
        assert final and not {tick + 1 for tick in acting} & final, "what is sent then may reach robots next"


def test_a_capture_of_them_is_verified_judged_again_and_recovered(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    sets = (*TALKERS, *NETWORKS["losses and copies"])
    rehearse(TABLE.read_text(), TABLE.name, TICKS, 2, sets, capture=path, prepare=disturb)
    assert verify_capture(path).equal and verify_capture(path, 3).equal
    found = what_if(open_capture(path))
    assert (found.packets > 300, found.changed, found.inputs_changed) == (True, 0, 0)


def test_the_laws_hold_for_them_under_random_faults() -> None:
    for seed, network in ((3003, "as deployed"), (3007, "no delay"), (3011, "as deployed")):  # one world
        text = apply_sets(TABLE.read_text(), TABLE.name, [*TALKERS, *NETWORKS[network]])
        flown = fly_seed(text, TABLE.name, seed)
        assert flown.broken == "" and flown.ticks == SWARM_TICKS, f"seed {seed}: {flown.faults}"
