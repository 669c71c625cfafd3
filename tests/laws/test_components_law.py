"""Law 6 in whole runs: a component more shifts no draw, and the order in which a deployment names things is nothing.

What stages draw is in `tests/links/test_channels.py`; here sensors are added to the table's text, players hear and
answer, robots send several packets of a channel in a tick, and the vHub dies amid ticks.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from functools import cache, partial
from types import ModuleType
from typing import Any, Final

import msgspec
import pytest
import yaml

from foosim.capture.rows import PacketRow
from foosim.client.player import Packet, Player, Samples, Turn
from foosim.deployment.assets import pin_assets
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.deployment.schema import Deployment
from foosim.simulation.journals import ENDINGS, Ending
from foosim.simulation.run import rehearse
from foosim.simulation.system import Settings, System
from foosim.vhub.network.packet import Flight
from foosim.vhub.recording.rows_of_closing import packet_row
from foosim.world.frame import Frame
from tests.deployed import TABLE, TEXT
from tests.whole_worlds import assets, written, yard

TICKS: Final = 600
MS: Final = 1_000_000
LINK: Final = "delay: 1 ms, jitter: {shape: gamma, mean: 1 ms, sd: 1 ms}, loss: 20 %, duplicate: 10 %, order: free"
LOSSY: Final = f"network.links=[{{id: everything, from: '*', to: '*', {LINK}}}]"
BUMPER: Final = "kind: encoder, modifiers: [{kind: gaussian_noise, std: {slide: 1 mm, spin: 1 deg}}]"
BEFORE: Final = (
    f"robots.red.goal.sensors.bumper={{{BUMPER}, rate: 100 Hz}}",
    f"robots.blue.attack.sensors.bumper={{{BUMPER}, rate: 250 Hz}}",
)
"""At its ticks its packets have the numbers that those of `encoder` had; one samples also where all else is silent."""
HEARD: Final = "players.player-red.robots.red.goal=[encoder, bumper]"
Key = tuple[str, str, str, int, int, int]
Rows = dict[Key, PacketRow]
"""By source, destination, channel, time of sending, count within the channel (a client's number) and copy."""


class Ear(Player):
    """Hears what it is told to, and has a rod answer twice at each of its turns."""

    def __init__(self, deployment: Deployment, parameters: Mapping[str, Any]) -> None:
        self.echoes = [Packet("red.goal", "echo", bytes([n])) for n in range(int(parameters.get("echoes", 0)))]

    def act(self, tick: int, samples: Samples) -> Turn:
        return Turn({}, self.echoes)


@pytest.fixture(autouse=True)
def ear(monkeypatch: pytest.MonkeyPatch) -> None:
    module = ModuleType("an_ear")
    module.Ear = Ear  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "an_ear", module)


def listener(hears: str, echoes: int = 0) -> str:
    more = f"robots: {{red.goal: [encoder]}}, hears: {{red.goal: {hears}}}, parameters: {{echoes: {echoes}}}"
    return f"players.ear={{class: an_ear:Ear, rate: 100 Hz, {more}}}"


def rows_of(flights: Sequence[Flight], deployment: Deployment) -> Rows:
    found: Rows = {}
    for flight in flights:
        row = msgspec.structs.replace(packet_row(flight), wall_released_ns=0)
        nth = row.sequence
        if row.source in deployment.robots:
            row, nth = msgspec.structs.replace(row, sequence=0), row.count
        key = row.source, row.destination, row.channel, row.sent_ns, nth, row.copy
        assert key not in found, key
        found[key] = row
    return found


def run(sets: Sequence[str], text: str = "", ticks: int = TICKS, kills: Mapping[int, Ending] | None = None) -> Rows:
    """Rehearse the table on two nodes; return the rows of all packets."""
    flights: list[Flight] = []
    deployments: list[Deployment] = []

    def prepare(system: System) -> None:
        deployments.append(system.supervisor.state.deployment)
        for tick, ending in (kills or {}).items():
            system.at_tick(tick, partial(system.kill_hub, ending, 100 * MS))

    settings = Settings(on_closing=lambda closing: flights.extend(closing.fates))
    given = ["engine=pure", *sets]
    result = rehearse(text or TEXT, TABLE.name, ticks, 2, given, settings, prepare=prepare)
    assert result.json["reason"] == "done" and len(result.json["recoveries"]) == len(kills or {})
    return rows_of(flights, deployments[0])


@cache
def usual() -> Rows:
    found = run([LOSSY])
    assert {"", "random_loss"} <= {row.cause for row in found.values()}
    assert len(found) > 2_000 and any(row.copy for row in found.values())
    return found


def test_a_further_encoder_changes_no_other_packet() -> None:
    """Whether it is heard or not: over 600 ticks of play every other row is the same, of players as of robots."""
    assert run([LOSSY, *BEFORE]) == usual()
    beside = run([LOSSY, *BEFORE, HEARD])
    assert {key: row for key, row in beside.items() if key[2] != "bumper"} == usual()
    assert len(beside) > len(usual()) + 90


def test_a_further_subscriber_of_a_broadcast_changes_no_other_packet() -> None:
    beside = run([LOSSY, listener("[encoder]")])
    assert {key: row for key, row in beside.items() if key[1] != "ear"} == usual()
    assert len(beside) > len(usual()) + 90


def test_the_order_in_which_a_deployment_names_robots_channels_and_players_is_nothing() -> None:
    ticks, sets = 400, (LOSSY, *BEFORE, HEARD, listener("[bumper, encoder]", 2))
    tree = yaml.safe_load(apply_sets(TEXT, TABLE.name, sets))
    named = run((), yaml.safe_dump(tree, sort_keys=True), ticks)
    assert len(named) > 1_500
    for section in ("robots", "players", "nodes"):
        tree[section] = dict(sorted(tree[section].items(), reverse=True))
    for robot in tree["robots"].values():
        robot["sensors"] = dict(reversed(robot["sensors"].items()))
    for player in tree["players"].values():
        heard = {robot: channels[::-1] for robot, channels in player["robots"].items()}
        player["robots"] = dict(reversed(heard.items()))
    for node in tree["nodes"].values():
        node["robots"].reverse()
    assert run((), yaml.safe_dump(tree, sort_keys=False), ticks) == named


@pytest.mark.parametrize("ending", ENDINGS)
def test_counts_need_no_memory_a_vhub_that_dies_amid_a_tick_gives_the_same(ending: Ending) -> None:
    """They follow from the tick's samples, which the journal or a node has: a rod echoes twice in a tick."""
    sets = LOSSY, *BEFORE, HEARD, listener("[bumper, echo]", 2)
    found = run(sets, ticks=240)
    counts = {row.count for row in found.values() if row.channel == "echo" and row.destination == "ear"}
    assert counts >= {0, 1}
    echoes = [key for key in found if key[:3] == ("red.goal", "ear", "echo") and not key[5]]
    words = {found[key].loss_word for key in echoes}
    assert len(words) == len(echoes) > 50
    assert run(sets, ticks=240, kills={41: ending, 118: ending, 121: ending}) == found


HAPPENS: Final[dict[str, tuple[bool, dict[str, Any]]]] = {
    "nothing": (False, {}),
    "a grasp and a job": (True, {}),
    "a removal": (False, {"entity": "drive-2", "remove": True}),
    "an addition": (False, {"entity": "drive-4", "add": "6,9"}),
    "a setting": (False, {"entity": "base-1", "set": {"down": True}}),
}
"""Whether cranes hand a load over, and what an event does to robots that are far from all others."""
OTHERS: Final = frozenset(("arm", "quad", "scout"))


def living(what: str) -> Rows:
    """Return the rows of all packets of robots that are far from what happens."""
    grips, event = HAPPENS[what]
    data = yaml.safe_load(yard())
    data["events"] = [{"at": "0.3 s", **event}] if event else []
    data["network"]["links"] = [{"id": "all", "from": "*", "to": "*", **yaml.safe_load(f"{{{LINK}}}")}]
    if not grips:
        data["players"]["script"]["parameters"]["steps"] = []
    noise = {"kind": "gaussian_noise", "std": {"angular_rate": "0.1 rad/s"}}
    for robot in ("scout", "quad"):
        data["robots"][robot]["sensors"]["imu"]["modifiers"] = [noise]
    data["players"]["ear"] = {**data["players"]["flight"], "robots": {"quad": ["imu"], "scout": ["imu", "pose"]}}
    flights: list[Flight] = []
    frames: list[Frame] = []
    settings = Settings(on_closing=lambda closing: flights.extend(closing.fates), on_commit=frames.append)
    text = written(data)
    result = rehearse(text, "yard.yaml", 90, 2, settings=settings, folder=assets())
    assert result.json["reason"] == "done", result.json["reason"]
    last = frames[-1]
    has_happened = {
        "a grasp and a job": last.at("crane-1", "gripper.jobs_numbers") > 0.0,
        "a removal": last.at("drive-2", "absent") == 1.0,
        "an addition": last.at("drive-4", "absent") == 0.0,
        "a setting": last.at("base-1", "down") == 1.0,
    }
    assert [one for one, is_so in has_happened.items() if is_so] == [one for one in [what] if one != "nothing"]
    pinned, files = pin_assets(text, "yard.yaml", assets())
    rows = rows_of(flights, load_deployment(pinned, "yard.yaml").with_assets(files))
    return {key: row for key, row in rows.items() if not OTHERS.isdisjoint(key[:2])}


@cache
def nothing() -> Rows:
    found = living("nothing")
    assert len(found) > 200 and {"", "random_loss"} <= {row.cause for row in found.values()}
    return found


@pytest.mark.parametrize("what", [*HAPPENS][1:])
def test_what_happens_to_some_changes_no_packet_of_others(what: str) -> None:
    assert living(what) == nothing()
