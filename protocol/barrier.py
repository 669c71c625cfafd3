"""Collecting the parts of one tick into the next frame: the node's last step and the supervisor's commit.

A part counts if its epoch, its sender and its basis are one's own, and the parts together must hold each slot exactly
once. Two parts that claim one slot are a bug of ours on the sender's side: both are named, neither is merged silently.
Neighbours: `assign` decides who writes what, `frame` is the result.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from foosim.protocol.errors import Malformed
from foosim.protocol.frame import Frame
from foosim.protocol.layout import Layout
from foosim.protocol.messages import Part

Indices = NDArray[np.intp]


class Slots:
    """Which numbers of a layout a solver or an owner writes, as index arrays made once per combination."""

    def __init__(self, layout: Layout, owners: Mapping[str, str]) -> None:
        self.layout = layout
        self.owners = dict(owners)
        self._solver: dict[tuple[int, ...], Indices] = {}
        self._owner: dict[str, Indices] = {}

    def solver(self, solved: tuple[int, ...]) -> Indices:
        """Return the positions of the solver's slots of these entities, in layout order."""
        indices = self._solver.get(solved)
        if indices is None:
            entities = self.layout.entities
            runs = [np.arange(entities[index].start, entities[index].split) for index in solved]
            indices = self._solver[solved] = np.concatenate([np.arange(0), *runs])
        return indices

    def owner(self, node: str) -> Indices:
        """Return the positions of the owner's slots of all robots of `node`, in layout order."""
        indices = self._owner.get(node)
        if indices is None:
            robots = [entity for entity in self.layout.robots if self.owners.get(entity.name) == node]
            runs = [np.arange(entity.split, entity.stop) for entity in robots]
            indices = self._owner[node] = np.concatenate([np.arange(0), *runs])
        return indices


class Barrier:
    """The parts of the tick that ends in frame `tick`, from a roster, until all are there."""

    def __init__(self, tick: int, roster: Sequence[str], slots: Slots) -> None:
        self.tick = tick
        self.slots = slots
        self.roster = tuple(roster)
        self.parts: dict[str, Part] = {}

    @property
    def missing(self) -> list[str]:
        """Nodes whose part has not come, in name order."""
        return [node for node in self.roster if node not in self.parts]

    def add(self, part: Part) -> None:
        """Take one node's part, or raise `Malformed` when it does not fit the layout. A repeat is ignored."""
        assert part.tick == self.tick
        if part.node not in self.roster:
            raise Malformed(f"a part of {part.node}, the roster is {', '.join(self.roster)}")
        if part.node in self.parts:
            return
        solved = tuple(part.solved)
        entities = self.slots.layout.entities
        if list(solved) != sorted(set(solved)) or (solved and solved[-1] >= len(entities)):
            raise Malformed(f"part of {part.node}: solved entities {list(solved)[:20]} not ascending or not in the layout")
        expected = 8 * len(self.slots.solver(solved)), 8 * len(self.slots.owner(part.node))
        if (len(part.solver_values), len(part.owner_values)) != expected:
            raise Malformed(
                f"part of {part.node}: {len(part.solver_values)} and {len(part.owner_values)} bytes of values, "
                f"{expected[0]} and {expected[1]} expected"
            )
        if any(outbox.index not in solved for outbox in part.outboxes):
            raise Malformed(f"part of {part.node}: an outbox of an entity that it did not solve")
        self.parts[part.node] = part

    def solver_of(self, index: int) -> str:
        """Return the node whose part holds the entity, or an empty string."""
        return next((node for node, part in self.parts.items() if index in part.solved), "")

    def assemble(self) -> Frame:
        """Return the frame of all parts; raise `Malformed` when a slot is missing, doubled or not finite."""
        assert not self.missing
        layout = self.slots.layout
        solved = [index for part in self.parts.values() for index in part.solved]
        if len(solved) != len(layout.entities) or len(set(solved)) != len(solved):
            raise Malformed(f"tick {self.tick}: {self._claims()}")
        values = np.empty(layout.size)
        outboxes: dict[int, bytes] = {}
        for node in self.roster:
            part = self.parts[node]
            values[self.slots.solver(tuple(part.solved))] = np.frombuffer(part.solver_values)
            values[self.slots.owner(node)] = np.frombuffer(part.owner_values)
            for outbox in part.outboxes:
                outboxes[outbox.index] = outbox.packets
        if not np.isfinite(values).all():
            raise Malformed(f"tick {self.tick}: numbers that are not finite")
        return Frame(self.tick, layout, values, outboxes)

    def _claims(self) -> str:
        claims = {
            entity.name: [node for node, part in self.parts.items() if entity.index in part.solved]
            for entity in self.slots.layout.entities
        }
        return "; ".join(f"{name} solved by {nodes or 'nobody'}" for name, nodes in claims.items() if len(nodes) != 1)
