"""The frame: the complete state of the world at a tick boundary, and its digest.

A frame is float64 numbers in the layout's order and the bounded outboxes of its robots. All state of the world
is in it. Frames are values: a change returns another one.
"""

from __future__ import annotations

import struct
import sys
from collections.abc import Mapping, Sequence
from hashlib import blake2b
from typing import Final

import numpy as np
from numpy.typing import NDArray

from foosim.common.errors import Malformed
from foosim.world.layout import Entity, Layout
from foosim.world.robot_packets import Outbox

assert sys.byteorder == "little", "numbers travel as raw little-endian float64"

CHAIN_START: Final = bytes(32)
_TICK = struct.Struct("<Q")
_OUTBOX = struct.Struct("<QI")


class Frame:
    """The world at the start of tick `tick`: `values` (float64, shape (layout.size,)) and outboxes by entity index."""

    def __init__(
        self,
        tick: int,
        layout: Layout,
        values: NDArray[np.float64] | None,
        outboxes: Mapping[int, bytes] | None = None,
        *,
        numbers: list[float] | None = None,
    ) -> None:
        """Without `values`, the frame owns these `numbers`. Either is built from the other at its first use."""
        self.tick = tick
        self.layout = layout
        self._values: NDArray[np.float64] | None = None
        self._numbers: list[float] | None = None
        self.outboxes: dict[int, bytes] = dict(sorted(outboxes.items())) if outboxes else {}
        self._digest = b""
        if values is None:
            assert numbers is not None and len(numbers) == layout.size, layout.size
            self._numbers = numbers
        else:
            assert numbers is None
            assert values.shape == (layout.size,), (values.shape, layout.size)
            assert values.dtype == np.float64 and values.flags.c_contiguous
            self.take(values)

    def take(self, values: NDArray[np.float64]) -> None:
        """Replace the values in place: the effect of a fault in a process's memory, for tests."""
        values.setflags(write=False)  # components get it
        self._values, self._numbers, self._digest = values, None, b""

    @property
    def values(self) -> NDArray[np.float64]:
        """The values as a read-only array."""
        if self._values is None:
            self._values = np.array(self._numbers)
            self._values.setflags(write=False)
        return self._values

    @property
    def numbers(self) -> list[float]:
        """The values as Python floats; the caller copies the list before an edit."""
        if self._numbers is None:
            self._numbers = self.values.tolist()
        return self._numbers

    @property
    def digest(self) -> bytes:
        """D(tick): BLAKE2b, 32 bytes, of tick, layout and the bytes as they are."""
        if not self._digest:
            hasher = blake2b(_TICK.pack(self.tick), digest_size=32)
            hasher.update(self.layout.digest)
            hasher.update(self.values.data)
            for index, packets in self.outboxes.items():
                hasher.update(_OUTBOX.pack(index, len(packets)) + packets)
            self._digest = hasher.digest()
        return self._digest

    def at(self, entity: str, field: str, offset: int = 0) -> float:
        """Return one number, by names."""
        return self.numbers[self.layout[entity].offsets[field] + offset]

    def vector(self, entity: str, field: str, count: int) -> list[float]:
        """Return `count` numbers of one field."""
        start = self.layout[entity].offsets[field]
        return self.numbers[start : start + count]

    def entity_digest(self, entity: Entity) -> bytes:
        """Return a digest of 8 bytes of one entity's slots and outbox: it shows which entity differs."""
        hasher = blake2b(self.values[entity.start : entity.stop].data, digest_size=8)
        hasher.update(self.outboxes.get(entity.index, b""))
        return hasher.digest()

    @property
    def outbox_items(self) -> list[Outbox]:
        return [Outbox(index, packets) for index, packets in self.outboxes.items()]


def frame_from_bytes(tick: int, layout: Layout, values: bytes, outboxes: Sequence[Outbox]) -> Frame:
    """Return the frame that a message carries, or raise `Malformed` when its size is not the layout's."""
    if len(values) != 8 * layout.size:
        raise Malformed(f"{len(values)} bytes of values, the layout has {8 * layout.size}")
    indices = [outbox.index for outbox in outboxes]
    if indices != sorted(set(indices)) or (indices and indices[-1] >= len(layout.entities)):
        raise Malformed(f"outboxes of entities {indices}: not ascending or not in the layout")
    return Frame(tick, layout, np.frombuffer(values), {outbox.index: outbox.packets for outbox in outboxes})


def chain_next(chain: bytes, digest: bytes) -> bytes:
    """Return the chain over one more frame: BLAKE2b(chain + frame digest)."""
    return blake2b(chain + digest, digest_size=32).digest()
