"""A robot from a URDF file: rigid links and joints, on a base that is fixed or free."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf
from typing import Annotated

from pydantic import AfterValidator, Field, StringConstraints

from foosim.common import units
from foosim.common.errors import BadValue
from foosim.common.spec_base import default
from foosim.common.units import Quantity, custom_error
from foosim.world.bodies.urdf import (
    SUFFIX,
    XACRO,
    Robot,
    body_of,
    free_base_problem,
    meshes_of,
    read_urdf,
    start_of,
    unexpanded,
)
from foosim.world.component_types.descriptions import BODY, CONTACTS, JOINTS
from foosim.world.component_types.registry import model
from foosim.world.component_types.settings import RobotSettings
from foosim.world.components.base import Model
from foosim.world.components.view import Mounting, WritableView
from foosim.world.placing import At
from foosim.world.scene import Body, Link
from foosim.world.scenery import AssetPath
from foosim.world.spec import WorldSpec


def _urdf_path(path: str) -> str:
    if path.endswith(XACRO):
        raise custom_error(BadValue(unexpanded(path)))
    if not path.endswith(SUFFIX):
        raise custom_error(BadValue(f"no URDF file, which ends with {SUFFIX}", path))
    return path


UrdfPath = Annotated[AssetPath, AfterValidator(_urdf_path)]
SpeedLimit = Annotated[float, Quantity(units.SPEED, "1 mm/s", "1000 m/s")]
Surface = Annotated[str, StringConstraints(min_length=1, max_length=48)]


class UrdfRobot(RobotSettings):
    """A robot from a URDF file in the asset folder: `at` is the pose of its first link.

    The base is held there if it is `fixed`, else the first link is free, and `speed_limit` is how fast any part of the
    robot usually is. `surface` is that of all its shapes.
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
        raise BadValue("the content of the URDF file is missing", settings.file)
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
class Urdf(Model):
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

    def body(self) -> Body:
        """Return the links and shapes of the file."""
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

    def excite(self, view: WritableView) -> None:
        """Set it in motion, for the run that compares engines."""
        if self._body.is_free:
            view.write(self._at.slot("linear_velocity"), 0.5, 0.2, 0.0)
        if self._body.joints:
            view.write(self._at.slot("joint_velocities"), *[0.1 for _ in self._body.joints])


def _start(link: Link) -> float:
    """Return where a joint starts: at 0, or at its limit that is nearest to it."""
    low, high = (-inf, inf) if link.joint == "continuous" else link.limits
    return min(max(0.0, low), high)
