"""A robot from a URDF file: rigid links and joints, on a base that is fixed or free."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase
from math import inf
from typing import Annotated

from pydantic import AfterValidator, Field, StringConstraints

from foosim.common import units
from foosim.common.errors import BadValue
from foosim.common.finding import Location
from foosim.common.names import nearest_quoted
from foosim.common.spec_base import PartName, default
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
from foosim.world.components.view import IncompatibleComponent, Mounting, WritableView
from foosim.world.matter.physics import DEFAULT
from foosim.world.placing import At
from foosim.world.scene import MOVING, Body, Link
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
    robot usually is. `surface` is that of all its shapes, or those of links by their names or by patterns of these: the
    first that matches counts, and a link without one has the surface `default`.
    """

    file: UrdfPath
    at: At = Field(default_factory=At)
    fixed: bool
    surface: Surface | dict[PartName, Surface] = DEFAULT
    speed_limit: SpeedLimit = default("30 m/s")

    @property
    def felt_surfaces(self) -> Mapping[Location, str]:
        """The surfaces of its shapes, by setting."""
        if isinstance(self.surface, str):
            return {("surface",): self.surface}
        return {("surface", pattern): surface for pattern, surface in self.surface.items()}

    def asset_paths(self, files: Mapping[str, bytes]) -> Sequence[str]:
        """Return the robot's file, and the meshes that it names, those of visuals in drawn form."""
        return (self.file, *meshes_of(self.file, files[self.file])) if self.file in files else (self.file,)

    def check_assets(self, files: Mapping[str, bytes]) -> None:
        """Read the robot. Raises AssetError."""
        read_urdf(self.file, files)


def robot_of(settings: UrdfRobot, spec: WorldSpec) -> Robot:
    """Return the robot in the file that settings name. Raises BadValue where that was not given."""
    if settings.file not in spec.asset_files:
        raise BadValue("the content of the robot's file is missing", settings.file)
    return read_urdf(settings.file, spec.asset_files)


def slots_of(settings: UrdfRobot, spec: WorldSpec) -> dict[str, int]:
    robot = robot_of(settings, spec)
    problem = "" if settings.fixed else free_base_problem(robot)
    if problem:
        raise BadValue(problem, settings.file)
    _surfaces(settings, robot)
    joints = len(robot.moving)
    moving = dict.fromkeys(JOINTS, joints) if joints else {}
    return {**({} if settings.fixed else BODY), **moving, "quarantined": 1, "down": 1, **CONTACTS, "refused": 1}


def _surfaces(settings: UrdfRobot, robot: Robot) -> list[str]:
    """Return the surface of each link. Raises IncompatibleComponent for a pattern that matches none."""
    chosen = settings.surface if isinstance(settings.surface, dict) else {"*": settings.surface}
    names = [link.name for link in robot.links]
    for pattern in chosen:
        if not any(fnmatchcase(name, pattern) for name in names):
            what = f"a surface of no link; there are {', '.join(names)}"
            raise IncompatibleComponent(("surface", pattern), what, pattern, nearest_quoted(pattern, names))
    matching = ([its for pattern, its in chosen.items() if fnmatchcase(name, pattern)] for name in names)
    return [(*found, DEFAULT)[0] for found in matching]


@model("urdf", UrdfRobot, slots=slots_of, is_rigid=True)
class Urdf(Model):
    """A robot from a URDF file; its joints start at 0, or at the limit that is nearest to it."""

    def __init__(self, settings: UrdfRobot, at: Mounting) -> None:
        self._settings, self._at = settings, at
        where = settings.at
        robot = robot_of(settings, at.spec)
        body = body_of(
            robot,
            at.robot.name,
            where.position,
            where.orientation,
            fixed=settings.fixed,
            surfaces=_surfaces(settings, robot),
            speed_limit=settings.speed_limit,
        )
        self._body = replace(body, model=at.robot.model)

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
            view.write(at.slot("joint_positions"), *starts_of(body))
        view.write(at.slot("contacts"), 0.0, 0.0, -1.0)

    def excite(self, view: WritableView) -> None:
        """Set it in motion, for the run that compares engines."""
        if self._body.is_free:
            view.write(self._at.slot("linear_velocity"), 0.5, 0.2, 0.0)
        if self._body.joints:
            speeds = [0.1 if link.mimic is None else 0.1 * link.mimic.ratio for link in self._body.joints]
            view.write(self._at.slot("joint_velocities"), *speeds)


def starts_of(body: Body) -> list[float]:
    """Return where the joints of a body start: at 0, or at the limit that is nearest to it.

    A mimic joint starts where its leader has it; the leader starts where all its followers are within their limits, if
    there is such a place.
    """
    found = {}
    for index, link in enumerate(body.links):
        low, high = _limits(link)
        for other in body.links:
            if other.mimic is not None and other.mimic.leader == index and other.mimic.ratio != 0.0:
                ends = sorted([(end - other.mimic.offset) / other.mimic.ratio for end in _limits(other)])
                low, high = min(max(low, ends[0]), high), max(min(high, ends[1]), low)
        found[index] = min(max(0.0, low), high)
    for index, link in enumerate(body.links):
        if link.mimic is not None:
            found[index] = link.mimic.ratio * found[link.mimic.leader] + link.mimic.offset
    return [found[index] for index, link in enumerate(body.links) if link.joint in MOVING]


def _limits(link: Link) -> tuple[float, float]:
    return (-inf, inf) if link.joint == "continuous" else link.limits
