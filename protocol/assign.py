"""Who computes what: islands from the frame alone, solvers from islands, owners and roster.

An island is a set of bodies that could touch each other within the tick: their bounding volumes, grown by *declared*
speed limit x tick, overlap (not by present speed: a resting ball leaves a kick at 15 m/s). It has one solver, the
owner of the rod nearest to one of its balls, ties by name. The choice never changes a result. Only + - x and
comparisons, so that all CPUs agree. Neighbours: `layout`, `barrier`; `step` knows neither node, owner nor epoch.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import hypot

from foosim.protocol.deployment import Deployment, RodRobot
from foosim.protocol.layout import Layout

MARGIN_M = 0.001
"""Added to every bounding volume: contacts are found up to Bullet's breaking threshold of 1 mm."""


@dataclass(frozen=True, slots=True)
class Reach:
    """Bounding volumes: `ball_m` is the radius of a grown ball; rods are (index, x, half width) and a band of z."""

    ball_m: float
    rods: tuple[tuple[int, str, float], ...]
    half_width_m: float
    z_low_m: float
    z_high_m: float
    balls: tuple[tuple[int, int], ...]


@dataclass(frozen=True, slots=True)
class Island:
    """Indices of its entities, ascending, and the rod (its name) whose owner solves it; empty without a rod."""

    entities: tuple[int, ...]
    nearest: str


@dataclass(frozen=True, slots=True)
class Share:
    """What one node computes in a tick: its islands and, ascending, every entity index in its part."""

    islands: tuple[tuple[int, ...], ...]
    solved: tuple[int, ...]


def line_x_m(deployment: Deployment, robot: RodRobot) -> float:
    """Return the x of a rod's axis in the world frame: red's own goal is at negative x, blue's lines are mirrored."""
    x = deployment.table.lines[robot.line].x
    return x if robot.team == "red" else -x


def reach_of(deployment: Deployment, layout: Layout) -> Reach:
    """Return the bounding volumes of a layout's bodies."""
    table = deployment.table
    rod = table.rod
    corner = hypot(rod.foot_radius, rod.foot.length / 2)
    tick_s = deployment.tick_ns / 1e9
    rods = []
    for entity in layout.rods:
        robot = deployment.robots[entity.name]
        assert isinstance(robot, RodRobot)
        rods.append((entity.index, entity.name, line_x_m(deployment, robot)))
    return Reach(
        ball_m=table.ball.radius + table.ball.speed_limit * tick_s + MARGIN_M,
        rods=tuple(rods),
        half_width_m=corner + MARGIN_M,
        z_low_m=rod.axis_height - corner - MARGIN_M,
        z_high_m=rod.axis_height + corner + MARGIN_M,
        balls=tuple((entity.index, entity.offsets["position"]) for entity in layout.balls),
    )


def _near_rods(numbers: Sequence[float], start: int, reach: Reach) -> list[tuple[float, str, int]]:
    """Return (distance, name, index) of the rods that a ball could touch within the tick."""
    x, z = numbers[start], numbers[start + 2]
    ball = reach.ball_m
    if z - ball > reach.z_high_m or z + ball < reach.z_low_m:
        return []
    limit = ball + reach.half_width_m
    return [(abs(x - axis), name, index) for index, name, axis in reach.rods if abs(x - axis) <= limit]


def _join(groups: list[tuple[set[int], list[tuple[float, str, int]]]]) -> list[tuple[set[int], list[tuple[float, str, int]]]]:
    """Merge groups that share an entity."""
    joined: list[tuple[set[int], list[tuple[float, str, int]]]] = []
    for members, rods in groups:
        rest = []
        for other_members, other_rods in joined:
            if members & other_members:
                members, rods = members | other_members, rods + other_rods
            else:
                rest.append((other_members, other_rods))
        joined = [*rest, (members, rods)]
    return joined


def islands_of(numbers: Sequence[float], layout: Layout, reach: Reach) -> tuple[Island, ...]:
    """Return the islands of an edited frame's bodies, ordered by their first entity."""
    groups: list[tuple[set[int], list[tuple[float, str, int]]]] = []
    for index, start in reach.balls:
        rods = _near_rods(numbers, start, reach)
        members = {index, *(rod for _, _, rod in rods)}
        for other, other_start in reach.balls:
            gaps = [abs(numbers[start + axis] - numbers[other_start + axis]) for axis in range(3)]
            if other != index and max(gaps) <= 2 * reach.ball_m:
                members.add(other)
        groups.append((members, rods))
    islands = []
    taken: set[int] = set()
    for members, rods in _join(groups):
        taken |= members
        islands.append(Island(tuple(sorted(members)), min(rods)[1] if rods else ""))
    islands += [Island((index,), name) for index, name, _ in reach.rods if index not in taken]
    return tuple(sorted(islands, key=lambda island: island.entities))


class Assignment:
    """Shares by node, for one layout, roster and owners; equal islands give the same share object again."""

    def __init__(self, layout: Layout, reach: Reach, roster: Sequence[str], owners: Mapping[str, str]) -> None:
        assert roster and list(roster) == sorted(roster), roster
        self.layout = layout
        self.reach = reach
        self.roster = tuple(roster)
        self.owners = dict(owners)
        self._shares: dict[tuple[Island, ...], dict[str, Share]] = {}

    def solver_of(self, island: Island) -> str:
        """Return the node that solves an island: the owner of its nearest rod, else the first node of the roster."""
        return self.owners[island.nearest] if island.nearest else self.roster[0]

    def shares(self, numbers: Sequence[float]) -> dict[str, Share]:
        """Return every node's share of the tick that starts from these edited numbers."""
        islands = islands_of(numbers, self.layout, self.reach)
        shares = self._shares.get(islands)
        if shares is None:
            shares = self._shares[islands] = self._divide(islands)
        return shares

    def _divide(self, islands: tuple[Island, ...]) -> dict[str, Share]:
        mine: dict[str, list[tuple[int, ...]]] = {node: [] for node in self.roster}
        solved: dict[str, list[int]] = {node: [] for node in self.roster}
        for island in islands:
            solver = self.solver_of(island)
            mine[solver].append(island.entities)
            solved[solver].extend(island.entities)
        for entity in self.layout.entities:
            if not entity.has_body:
                solved[self.owners.get(entity.name, self.roster[0])].append(entity.index)
        return {node: Share(tuple(mine[node]), tuple(sorted(solved[node]))) for node in self.roster}
