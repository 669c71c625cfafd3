"""What each engine loads: what its node solves and nothing else, and never more than three rods with the ball."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Final

import pytest

from foosim.deployment.loader import load_deployment
from foosim.deployment.schema import Deployment
from foosim.library.table.rod_position import PositionActuator
from foosim.node.engines_pool import FINGERPRINT_TICKS
from foosim.node.physics.pure_engine import PureEngine
from foosim.protocol.channels import PART
from foosim.protocol.codec import decode
from foosim.protocol.messages import Part
from foosim.simulation.run import Rehearsed, rehearse
from foosim.simulation.settings import Traced
from foosim.simulation.system import Settings, System
from foosim.world.layout import Entity, Layout, build_layout

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
DEPLOYMENT: Final = load_deployment(TABLE.read_text(), TABLE.name)
LAYOUT: Final = build_layout(DEPLOYMENT)
BODIES: Final = {entity.name for entity in LAYOUT.entities if entity.is_solved and entity.name not in LAYOUT.spares}
TICKS: Final = 1000
SETS: Final = ("engine=pure", "table.rules.kickoff_delay=20 ms", "table.rules.kickoff_speed=2 m/s")


class Counting(PureEngine):
    """The pure engine, noting what it is asked to do."""

    def __init__(self, deployment: Deployment, layout: Layout, loads: list[set[str]]) -> None:
        super().__init__(deployment, layout)
        self.loads = loads
        self.commanded: set[str] = set()

    def load(self, entities: Sequence[Entity], state: Sequence[float]) -> None:
        self.loads.append({entity.name for entity in entities})
        super().load(entities, state)

    def command(self, entities: Sequence[Entity], commands: Sequence[Sequence[tuple[float, ...]]]) -> None:
        assert {entity.name for entity in entities} == self.loads[-1] - {"ball"}, "who is parked is not commanded"
        super().command(entities, commands)


@cache
def counted(nodes: int) -> tuple[Rehearsed, dict[str, list[set[str]]], dict[str, dict[int, set[str]]]]:
    """Return what each node's engine loaded, load by load, and the bodies of its parts, by tick."""
    loads: dict[str, list[set[str]]] = {}
    solved: dict[str, dict[int, set[str]]] = {}

    def watch(traced: Traced) -> None:
        if traced.what == "publish" and traced.channel == PART.name:
            part = decode(Part, traced.payload)
            entities = (LAYOUT.entities[index] for index in part.solved)
            solved.setdefault(part.node, {})[part.tick] = BODIES & {entity.name for entity in entities}

    def prepare(system: System) -> None:
        for name, solver in system.solvers.items():
            mine = loads.setdefault(name, [])
            solver._factory = lambda deployment, layout, mine=mine: Counting(deployment, layout, mine)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(PositionActuator, "steady", False)  # a rod that stands would not be loaded
        result = rehearse(TABLE.read_text(), TABLE.name, TICKS, nodes, SETS, Settings(observer=watch), prepare=prepare)
    assert result.json["ticks"] == TICKS
    (first,) = (mine for mine in loads.values() if mine[0] == BODIES)
    assert first[:FINGERPRINT_TICKS] == [BODIES] * FINGERPRINT_TICKS, "one node makes the small run, for all"
    del first[:FINGERPRINT_TICKS]
    return result, loads, solved


@pytest.mark.parametrize("nodes", [2, 8])
def test_each_engine_loads_what_its_node_solves_and_every_body_is_loaded_once(nodes: int) -> None:
    result, loads, solved = counted(nodes)
    assert result.json["handovers"] > 1, "else nothing was handed over"
    for tick in range(1, TICKS + 1):
        shares = [solved[node][tick] for node in sorted(solved)]
        assert sorted(name for share in shares for name in share) == sorted(BODIES), tick
    for node, parts in solved.items():
        expected = [share for _, share in sorted(parts.items()) if share]
        assert loads[node] == expected, node
        assert result.json["nodes"][node]["solved_ticks"] == len(expected)


def test_the_balls_engine_loads_at_most_three_rods() -> None:
    """With a node for each rod, who solves the ball loads its island and nothing beside: one to three rods."""
    _, loads, _ = counted(8)
    with_ball = [load - {"ball"} for mine in loads.values() for load in mine if "ball" in load]
    assert len(with_ball) == TICKS
    assert {2, 3} <= {len(rods) for rods in with_ball} <= {1, 2, 3}
    without = [load for mine in loads.values() for load in mine if "ball" not in load]
    assert {len(load) for load in without} == {1}
