"""Places of endpoints and what lies between them, as of the newest committed frame."""

from __future__ import annotations

from fnmatch import fnmatchcase
from typing import Final

import numpy as np

from foosim.deployment.network.rules import Network
from foosim.deployment.schema import Deployment
from foosim.vhub.line_of_sight.occlusion import Crossing, Geometry, Sight, Trace
from foosim.world.assembly.world import build_scene
from foosim.world.frame import Frame
from foosim.world.kinematics import forward_kinematics, velocity
from foosim.world.layout import Entity, Layout
from foosim.world.scene import ORIGIN, UPRIGHT, Body, Quaternion, Vector, rotate, shape_box

VEHICLE: Final = "vehicle"
"""The tag of robots that drive: their hulls attenuate waves between others as hulls of cars do."""


class _Robot:
    """A robot, or an endpoint without a body, in the frames of one layout."""

    __slots__ = ("antenna", "body", "entity", "orientation", "position", "turns")

    def __init__(self, name: str, body: Body | None, layout: Layout | None) -> None:
        self.body = body
        self.entity: Entity | None = layout[name] if layout is not None and name in layout else None
        self.antenna: Vector = ORIGIN if body is None else body.antenna
        self.turns = -1
        """The number of the frame of the pose."""
        self.position: Vector = ORIGIN
        self.orientation: Quaternion = UPRIGHT
        """The pose of the link of its body that has the antenna."""


class World:
    """Antennas and lines of sight, each computed when it is first needed."""

    def __init__(self, deployment: Deployment, network: Network) -> None:
        self._deployment, self._places = deployment, network.places
        self._carriers = deployment.carriers()
        self._frame: Frame | None = None
        self._geometry: Geometry | None = None
        """The scene of the frame's layout."""
        self._sight: Sight | None = None
        self._numbers: list[float] | None = None
        self._robots: dict[str, _Robot] = {}
        """By endpoint, in the frames of a layout."""
        self._standing: dict[str, Vector] = {}
        self._down: frozenset[str] = frozenset()
        self._named: list[str] = []
        self._switches = np.zeros(0, np.intp)
        """Of each robot of that layout: the slot of whether it is out of service."""
        self._states = b""
        """Values of these slots in the newest frame."""
        self.turns = 0
        """Grows with every frame."""

    def turn_to(self, frame: Frame) -> bool:
        """Take the newest committed frame; return whether other endpoints are out of service in it."""
        if frame is self._frame:
            return False
        if self._frame is None or frame.layout is not self._frame.layout:
            self._geometry = None
            self._robots.clear()
            self._named = [robot.name for robot in frame.layout.robots]
            self._switches = np.array([robot.offsets["down"] for robot in frame.layout.robots], np.intp)
            self._states = b""
        self._frame, self._sight, self._numbers = frame, None, None
        self.turns += 1
        found = frame.values[self._switches]
        states = found.tobytes()
        if states == self._states:
            return False
        self._states = states
        robots = {name for name, is_down in zip(self._named, found.tolist(), strict=True) if is_down}
        down = frozenset((*robots, *(name for name, robot in self._carriers.items() if robot in robots)))
        changed, self._down = down != self._down, down
        return changed

    def body(self, endpoint: str) -> str:
        """Return the robot that an endpoint is or is on board of; its own name where it is on none."""
        return self._carriers.get(endpoint, endpoint)

    def is_down(self, endpoint: str) -> bool:
        """Whether the robot that an endpoint is, or is on board of, is out of service."""
        return endpoint in self._down

    def antenna(self, endpoint: str, mount: Vector) -> Vector:
        """Return the place (m, world frame) of an antenna: `mount` beside its body's own one, in the body's frame."""
        robot, (mx, my, mz) = self._robot(endpoint), mount
        if robot.body is None:
            px, py, pz = self._place(endpoint)
            return px + mx, py + my, pz + mz
        if robot.turns != self.turns:
            assert robot.entity is not None
            poses = forward_kinematics(robot.body, robot.entity, self._values())
            _, robot.position, robot.orientation = poses[robot.body.antenna_link]
            robot.turns = self.turns
        (px, py, pz), (ox, oy, oz) = robot.position, robot.antenna
        x, y, z = rotate(robot.orientation, (ox + mx, oy + my, oz + mz))
        return px + x, py + y, pz + z

    def velocity(self, endpoint: str) -> Vector:
        """Return how fast the body moves that an endpoint is, or is on board of (m/s, world frame); 0 without one."""
        robot = self._robot(endpoint)
        if robot.body is None:
            return ORIGIN
        assert robot.entity is not None
        return velocity(robot.body, robot.entity, self._values())

    def vehicle_height_m(self, name: str) -> float | None:
        """Return the height of a vehicle's hull without its antenna (m); None for other robots."""
        robot = self._deployment.robots.get(name)
        if robot is None or not (VEHICLE in robot.tags or VEHICLE in robot.component_type.tags):
            return None
        body = self._robot(name).body
        return None if body is None else shape_box(body.links[0].shapes[0])[1][2]

    def _robot(self, endpoint: str) -> _Robot:
        """Return the robot that an endpoint is or is on board of, in the newest frame's layout."""
        found = self._robots.get(endpoint)
        if found is None:
            layout, name = None if self._frame is None else self._frame.layout, self.body(endpoint)
            body = None if layout is None else self._scene(layout).scene.bodies.get(name)
            found = self._robots[endpoint] = _Robot(name, body, layout)
        return found

    def _scene(self, layout: Layout) -> Geometry:
        """Return the scene of the newest frame's layout."""
        if self._geometry is None:
            self._geometry = Geometry(build_scene(self._deployment, layout))
        return self._geometry

    def _values(self) -> list[float]:
        """Return the numbers of the newest frame, which must exist."""
        if self._numbers is None:
            assert self._frame is not None
            self._numbers = self._frame.numbers
        return self._numbers

    def _place(self, endpoint: str) -> Vector:
        """Return the declared place of an endpoint without a body."""
        found = self._standing.get(endpoint)
        if found is None:
            places = (place for glob, place in self._places.items() if fnmatchcase(endpoint, glob))
            x, y, z = next(places, ORIGIN)
            found = self._standing[endpoint] = x, y, z
        return found

    def crossings(
        self, a: Vector, b: Vector, ignoring: frozenset[str], trace: Trace | None = None
    ) -> tuple[Crossing, ...]:
        """Return what the line between two places crosses, without the bodies `ignoring`.

        `trace` is what the caller remembers of the line in earlier frames.
        """
        if self._frame is None:
            return ()
        if self._sight is None:
            layout = self._frame.layout
            self._sight = Sight(self._scene(layout), layout, self._values())
        return self._sight.crossings((a, b) if a <= b else (b, a), ignoring, Trace() if trace is None else trace)
