"""Collecting the parts of one tick into the next frame: the node's last step and the supervisor's commit.

A part is accepted if its epoch, sender and input digest match. The parts together must hold each slot exactly once. Two
parts that claim one slot are a bug on the sender's side: both are named, and neither is merged.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Mapping, Sequence
from hashlib import blake2b
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from foosim.common import limits
from foosim.common.errors import Malformed
from foosim.protocol.codec import decode_any, encode
from foosim.protocol.messages import Commit, Part
from foosim.world.edits import Edit
from foosim.world.frame import Frame, frame_from_bytes
from foosim.world.layout import Layout
from foosim.world.robot_packets import OutboxPacket

Indices: TypeAlias = NDArray[np.intp]
_OUTBOX: Final[Any] = list[OutboxPacket]
_TICK = struct.Struct("<Q")
_NO_EDITS: Final = encode([])


def edits_content(edits: Sequence[Edit]) -> bytes:
    """Return the content of an order without its epoch."""
    return encode(list(edits)) if edits else _NO_EDITS


def input_digest_of(digest: bytes, edits: Sequence[Edit], deliveries: bytes) -> bytes:
    """Return the BLAKE2b of the inputs of tick k: D(k), the content of order k, the deliveries' bytes."""
    hasher = blake2b(digest, digest_size=32)
    content = edits_content(edits)
    hasher.update(_TICK.pack(len(content)) + content)
    hasher.update(deliveries)
    return hasher.digest()


def committed_frame(commit: Commit, layout: Layout) -> Frame:
    """Return the frame of a commit. Raises Malformed where it does not fit the layout or the commit's digest."""
    frame = frame_from_bytes(commit.tick, layout, commit.values, commit.outboxes)
    if frame.digest != commit.digest:
        raise Malformed(f"commit {commit.tick} has another digest than its frame")
    return frame


class BadParts(Malformed):
    """Parts that do not fit together into one frame; `nodes` sent them."""

    def __init__(self, what: str, nodes: Sequence[str]) -> None:
        super().__init__(what)
        self.nodes = tuple(nodes)


class Slots:
    """Which numbers of a layout a solver or an owner writes, as index arrays made once per combination."""

    def __init__(self, layout: Layout, owners: Mapping[str, str]) -> None:
        self.layout = layout
        self.owners = dict(owners)
        self._solver: dict[tuple[int, ...], Indices] = {}
        self._owner: dict[str, Indices] = {}
        self._whole: dict[tuple[tuple[str, tuple[int, ...]], ...], Indices] = {}

    def solver(self, solved: tuple[int, ...]) -> Indices:
        """Return the positions of the solver's slots of these entities; `Malformed` if they are not of the layout."""
        indices = self._solver.get(solved)
        if indices is None:
            entities = self.layout.entities
            if list(solved) != sorted(set(solved)) or (solved and solved[-1] >= len(entities)):
                raise Malformed(f"solved entities {list(solved)[:20]} are not ascending or not in the layout")
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

    def whole(self, shares: tuple[tuple[str, tuple[int, ...]], ...]) -> Indices:
        """Return the positions of all numbers of these nodes' parts, solver's before owner's for each node.

        Raises `BadParts` unless the nodes solved each entity of the layout once; if one is unsolved, all are named.
        """
        indices = self._whole.get(shares)
        if indices is None:
            claims: dict[int, list[str]] = {entity.index: [] for entity in self.layout.entities}
            for node, solved in shares:
                for index in solved:
                    claims[index].append(node)
            wrong = {self.layout.entities[i].name: nodes for i, nodes in claims.items() if len(nodes) != 1}
            if wrong:
                text = "; ".join(
                    f"{name} solved by {' and '.join(nodes) or 'no node'}" for name, nodes in wrong.items()
                )
                unclaimed = any(not nodes for nodes in wrong.values())
                blamed = {node for nodes in wrong.values() for node in nodes}
                raise BadParts(text, [node for node, _ in shares if unclaimed or node in blamed])
            runs = [array for node, solved in shares for array in (self.solver(solved), self.owner(node))]
            indices = self._whole[shares] = np.concatenate(runs)
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
        """Nodes whose part is missing, in name order."""
        return [node for node in self.roster if node not in self.parts]

    def add(self, part: Part) -> None:
        """Add one node's part, or raise `BadParts` when it does not fit the layout. A duplicate is ignored."""
        assert part.tick == self.tick
        if part.node in self.parts:
            return
        try:
            self._check(part)
        except Malformed as error:
            raise BadParts(f"part {part.tick} of {part.node}: {error}", [part.node]) from None
        self.parts[part.node] = part

    def add_all(self, parts: Iterable[Part]) -> None:
        """Add parts of several nodes, or raise one `BadParts` for all that do not fit."""
        bad: list[BadParts] = []
        for part in parts:
            try:
                self.add(part)
            except BadParts as error:
                bad.append(error)
        if bad:
            raise BadParts("; ".join(map(str, bad)), [node for error in bad for node in error.nodes])

    def _check(self, part: Part) -> None:
        if part.node not in self.roster:
            raise Malformed(f"the roster is {', '.join(self.roster)}")
        expected = 8 * len(self.slots.solver(tuple(part.solved))), 8 * len(self.slots.owner(part.node))
        given = len(part.solver_values), len(part.owner_values)
        if given != expected:
            raise Malformed(f"{given[0]} and {given[1]} bytes of values, {expected[0]} and {expected[1]} expected")
        if part.outboxes:
            self._check_outboxes(part)

    def drop(self, nodes: Iterable[str]) -> None:
        """Remove the parts of these nodes: they are missing again."""
        for node in nodes:
            self.parts.pop(node, None)

    def _check_outboxes(self, part: Part) -> None:
        """Raise unless the outboxes can be decoded, because readers of the next frame do not check them."""
        entities = self.slots.layout.entities
        indices = [outbox.index for outbox in part.outboxes]
        if indices != sorted(set(indices)) or not set(indices) <= set(part.solved):
            raise Malformed(f"outboxes of entities {indices}: not ascending or not solved by it")
        for outbox in part.outboxes:
            packets = decode_any(_OUTBOX, outbox.packets)
            if not entities[outbox.index].is_robot or len(packets) > limits.OUTBOX_PACKETS_MAX:
                raise Malformed(f"{len(packets)} packets in the outbox of {entities[outbox.index].name}")

    def solver_of(self, index: int) -> str:
        """Return the node whose part holds the entity, or an empty string."""
        return next((node for node, part in self.parts.items() if index in part.solved), "")

    def assemble(self) -> Frame:
        """Return the frame of all parts; raise `BadParts` when a slot is missing, doubled or not finite."""
        assert not self.missing
        parts = [self.parts[node] for node in self.roster]
        layout = self.slots.layout
        try:
            indices = self.slots.whole(tuple((part.node, tuple(part.solved)) for part in parts))
        except BadParts as bad:
            raise BadParts(f"tick {self.tick}: {bad}", bad.nodes) from None
        values = np.empty(layout.size)
        values[indices] = np.frombuffer(
            b"".join([raw for part in parts for raw in (part.solver_values, part.owner_values)])
        )
        if not np.isfinite(values).all():
            nodes = [part.node for part in parts if not _is_finite(part)]
            raise BadParts(f"tick {self.tick}: non-finite numbers of {', '.join(nodes)}", nodes)
        return Frame(self.tick, layout, values, {o.index: o.packets for part in parts for o in part.outboxes})


def _is_finite(part: Part) -> bool:
    return bool(np.isfinite(np.frombuffer(part.solver_values + part.owner_values)).all())
