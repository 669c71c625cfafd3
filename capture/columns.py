"""The content of a capture as numpy arrays: packets, frames, poses. Plain data, made by `capture.reader`."""

from __future__ import annotations

import re
from array import array
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from sys import intern
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from foosim.capture.mcap.checks import CaptureError
from foosim.capture.rows import FrameRow, PacketRow
from foosim.common.names import nearest_name
from foosim.world.frame import Frame
from foosim.world.kinematics import forward_kinematics
from foosim.world.layout import Layout
from foosim.world.scene import Body

Integers: TypeAlias = NDArray[np.int64]
Numbers: TypeAlias = NDArray[np.float64]
Objects: TypeAlias = NDArray[np.object_]


@dataclass(frozen=True, slots=True)
class Packets:
    """All packets of a capture as columns, in the order of the closings that made their fates final, then of sending.

    Texts and payloads are object arrays (`packets.source == "camera"` gives a mask), the rest int64. `due_ns` and
    `arrival_tick` are -1 for what was dropped at sending; a word is the 64-bit draw that was used, or None.
    """

    source: Objects
    sequence: Integers
    copy: Integers
    destination: Objects
    channel: Objects
    sent_ns: Integers
    stamp_ns: Integers
    due_ns: Integers
    arrival_tick: Integers
    fate: Objects
    cause: Objects
    rule: Objects
    loss_word: Objects
    jitter_word: Objects
    size: Integers
    payload: Objects
    wall_released_ns: Integers

    def __len__(self) -> int:
        return len(self.sequence)

    def where(self, mask: NDArray[np.bool_]) -> Packets:
        """Return the packets for which the mask is true."""
        return Packets(*(getattr(self, field.name)[mask] for field in fields(self)))


_WORD: Final = re.compile("[0-9a-f]{16}")


def word_of(text: str) -> int | None:
    """Return the draw of a row, which is in hex; None without one."""
    if not text:
        return None
    if not _WORD.fullmatch(text):
        raise CaptureError(f"a draw of {text!r}, it has 16 hex digits")
    return int(text, 16)


_WORDS: Final = frozenset({"loss_word", "jitter_word"})
_TEXTS: Final = frozenset({"source", "destination", "channel", "fate", "cause", "rule"})


def packet_columns(rows: Iterable[PacketRow]) -> Packets:
    """Return rows as columns; equal texts are stored once."""
    integers: dict[str, array[int]] = {}
    objects: dict[str, list[Any]] = {}
    for field in fields(Packets):
        if field.type == "Integers":
            integers[field.name] = array("q")
        else:
            objects[field.name] = []
    for row in rows:
        for name, numbers in integers.items():
            numbers.append(getattr(row, name))
        for name, values in objects.items():
            value = getattr(row, name)
            if name in _TEXTS:
                value = intern(value)
            elif name in _WORDS:
                value = word_of(value)
            values.append(value)
    columns: list[Any] = [
        np.frombuffer(integers[field.name], dtype=np.int64) if field.name in integers else _objects(objects[field.name])
        for field in fields(Packets)
    ]
    return Packets(*columns)


def _objects(values: Sequence[Any]) -> Objects:
    column = np.empty(len(values), dtype=np.object_)
    column[:] = values
    return column


@dataclass(frozen=True, slots=True)
class Frames:
    """Captured frames of one layout: `ticks` (n,) and `values` (n, layout.size), outboxes by entity index."""

    layout: Layout
    ticks: Integers
    values: Numbers
    outboxes: tuple[Mapping[int, bytes], ...]

    def __len__(self) -> int:
        return len(self.ticks)

    def frame(self, index: int) -> Frame:
        """Return one of them as a frame, from which a world can be continued."""
        return Frame(int(self.ticks[index]), self.layout, np.array(self.values[index]), self.outboxes[index])

    def column(self, entity: str, field: str, count: int = 1) -> Numbers:
        """Return one field of an entity over time: (n,), or (n, count) for a field of several numbers."""
        start = self.layout[entity].offsets[field]
        return self.values[:, start] if count == 1 else self.values[:, start : start + count]


@dataclass(frozen=True, slots=True)
class AllFrames:
    """All captured frames of a run, in their order, `blocks` of one layout each."""

    name: str
    """That of the capture."""
    blocks: tuple[Frames, ...]

    def __len__(self) -> int:
        return sum(map(len, self.blocks))

    @property
    def ticks(self) -> Integers:
        """Their ticks, (n,)."""
        return np.concatenate([np.empty(0, dtype=np.int64), *(block.ticks for block in self.blocks)])

    @property
    def layout(self) -> Layout:
        """The one layout of a run to which nothing was added; else raises CaptureError."""
        return self._one_block().layout

    @property
    def values(self) -> Numbers:
        """All numbers of the frames, (n, layout.size), of a run to which nothing was added; else CaptureError."""
        return self._one_block().values

    def frame(self, index: int) -> Frame:
        """Return one of them as a frame, from which a world can be continued; raises IndexError."""
        left = index + len(self) if index < 0 else index
        for block in self.blocks:
            if 0 <= left < len(block):
                return block.frame(left)
            left -= len(block)
        raise IndexError(f"frame {index} of {len(self)}")

    def column(self, entity: str, field: str, count: int = 1) -> Numbers:
        """Return one field of an entity over time: (n,), or (n, count) for a field of several numbers.

        Where the entity was not there the numbers are NaN. Raises CaptureError for an entity or a field that no frame
        has.
        """
        known = [block.layout[entity].offsets if entity in block.layout else {} for block in self.blocks]
        if not any(field in offsets for offsets in known):
            raise self._unknown(entity, field)
        shape = () if count == 1 else (count,)
        return np.concatenate(
            [
                block.column(entity, field, count) if field in offsets else np.full((len(block), *shape), np.nan)
                for block, offsets in zip(self.blocks, known, strict=True)
            ]
        )

    def _one_block(self) -> Frames:
        if len(self.blocks) != 1:
            ticks = ", ".join(str(block.ticks[0]) for block in self.blocks if len(block))
            raise CaptureError(f"{self.name}: frames of {len(self.blocks)} layouts (from {ticks}): frame_blocks")
        return self.blocks[0]

    def _unknown(self, entity: str, field: str) -> CaptureError:
        names = {known.name: known.offsets for block in self.blocks for known in block.layout.entities}
        what, of = (field, sorted(names[entity])) if entity in names else (entity, sorted(names))
        nearest = nearest_name(what, of)
        hint = f", nearest is {nearest}" if nearest else ""
        if entity in names:
            return CaptureError(f"{self.name}: {entity} has no field {field!r}{hint}; it has {', '.join(of)}")
        return CaptureError(f"{self.name}: no frame has an entity {entity!r}{hint}")


def frames_of(layout: Layout, rows: Sequence[FrameRow]) -> Frames:
    """Return the rows of one layout's frames as arrays; their sizes are the layout's."""
    ticks = np.array([row.tick for row in rows], dtype=np.int64)
    values = np.frombuffer(b"".join(row.values for row in rows), dtype=np.float64).reshape(len(rows), layout.size)
    outboxes = tuple({box.index: box.packets for box in row.outboxes} for row in rows)
    return Frames(layout, ticks, values, outboxes)


@dataclass(frozen=True, slots=True)
class Poses:
    """The pose of one link over time, in the world frame: metres, quaternions x, y, z, w."""

    ticks: Integers
    positions: Numbers
    orientations: Numbers


def poses_of(blocks: Iterable[tuple[Frames, Body]], link: str) -> Poses:
    """Return a link's poses over frames of one or more layouts, by the one forward kinematics."""
    ticks: list[int] = []
    poses: list[tuple[float, ...]] = []
    for frames, body in blocks:
        entity = frames.layout[body.name]
        ticks += frames.ticks.tolist()
        for values in frames.values:
            placed = {name: (*at, *turn) for name, at, turn in forward_kinematics(body, entity, values.tolist())}
            poses.append(placed[link])
    table = np.array(poses, dtype=np.float64).reshape(len(ticks), 7)
    return Poses(np.array(ticks, dtype=np.int64), table[:, :3], table[:, 3:])
