"""A thing that moves along a path, repeatedly or once: a door, a conveyor's load, a walking person."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from math import sqrt
from typing import Annotated, ClassVar, Final, Literal, Self

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from foosim.common import units
from foosim.common.errors import BadValue
from foosim.common.spec_base import SpecBase, default
from foosim.common.units import Quantity, custom_error
from foosim.library.generic.path import Path, Point, path_at_speed, path_of
from foosim.library.mobile.arcs import Floats, shorter, upright_turn
from foosim.library.mobile.vehicles import HULL, FreeMotion, Height, KinematicModel, Radius, Speed
from foosim.world.component_types.descriptions import BODY
from foosim.world.component_types.registry import model
from foosim.world.component_types.settings import RobotSettings
from foosim.world.components.entities import MotionMounting, Motors
from foosim.world.components.view import Mounting, WritableView
from foosim.world.layout import Entity
from foosim.world.matter.materials import UNKNOWN, Radio
from foosim.world.moving.columns import EntityColumns
from foosim.world.moving.upright import Upright
from foosim.world.placing import Coordinate, Turn
from foosim.world.scene import ORIGIN, Body, Box, Colour, Cylinder, Link, Shape, Sphere

YELLOW: Final[Colour] = (0.95, 0.80, 0.10, 1.0)
FASTEST: Final = 50.0
"""The greatest speed of a path (m/s), that of the setting `speed`."""
POINTS_MAX: Final = 1024
SIZES: Final = {"box": ("length", "width", "height"), "cylinder": ("radius", "height"), "sphere": ("radius",)}
"""The sizes that each shape has."""

Side = Annotated[float, Quantity(units.LENGTH, "1 cm", "20 m")]
Time = Annotated[int, Quantity(units.TIME, "0 s", "24 h")]


class PathPoint(SpecBase):
    """A place in the world, a heading there, and when to be there."""

    x: Coordinate = default("0 m")
    y: Coordinate = default("0 m")
    z: Coordinate = default("0 m")
    yaw: Turn = default("0 deg")
    time_ns: Time | None = Field(default=None, alias="time")

    @property
    def point(self) -> Point:
        """The same in SI units; 0 s without a time."""
        return Point(self.x, self.y, self.z, self.yaw, (self.time_ns or 0) / 1e9)


def _sensible(path: list[PathPoint]) -> list[PathPoint]:
    """Refuse paths with some times, with times that do not rise, and with ways that are too fast or none."""
    timed = [point.time_ns is not None for point in path]
    if any(timed) and not all(timed):
        number = timed.index(not timed[0]) + 1
        raise custom_error(BadValue(f"point {number} differs: give all points of a path a time, or none"))
    for number, (one, other) in enumerate(pairwise(path), 2):
        if one.time_ns is None or other.time_ns is None:
            if one.point.way_to(other.point) == 0.0:
                raise custom_error(BadValue(f"point {number} equals the one before it: the path needs times"))
        elif other.time_ns <= one.time_ns:
            raise custom_error(BadValue(f"the time of point {number} is not after the time of the point before it"))
        elif one.point.way_to(other.point) > FASTEST * (other.time_ns - one.time_ns) / 1e9:
            raise custom_error(BadValue(f"the way to point {number} is faster than {FASTEST:g} m/s"))
    return path


PathPoints = Annotated[list[PathPoint], Field(min_length=2, max_length=POINTS_MAX), AfterValidator(_sensible)]


class MoverRobot(RobotSettings):
    """A box, a cylinder or a sphere that moves along a path with the middle of its underside.

    A box has `length`, `width` and `height`, a cylinder `radius` and `height`, a sphere `radius`. The points of `path`
    have each a `time`, or the way between them is gone at `speed`. With `loop` it begins again: with times the last
    point is where the first is, with a speed it goes there. It waits where it is stopped, and continues from there.
    """

    shape: Literal["box", "cylinder", "sphere"] = "box"
    length: Side | None = None
    width: Side | None = None
    height: Height | None = None
    radius: Radius | None = None
    path: PathPoints
    speed: Speed | None = None
    loop: bool = False
    radio: Radio | None = None

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        for problem in self._problems():
            raise custom_error(BadValue(problem))
        return self

    def _problems(self) -> Iterator[str]:
        sizes = SIZES[self.shape]
        for key in dict.fromkeys(key for keys in SIZES.values() for key in keys):
            if (getattr(self, key) is None) is (key in sizes):
                problem = "is missing" if key in sizes else "is not one of them"
                yield f"a {self.shape} has {' and '.join(sizes)}: {key} {problem}"
        first, last = self.path[0], self.path[-1]
        if first.time_ns is None and self.speed is None:
            yield "a path without times needs a speed"
        if first.time_ns is not None and self.speed is not None:
            yield "a path with times has no speed"
        if self.loop:
            is_closed = first.point.way_to(last.point) == 0.0
            if first.time_ns is not None and not is_closed:
                yield "a loop with times must end where it begins"
            if first.time_ns is None and is_closed:
                yield "a loop at a speed returns by itself: leave out the last point, which equals the first"

    def as_path(self) -> Path:
        """Return the path in time."""
        points = [point.point for point in self.path]
        if self.speed is None:
            return path_of(points, is_loop=self.loop)
        return path_at_speed(points, self.speed, is_loop=self.loop)

    def size(self) -> tuple[float, float, float]:
        """Return length, width and height (m)."""
        across = 2.0 * (self.radius or 0.0)
        return self.length or across, self.width or across, self.height or across


class Track(FreeMotion):
    """Along a path in time, and waiting while something is in the way; `clock` is the time on the path (s).

    The clock of a path is a slot. Where an obstacle is in the way (`moving.free_way`) it runs less, by halves, and
    so the thing waits on its path.
    """

    slots: ClassVar = {"clock": 1}
    fields: ClassVar = (*BODY, "heading", "blocked")

    def __init__(self, at: MotionMounting) -> None:
        self._tick_s = at.spec.tick_ns / 1e9
        self._clocks = EntityColumns(at, ("clock",))
        super().__init__(at)

    def take(self, entities: Sequence[Entity]) -> None:
        """Keep their paths, and the columns of the times on them."""
        super().take(entities)
        self._clock = self._clocks.of(entities)
        robots = [self.at.spec.robots[entity.name] for entity in entities]
        self._paths = [its.as_path() for its in robots if isinstance(its, MoverRobot)]
        assert len(self._paths) == len(robots), "the motion track moves entities with a path"

    def move(self, entities: Sequence[Entity], motors: Sequence[Motors], view: WritableView) -> None:
        """Advance these things by a tick; they have no motors."""
        tick_s = self._tick_s
        state, near = self.start(entities, view)
        clocks = self._clock.read_at_start(view)[:, 0].tolist()

        def poses(shares: Floats) -> Floats:
            each = zip(self._paths, clocks, shares.tolist(), strict=True)
            return np.array([path.at(path.after(clock, tick_s * share)) for path, clock, share in each])

        start, full = state[:, 0:3], poses(np.ones(len(entities)))
        moves = (full[:, 0:3] != start).any(axis=1)
        shares, is_stopped = near.free_share(start, lambda shares: poses(shares)[:, 0:3], moves)
        after = poses(shares) if is_stopped.any() else full
        z, w = upright_turn(after[:, 3])
        new = np.zeros_like(state)
        new[:, 0:3], new[:, 5], new[:, 6], new[:, 13] = after[:, 0:3], z, w, shorter(after[:, 3])
        new[:, 7:10], new[:, 12] = (after[:, 0:3] - start) / tick_s, shorter(after[:, 3] - state[:, 13]) / tick_s
        new[:, 14] = is_stopped
        self.state.write(view, new)
        each = zip(self._paths, clocks, shares.tolist(), strict=True)
        self._clock.write(view, np.array([[path.after(clock, tick_s * share)] for path, clock, share in each]))


@model(
    "mover",
    MoverRobot,
    slots={**BODY, "heading": 1, "blocked": 1},
    motion=Track,
    units={"heading": ("rad",)},
)
class Mover(KinematicModel):
    """A box, a cylinder or a sphere that moves along a path; `blocked`: an obstacle stopped it in the tick."""

    def __init__(self, settings: MoverRobot, at: Mounting) -> None:
        self._path = settings.as_path()
        super().__init__(settings, at)

    @property
    def fastest(self) -> float:
        """The greatest speed of its path (m/s)."""
        return self._path.fastest

    def body(self) -> Body:
        """Return the shape, above its place."""
        its, name = self.settings, self.at.robot.name
        length, width, height = its.size()
        geometry: Box | Cylinder | Sphere = Box((length / 2, width / 2, height / 2))
        if its.shape == "cylinder":
            geometry = Cylinder(length / 2, height)
        elif its.shape == "sphere":
            geometry = Sphere(length / 2)
        shape = Shape(geometry, HULL, YELLOW, (0.0, 0.0, height / 2), radio=its.radio or UNKNOWN)
        link = Link(name, "free", (shape,), 0.0, ORIGIN)
        return Body(name, "mover", ORIGIN, (link,), (0.0, 0.0, height), self._path.fastest)

    def upright(self) -> Upright:
        """Return its cylinder for obstacles, in which it can have any heading."""
        length, width, height = self.settings.size()
        radius = length / 2 if self.settings.shape != "box" else sqrt(length * length + width * width) / 2
        return Upright(radius, 0.0, height)

    def place(self, view: WritableView) -> None:
        """Set it to where its path begins."""
        x, y, z, yaw = self._path.at(0.0)
        self.set_down(view, (x, y, z), yaw)
