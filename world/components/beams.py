"""Beams of sensors: rays fixed to a mount on a robot, which pass its own body; those of many are cast at once."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from typing import Any, ClassVar, TypeAlias

import numpy as np

from foosim.common.errors import BadValue
from foosim.world.components.base import Sensor
from foosim.world.components.mounted import Mounted, MountedTogether
from foosim.world.components.rows import Rows
from foosim.world.components.surroundings import Surroundings
from foosim.world.components.view import Mounting, SensingView, View
from foosim.world.placing import FIRST_LINK, MountedAt
from foosim.world.rays.boxes import Floats
from foosim.world.rays.shapes import rotated_each
from foosim.world.rays.solids import Meshes, solid_of
from foosim.world.scene import Link, Vector, shape_box

Directions: TypeAlias = Sequence[Vector]


class Beams:
    """The beams of one sensor. What it keeps follows from deployment and layout."""

    def __init__(self, at: Mounting, where: MountedAt, directions: Directions, range_m: float) -> None:
        """`directions` are unit vectors in the mount's frame. Raises BadValue without a body, or without the link."""
        self.around, self.entity, self.mount = Surroundings(at.spec, at.layout), at.robot, Mounted(at, where)
        self.directions, self.range_m = np.array(directions).reshape(-1, 3), range_m


class BeamsTogether(Rows):
    """The beams of several sensors, which all have as many."""

    def __init__(self, several: Sequence[Beams]) -> None:
        self._around, self._mounts = several[0].around, MountedTogether([one.mount for one in several])
        self.count = len(several[0].directions)
        self._directions = np.array([one.directions for one in several])
        self._ranges = np.array([one.range_m for one in several])
        self._passed = np.array([one.entity.index for one in several], np.int64)

    def distances(self, view: View) -> Floats:
        """Return the distances from mounts to the first hits of their beams at a tick's start (m): (sensors, beams).

        It is inf where nothing is within a sensor's range.
        """
        values = view.values if isinstance(view, SensingView) else None
        placement = self._around.placement(view)
        return placement.fans(*self.lines(view.start, values), self._ranges, self._passed)

    def ends(self, numbers: Sequence[float], nearest: Floats, farthest: Floats) -> Floats:
        """Return both ends (m) of each beam in a frame, to be drawn, of shape (beams of all, 6).

        They are where it is `nearest` from the mount, and where it meets something or is `farthest`: (beams,).
        """
        origins, ways = self.lines(numbers)
        placement = self._around.caster.at(numbers)
        ranges = np.clip(placement.fans(origins, ways, self._ranges, self._passed), nearest, farthest)
        first, last = (origins[:, :, None] + ways * way for way in (nearest, ranges))
        return np.concatenate((first, last)).reshape(6, -1).T

    def lines(self, numbers: Sequence[float], values: Floats | None = None) -> tuple[Floats, Floats]:
        """Return where mounts are (3, sensors) and the ways of beams (3, sensors, beams), in the world frame."""
        places, turns = self._mounts.poses(numbers, values)
        return places, rotated_each(turns, self._directions)


class BeamSensor(Sensor):
    """A sensor of the distances along beams, each from where the beam leaves the robot: of its mount, or its hull."""

    field: ClassVar[str] = "distances"
    """That of its reading."""
    beams: Beams
    hull_m: Sequence[float] = ()
    """Where a distance begins on each beam; empty: at the mount."""
    least_m: float = 0.0
    range_m: float

    def reading(self, distances: list[float]) -> Any:
        """Return the reading with these distances."""
        return None

    def limits(self) -> dict[str, tuple[float, float]]:
        """Return the least and the greatest distance (m); where nothing is met it is the greatest."""
        return {self.field: (min(self.least_m, self.range_m), self.range_m)}

    def sample(self, view: View) -> Any:
        return self.reading(self.together([self]).sample(view)[0].tolist())

    @staticmethod
    def together(sensors: Sequence[Any]) -> Any:
        """Return these as one; all have as many beams."""
        return Distances(sensors)

    @staticmethod
    def rays(sensors: Sequence[BeamSensor], numbers: Sequence[float]) -> Floats:
        """Return both ends of each beam: where its distance begins, and the first thing or the sensor's range."""
        found = []
        for one in sensors:
            hull = np.array(one.hull_m or [0.0])
            found.append(BeamsTogether([one.beams]).ends(numbers, hull, hull + one.range_m))
        return np.concatenate(found)


class Distances(Rows):
    """Several sensors, with as many beams."""

    def __init__(self, sensors: Sequence[BeamSensor]) -> None:
        self._beams = BeamsTogether([one.beams for one in sensors])
        self._hulls = np.array([one.hull_m for one in sensors]) if sensors[0].hull_m else None
        self._least = np.array([[one.least_m] for one in sensors])
        self._ranges = np.array([[one.range_m] for one in sensors])

    def sample(self, view: View) -> Floats:
        """Return the distances (m), of shape (sensors, beams)."""
        found = self._beams.distances(view)
        if self._hulls is not None:
            found = found - self._hulls
        return np.asarray(np.minimum(np.maximum(found, self._least), self._ranges))


def hull_middle(link: Link) -> Vector:
    """Return the middle of a link's hull, which is its first shape, in its frame. Raises BadValue where it has none."""
    if not link.shapes:
        raise BadValue("its rays begin at the hull of a link without shapes", link.name)
    (lx, ly, lz), (hx, hy, hz) = shape_box(link.shapes[0])
    return lx + (hx - lx) / 2, ly + (hy - ly) / 2, lz + (hz - lz) / 2


def way_out(link: Link, start: Vector, direction: Vector) -> float:
    """Return how far from its start a ray, in the link's frame, leaves the last of the link's shapes (m)."""
    meshes = Meshes()
    pieces = [piece for shape in link.shapes for piece in solid_of(shape, 0, meshes).pieces((start, direction, inf))]
    return max([piece[-1][1] for piece in pieces], default=0.0)


def mounted_at(place: Vector) -> MountedAt:
    """Return a mount at a place of the first link, turned as that is."""
    x, y, z = place
    return FIRST_LINK.model_copy(update={"x": x, "y": y, "z": z})
