"""A robot from a URDF file: rigid links and joints, on a base that is fixed or free."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from math import inf, sqrt
from typing import Annotated, Final

from pydantic import AfterValidator, Field, StringConstraints

from foosim.common import units
from foosim.common.errors import BadValue
from foosim.common.spec_base import default
from foosim.common.units import Quantity, custom_error
from foosim.world.bodies.urdf import Robot, body_of, free_base_problem, meshes_of, read_urdf, start_of
from foosim.world.components.view import Mounting, WritableView
from foosim.world.forms.forms import BODY, CONTACTS, JOINTS
from foosim.world.forms.registry import model
from foosim.world.forms.settings import RobotSettings
from foosim.world.placing import At
from foosim.world.scene import MOVING, Body, Link, enclosing, shape_box
from foosim.world.scenery import AssetPath
from foosim.world.spec import WorldSpec

SUFFIX: Final = ".urdf"
WORLD_MAX_M: Final = 100e3
"""No coordinate of a free robot is farther out, as none of a place in a deployment is."""
STOP_DEPTH_RAD: Final = 0.1
STOP_DEPTH_M: Final = 0.02
"""How far a joint may be beyond its limits: its stops give way a little."""
SPEED_FACTOR: Final = 10.0
"""What pushes a joint may turn it faster than its motor does, by so much."""
SPEED_MAX: Final = 1000.0
"""The speed of a joint of which the file says none (rad/s)."""


def _urdf_path(path: str) -> str:
    if not path.endswith(SUFFIX):
        raise custom_error(BadValue(f"no URDF file, which ends with {SUFFIX}", path))
    return path


UrdfPath = Annotated[AssetPath, AfterValidator(_urdf_path)]
SpeedLimit = Annotated[float, Quantity(units.SPEED, "1 mm/s", "1000 m/s")]
Surface = Annotated[str, StringConstraints(min_length=1, max_length=48)]


class UrdfRobot(RobotSettings):
    """A robot from a URDF file in the asset folder: `at` is the pose of its first link.

    The base is held there if it is `fixed`, else the first link is free, and no part of the robot is ever faster than
    `speed_limit`. `surface` is that of all its shapes.
    """

    file: UrdfPath
    at: At = Field(default_factory=At)
    fixed: bool
    surface: Surface = "default"
    speed_limit: SpeedLimit = default("30 m/s")

    @property
    def felt_surfaces(self) -> Mapping[str, str]:
        """The surface of all its shapes."""
        return {"surface": self.surface}

    def asset_paths(self, files: Mapping[str, bytes]) -> Sequence[str]:
        """Return the URDF file, and the meshes of collision shapes that it names."""
        return (self.file, *meshes_of(self.file, files[self.file])) if self.file in files else (self.file,)

    def check_assets(self, files: Mapping[str, bytes]) -> None:
        """Read the robot. Raises AssetError."""
        read_urdf(self.file, files)


def robot_of(settings: UrdfRobot, spec: WorldSpec) -> Robot:
    """Return the robot in the file that settings name. Raises BadValue where that was not given."""
    if settings.file not in spec.asset_files:
        raise BadValue("a URDF file whose content is not there", settings.file)
    return read_urdf(settings.file, spec.asset_files)


def _slots(settings: UrdfRobot, spec: WorldSpec) -> dict[str, int]:
    robot = robot_of(settings, spec)
    problem = "" if settings.fixed else free_base_problem(robot)
    if problem:
        raise BadValue(problem, settings.file)
    joints = len(robot.moving)
    moving = dict.fromkeys(JOINTS, joints) if joints else {}
    return {**({} if settings.fixed else BODY), **moving, "quarantined": 1, "down": 1, **CONTACTS, "refused": 1}


@model("urdf", UrdfRobot, slots=_slots, is_rigid=True)
class Urdf:
    """A robot from a URDF file; its joints start at 0, or at the limit that is nearest to it."""

    def __init__(self, settings: UrdfRobot, at: Mounting) -> None:
        self._settings, self._at = settings, at
        where = settings.at
        self._body = body_of(
            robot_of(settings, at.spec),
            at.robot.name,
            where.position,
            where.orientation,
            fixed=settings.fixed,
            surface=settings.surface,
            speed_limit=settings.speed_limit,
        )
        self._free = 0 if settings.fixed else at.slot("position").at
        joints = self._body.joints
        self._joints = at.slot("joint_positions").at if joints else 0
        self._speeds = at.slot("joint_velocities").at if joints else 0
        tick_s = at.spec.tick_ns / 1e9
        self._bounds = tuple([_bounds(link) for link in joints])
        self._ways = tuple([_speed_max(link) * tick_s for link in joints])
        self._reach_m = settings.speed_limit * tick_s

    @cached_property
    def _arms(self) -> tuple[float, ...]:
        """Of each link (`arms_of`): where robots are only placed, none of them is wanted."""
        return arms_of(self._body)

    def body(self) -> Body:
        """Return links and shapes as the file says."""
        return self._body

    def place(self, view: WritableView) -> None:
        """Set it where it starts, at rest."""
        at, body = self._at, self._body
        if body.is_free:
            position, orientation = start_of(body, self._settings.at.position, self._settings.at.orientation)
            view.write(at.slot("position"), *position)
            view.write(at.slot("orientation"), *orientation)
        if body.joints:
            view.write(at.slot("joint_positions"), *[_start(link) for link in body.joints])
        view.write(at.slot("contacts"), 0.0, 0.0, -1.0)

    def is_plausible(self, numbers: Sequence[float], before: Sequence[float]) -> bool:
        """Whether its joints are within their limits and speeds, and a free one is neither too far nor too fast."""
        for number, (low, high, speed) in enumerate(self._bounds):
            at, moves = self._joints + number, numbers[self._speeds + number]
            if not (low <= numbers[at] <= high and -speed <= moves <= speed):
                return False
            if abs(numbers[at] - before[at]) > self._ways[number]:
                return False
        return not self._body.is_free or self._is_free_plausible(numbers, before)

    def _is_free_plausible(self, numbers: Sequence[float], before: Sequence[float]) -> bool:
        start = self._free
        way = 0.0
        for number in range(start, start + 3):
            if abs(numbers[number]) > WORLD_MAX_M:
                return False
            way += (numbers[number] - before[number]) * (numbers[number] - before[number])
        return way <= self._reach_m * self._reach_m and self._speed(numbers) <= self._settings.speed_limit

    def _speed(self, numbers: Sequence[float]) -> float:
        """Return a bound of how fast any part of it is (m/s): of each link, what its joints and the base can add up to.

        What a turn adds is its speed times the farthest that anything beyond the joint is from it.
        """
        at = self._at
        linear, angular = at.slot("linear_velocity").at, at.slot("angular_velocity").at
        vx, vy, vz = numbers[linear : linear + 3]
        wx, wy, wz = numbers[angular : angular + 3]
        speeds = [sqrt(vx * vx + vy * vy + vz * vz) + sqrt(wx * wx + wy * wy + wz * wz) * self._arms[0]]
        joint = self._speeds
        for link, arm in zip(self._body.links[1:], self._arms[1:], strict=True):
            own = 0.0
            if link.joint in MOVING:
                own = abs(numbers[joint]) * arm
                joint += 1
            speeds.append(speeds[link.parent] + own)
        return max(speeds)

    def stir(self, view: WritableView) -> None:
        """Set it in motion, for the small run that tells engines apart."""
        if self._body.is_free:
            view.write(self._at.slot("linear_velocity"), 0.5, 0.2, 0.0)
        if self._body.joints:
            view.write(self._at.slot("joint_velocities"), *[0.1 for _ in self._body.joints])


def _start(link: Link) -> float:
    """Return where a joint starts: at 0, or at its limit that is nearest to it."""
    low, high = (-inf, inf) if link.joint == "continuous" else link.limits
    return min(max(0.0, low), high)


def _speed_max(link: Link) -> float:
    return SPEED_MAX if link.speed == inf else link.speed * SPEED_FACTOR


def _bounds(link: Link) -> tuple[float, float, float]:
    """Return the least and greatest position of a joint, and its greatest speed."""
    depth = STOP_DEPTH_M if link.joint == "prismatic" else STOP_DEPTH_RAD
    low, high = (-inf, inf) if link.joint == "continuous" else link.limits
    return low - depth, high + depth, _speed_max(link)


def arms_of(body: Body) -> tuple[float, ...]:
    """Return of each link by how much at most a part beyond its joint moves, per unit of the joint's speed.

    For a joint that turns that is how far from its place the shapes beyond it can be (m), for the first link from its
    centre of mass; for one that slides it is 1. Links without a joint that moves have what is beyond them.
    """
    reach = [0.0] * len(body.links)
    for number in range(len(body.links) - 1, -1, -1):
        link = body.links[number]
        if link.shapes:
            low, high = enclosing([shape_box(shape) for shape in link.shapes])
            x, y, z = (max(abs(low[axis]), abs(high[axis])) for axis in range(3))
            reach[number] = max(reach[number], sqrt(x * x + y * y + z * z))
        if link.parent >= 0:
            x, y, z = link.position
            slides = max(abs(way) for way in link.limits) if link.joint == "prismatic" else 0.0
            beyond = reach[number] + slides + sqrt(x * x + y * y + z * z)
            reach[link.parent] = max(reach[link.parent], beyond)
    x, y, z = body.links[0].centre_of_mass
    first = reach[0] + sqrt(x * x + y * y + z * z)
    return (first, *[1.0 if link.joint == "prismatic" else reach[n] for n, link in enumerate(body.links) if n > 0])
