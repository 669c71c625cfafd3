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
from foosim.world.component_types.descriptions import ABSENT, JOINTS
from foosim.world.components.mounted import free_poses
from foosim.world.frame import Frame
from foosim.world.kinematics import CENTRE_OF_SLOT, forward_kinematics
from foosim.world.layout import Layout
from foosim.world.scene import Body, Link, conjugate

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


SLOT_OF_CENTRE: Final = {name: slot for slot, name in CENTRE_OF_SLOT.items()}


@dataclass(frozen=True, slots=True)
class Frames:
    """The captured frames of a run: `ticks` (n,) and `values` (n, layout.size), outboxes by entity index.

    `values` are slots: of a free body the `position`, `orientation` and `linear_velocity` of its centre of mass.
    """

    name: str
    """That of the capture."""
    layout: Layout
    bodies: Mapping[str, Body]
    ticks: Integers
    values: Numbers
    outboxes: tuple[Mapping[int, bytes], ...]

    def __len__(self) -> int:
        return len(self.ticks)

    def frame(self, index: int) -> Frame:
        """Return one of them as a frame, from which a world can be continued; raises IndexError."""
        return Frame(int(self.ticks[index]), self.layout, np.array(self.values[index]), self.outboxes[index])

    def column(self, entity: str, field: str, count: int | None = None, *, joint: str = "") -> Numbers:
        """Return one field of an entity over time: (n,) for one number, (n, count) for several: all numbers of the
        field, or its first ones. Of a field with a number for each joint, as `joint_positions`, `joint` selects the one
        of a joint, (n,).

        Of a free body `position`, `orientation` and `linear_velocity` are of the origin of its first link, as on
        /tf and in its sensors' readings; `CENTRE_OF_SLOT` is of the link's centre of mass. The numbers are NaN
        where the entity is absent. Raises CaptureError for an unknown entity, field or joint, and for more numbers than
        the field has.
        """
        if field not in self.fields(entity):
            raise self._unknown(entity, field)
        found = self._field(entity, field)
        if field != ABSENT and self.layout[entity].can_leave:
            is_absent = self._slot(entity, ABSENT)[:, 0] != 0.0
            found = np.where(is_absent[:, np.newaxis], np.nan, found)
        if joint:
            return found[:, self._joint(entity, field, joint)]
        if count is None:
            count = found.shape[1]
        if not 1 <= count <= found.shape[1]:
            raise CaptureError(f"{entity}: {field} has 1 to {found.shape[1]} numbers, not {count}")
        return found[:, 0] if count == 1 else found[:, :count]

    def _joint(self, entity: str, field: str, joint: str) -> int:
        """Return the place of a joint's number in a field with a number for each."""
        names = self.bodies[entity].joint_names if field in JOINTS and entity in self.bodies else ()
        if joint not in names:
            nearest = nearest_name(joint, names)
            hint = f", nearest is {nearest}" if nearest else ""
            there = f"; it has {', '.join(names)}" if names else ""
            raise CaptureError(f"{self.name}: {field} of {entity} has no joint {joint!r}{hint}{there}")
        return names.index(joint)

    def fields(self, entity: str) -> list[str]:
        """Return the names of an entity's columns, none for an unknown entity."""
        if entity not in self.layout:
            return []
        slots = self.layout[entity].offsets
        of_centre = CENTRE_OF_SLOT.items() if self._free_link(entity) else ()
        return [*slots, *(name for slot, name in of_centre if slot in slots)]

    def _field(self, entity: str, field: str) -> Numbers:
        """Return all numbers of a field over time, (n, count)."""
        link = self._free_link(entity)
        if link is None:
            return self._slot(entity, field)
        if field in SLOT_OF_CENTRE:
            return self._slot(entity, SLOT_OF_CENTRE[field])
        if link.is_centred or field not in CENTRE_OF_SLOT:
            return self._slot(entity, field)
        state = np.hstack((self._slot(entity, "position"), self._slot(entity, "orientation"))).T
        back, centre = np.array(conjugate(link.principal)), np.array(link.centre_of_mass)
        origins, turned = free_poses(state, back[:, np.newaxis], centre[:, np.newaxis])
        if field != "linear_velocity":
            return origins.T if field == "position" else turned.T
        linear = self._slot(entity, "linear_velocity")
        if "angular_velocity" not in self.layout[entity].offsets:
            return linear
        arms = origins - state[:3]
        return linear + np.cross(self._slot(entity, "angular_velocity"), arms.T)

    def _slot(self, entity: str, slot: str) -> Numbers:
        at = self.layout[entity]
        start = at.offsets[slot]
        return self.values[:, start : start + at.counts[slot]]

    def _unknown(self, entity: str, field: str) -> CaptureError:
        names = {known.name: self.fields(known.name) for known in self.layout.entities}
        what, of = (field, sorted(names[entity])) if entity in names else (entity, sorted(names))
        nearest = nearest_name(what, of)
        hint = f", nearest is {nearest}" if nearest else ""
        if entity in names:
            return CaptureError(f"{self.name}: {entity} has no field {field!r}{hint}; it has {', '.join(of)}")
        return CaptureError(f"{self.name}: no frame has an entity {entity!r}{hint}")

    def _free_link(self, entity: str) -> Link | None:
        """Return the link of an entity that moves freely, which is its first one."""
        body = self.bodies.get(entity)
        return body.links[0] if body is not None and body.is_free else None


def frame_of(layout: Layout, row: FrameRow) -> Frame:
    """Return the row of a frame, whose size is the layout's, as a frame."""
    return Frame(row.tick, layout, np.frombuffer(row.values), {box.index: box.packets for box in row.outboxes})


def frames_of(name: str, layout: Layout, bodies: Mapping[str, Body], rows: Sequence[FrameRow]) -> Frames:
    """Return the rows of frames of a layout, which has these bodies, as arrays; their sizes are the layout's."""
    ticks = np.array([row.tick for row in rows], dtype=np.int64)
    values = np.frombuffer(b"".join(row.values for row in rows), dtype=np.float64).reshape(len(rows), layout.size)
    outboxes = tuple({box.index: box.packets for box in row.outboxes} for row in rows)
    return Frames(name, layout, bodies, ticks, values, outboxes)


@dataclass(frozen=True, slots=True)
class Poses:
    """The pose of one link over time, in the world frame: metres, quaternions x, y, z, w."""

    ticks: Integers
    positions: Numbers
    orientations: Numbers


def poses_of(frames: Frames, body: Body, link: str) -> Poses:
    """Return a link's poses over the frames in which it is present, by the one forward kinematics."""
    ticks: list[int] = []
    poses: list[tuple[float, ...]] = []
    entity = frames.layout[body.name]
    for tick, values in zip(frames.ticks.tolist(), frames.values, strict=True):
        numbers = values.tolist()
        if not entity.is_absent(numbers):
            ticks.append(tick)
            placed = {name: (*at, *turn) for name, at, turn in forward_kinematics(body, entity, numbers)}
            poses.append(placed[link])
    table = np.array(poses, dtype=np.float64).reshape(len(ticks), 7)
    return Poses(np.array(ticks, dtype=np.int64), table[:, :3], table[:, 3:])
