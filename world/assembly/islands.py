"""The division of a tick's work: islands from the frame alone, solvers from islands, owners and roster.

An island is a set of bodies that could touch each other within the tick: their bounding volumes, grown by *declared*
speed limit x tick, overlap (not by present speed: a resting ball leaves a kick at 15 m/s). It has one solver, the
owner of the rod nearest to one of its balls, ties by name. A rover is an island of its own, since it meets the others
where they were at the tick's start; its owner solves it. The choice never changes a result. Only + - x and
comparisons, so that all CPUs agree.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from foosim.world.assembly.presence import Presence
from foosim.world.assembly.volumes import BodyIsland, Volumes, solver_by_name
from foosim.world.components.reach import Island, Reach
from foosim.world.fixed_scenery import kits_of
from foosim.world.layout import Layout
from foosim.world.spec import WorldSpec


@dataclass(frozen=True)
class Share:
    """The work of one node in a tick: its islands and, ascending, every entity index in its part.

    `movers` are those in the way of each island; empty where nothing has any.
    """

    islands: tuple[tuple[int, ...], ...]
    solved: tuple[int, ...]
    movers: tuple[tuple[int, ...], ...] = ()


def reach_of(spec: WorldSpec, layout: Layout) -> Reach | Volumes:
    """Return the bounding volumes of a layout's bodies: of any bodies, or of rods and balls alone, which is faster."""
    if layout.couples:
        return Volumes(spec, layout)
    return table_reach_of(spec, layout)


def table_reach_of(spec: WorldSpec, layout: Layout) -> Reach:
    """Return the bounding volumes of rods and balls, and the entities that move alone."""
    alone = tuple(
        Island((entity.index,), entity.name if entity.is_robot else "")
        for entity in layout.entities
        if entity.kind.motion is not None
    )
    reaches = (kit.reach(layout) for _, kit in kits_of(spec))
    found = next((reach for reach in reaches if reach is not None), Reach(0.0, (), (), 0.0, 0.0, 0.0, ()))
    return replace(found, alone=alone)


Near = tuple[int, int, str]
"""Of one ball: the range of rods (in order of x) that it could touch within the tick, and the nearest one's name."""
Touching = tuple[tuple[Near, ...], tuple[tuple[int, int], ...]]
"""The base of islands: `Near` of every ball, and the pairs of balls that could touch each other."""


def touching_of(numbers: Sequence[float], reach: Reach) -> Touching:
    """Return the pairs that could touch within the tick that starts from these edited numbers."""
    near = []
    limit = reach.ball_m + reach.half_width_m
    for _, start in reach.balls:
        x, z = numbers[start], numbers[start + 2]
        first = last = 0
        nearest, least = "", limit
        if z - reach.ball_m <= reach.z_high_m and z + reach.ball_m >= reach.z_low_m:
            first, last = bisect_left(reach.axes, x - limit), bisect_right(reach.axes, x + limit)
            for _, name, axis in reach.rods[first:last]:
                distance = abs(x - axis)
                if not nearest or distance < least or (distance == least and name < nearest):
                    nearest, least = name, distance
        near.append((first, last, nearest))
    pairs = []
    for one, (_, start) in enumerate(reach.balls):
        for other in range(one + 1, len(reach.balls)):
            there = reach.balls[other][1]
            if all(abs(numbers[start + axis] - numbers[there + axis]) <= 2 * reach.ball_m for axis in range(3)):
                pairs.append((one, other))
    return tuple(near), tuple(pairs)


def islands_of(numbers: Sequence[float], reach: Reach, touching: Touching) -> tuple[Island, ...]:
    """Return the islands of an edited frame's bodies, ordered by their first entity.

    An island's nearest rod is the one with the least (distance, name) over its balls.
    """
    near, pairs = touching
    group = list(range(len(near)))
    links = list(pairs)
    for one, (first, last, _) in enumerate(near):
        links += [(one, other) for other in range(one) if max(first, near[other][0]) < min(last, near[other][1])]
    for one, other in links:
        low, high = sorted((group[one], group[other]))
        group = [low if number == high else number for number in group]
    islands = []
    taken: set[int] = set()
    for number in sorted(set(group)):
        balls = [ball for ball in range(len(near)) if group[ball] == number]
        rods = {rod for ball in balls for rod in range(near[ball][0], near[ball][1])}
        members = {reach.balls[ball][0] for ball in balls} | {reach.rods[rod][0] for rod in rods}
        taken |= members
        candidates = [
            (abs(numbers[reach.balls[ball][1]] - reach.rods[rod][2]), reach.rods[rod][1])
            for ball in balls
            for rod in range(near[ball][0], near[ball][1])
        ]
        islands.append(Island(tuple(sorted(members)), min(candidates)[1] if candidates else ""))
    islands += [Island((index,), name) for index, name, _ in reach.rods if index not in taken]
    islands += reach.alone
    return tuple(sorted(islands, key=lambda island: island.entities))


class Assignment:
    """Shares by node, for one layout, roster and owners; with one ball, equal neighbourhoods give equal shares."""

    def __init__(
        self, layout: Layout, reach: Reach | Volumes, roster: Sequence[str], owners: Mapping[str, str]
    ) -> None:
        assert roster and list(roster) == sorted(roster), roster
        self.layout = layout
        self.presence = Presence(layout)
        self.reach = reach
        """The volumes of present entities."""
        self._all_reach = reach
        self._absent: frozenset[int] = frozenset()
        self.roster = tuple(roster)
        self.owners = dict(owners)
        self._unsolved = [entity.index for entity in layout.entities if not entity.is_solved]
        self._shares: dict[Touching, dict[str, Share]] = {}
        self._divided: tuple[list[BodyIsland], dict[str, Share]] = [], {}
        """The islands of any bodies that were divided last, and their shares."""

    def solver_of(self, island: Island | BodyIsland) -> str:
        """Return the node that solves an island: its nearest robot's owner, else the first node of the roster, or of
        any bodies the one that follows from the name of the first."""
        if island.nearest:
            return self.owners[island.nearest]
        if isinstance(island, BodyIsland):
            return solver_by_name(self.layout.entities[island.entities[0]].name, self.roster)
        return self.roster[0]

    def shares(self, numbers: Sequence[float], values: NDArray[np.float64] | None = None) -> dict[str, Share]:
        """Return every node's share of the tick that starts from these edited numbers; `values` are the same as an
        array, where there is one."""
        absent = self.presence.absent(numbers if values is None else values)
        if absent is not self._absent:
            self._absent, self.reach = absent, self._all_reach.without(absent)
            self._shares, self._divided = {}, ([], {})
        if isinstance(self.reach, Volumes):
            islands = self.reach.islands(numbers)
            if not self._divided[1] or islands is not self._divided[0]:
                self._divided = islands, self._divide(islands)
            return self._divided[1]
        touching = touching_of(numbers, self.reach)
        if len(self.reach.balls) > 1:
            return self._divide(islands_of(numbers, self.reach, touching))
        shares = self._shares.get(touching)
        if shares is None:
            shares = self._shares[touching] = self._divide(islands_of(numbers, self.reach, touching))
        return shares

    def _divide(self, islands: Sequence[Island | BodyIsland]) -> dict[str, Share]:
        mine: dict[str, list[Island | BodyIsland]] = {node: [] for node in self.roster}
        solved: dict[str, list[int]] = {node: [] for node in self.roster}
        for island in islands:
            solver = self.solver_of(island)
            mine[solver].append(island)
            solved[solver].extend(island.entities)
        # Unsolved and absent entities are copied by their owners, by the first node without one.
        for index in sorted({*self._unsolved, *self._absent}):
            solved[self.owners.get(self.layout.entities[index].name, self.roster[0])].append(index)
        return {
            node: Share(
                tuple([island.entities for island in its]),
                tuple(sorted(solved[node])),
                tuple([island.movers for island in its if isinstance(island, BodyIsland)]),
            )
            for node, its in mine.items()
        }
