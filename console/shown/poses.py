"""Frames as what a page draws: the pose of each link as packed float32, and the numbers that a page plots behind them.

The poses are those of `protocol.scene.forward_kinematics`. A link that stands on the world by nothing but fixed
joints, or by one free joint, needs no arithmetic: its pose is constant, or seven numbers of the frame, which are taken
for all such links at once. Of what is absent there are neither poses nor numbers: they are not a number.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from foosim.console.shown.source import Moment
from foosim.world.forms.forms import ABSENT
from foosim.world.kinematics import forward_kinematics
from foosim.world.layout import Entity, Layout
from foosim.world.scene import Body, Scene

POSES_KIND: Final = 1
HEAD: Final = struct.Struct("<BBBBIdII")
"""Kind, source, flags, 0, generation, tick, count of links, count of values: 24 bytes."""
JUMP: Final = 1
PAUSED: Final = 2


class Poser:
    """Turns the numbers of frames into poses."""

    def __init__(self, layout: Layout, scene: Scene) -> None:
        count = sum(len(body.links) for body in scene.bodies.values())
        self._rest: NDArray[np.float32] = np.zeros((count, 7), np.float32)
        """The poses of what never moves; the others' rows are overwritten."""
        self._jointed: list[tuple[int, Body, Entity]] = []
        leaving = [entity for entity in layout.entities if entity.can_leave]
        self._flags = np.array([entity.offsets[ABSENT] for entity in leaving], np.intp)
        """The slots that say who is absent."""
        self._numbers = [slice(entity.start, entity.stop) for entity in leaving]
        places: dict[str, slice] = {}
        rows, slots = [], []
        row = 0
        for name, body in scene.bodies.items():
            entity, joints = layout[name], [link.joint for link in body.links]
            if joints == ["free"] and body.links[0].is_centred:
                position, orientation = entity.offsets["position"], entity.offsets["orientation"]
                rows.append(row)
                slots.append([*range(position, position + 3), *range(orientation, orientation + 4)])
            elif set(joints) == {"fixed"}:
                self._rest[row : row + len(joints)] = _rows(body, entity, ())
            else:
                self._jointed.append((row, body, entity))
            places[name] = slice(row, row + len(joints))
            row += len(joints)
        self._links = [places.get(entity.name, slice(0)) for entity in leaving]
        self._rows = np.array(rows, np.intp)
        self._slots = np.array(slots, np.intp).reshape(-1, 7)

    def poses(self, values: NDArray[np.float64]) -> NDArray[np.float32]:
        """Return the pose of each link, shape (links, 7), from a frame's numbers, shape (size,)."""
        poses = self._rest.copy()
        poses[self._rows] = values[self._slots]
        if self._jointed:
            numbers: list[float] = values.tolist()
            for row, body, entity in self._jointed:
                poses[row : row + len(body.links)] = _rows(body, entity, numbers)
        for number in self._absent(values):
            poses[self._links[number]] = np.nan
        return poses

    def numbers(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the numbers of a frame that are shown."""
        absent = self._absent(values)
        if not absent:
            return values
        shown = values.copy()
        for number in absent:
            shown[self._numbers[number]] = np.nan
        shown[self._flags] = values[self._flags]
        return shown

    def _absent(self, values: NDArray[np.float64]) -> list[int]:
        """Return who is absent, by the place among those who can be."""
        found: list[int] = np.flatnonzero(values[self._flags]).tolist()
        return found


def _rows(body: Body, entity: Entity, numbers: Sequence[float]) -> list[tuple[float, ...]]:
    return [(*position, *turned) for _, position, turned in forward_kinematics(body, entity, numbers)]


def packed(source: int, generation: int, moment: Moment, fields: tuple[int, ...] = ()) -> bytes:
    """Return a moment as the binary message for a page that plots these numbers of the frame."""
    flags = (JUMP if moment.jump else 0) | (PAUSED if moment.paused else 0)
    head = HEAD.pack(POSES_KIND, source, flags, 0, generation, moment.tick, len(moment.poses), len(fields))
    values = moment.values[list(fields)].astype("<f4").tobytes() if fields else b""
    return head + moment.poses.astype("<f4", copy=False).tobytes() + values
