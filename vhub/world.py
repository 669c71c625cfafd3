"""Where endpoints are and what stands between them, as of the newest committed frame.

Neighbours: `geometry` (rays), `propagation` asks, `state` turns it to the frame of each closing.
"""

from __future__ import annotations

from fnmatch import fnmatchcase

from foosim.protocol.deployment import Deployment
from foosim.protocol.frame import Frame
from foosim.protocol.layout import Layout
from foosim.protocol.network import Network
from foosim.protocol.rovers import RoverRobot
from foosim.protocol.scene import ORIGIN, Body, Pose, Vector, forward_kinematics, rotate, velocity
from foosim.protocol.scenes import build_scene
from foosim.vhub.geometry import Crossing, LineOfSight, Sight, Trace


class World:
    """Antennas and lines of sight. Nothing is computed before somebody asks."""

    def __init__(self, deployment: Deployment, network: Network) -> None:
        self._deployment, self._places = deployment, network.places
        self._carriers = deployment.carriers()
        self._sights: LineOfSight | None = None
        self._sight: Sight | None = None
        self._frame: Frame | None = None
        self._layout: Layout | None = None
        self._bodies: dict[str, Body] = {}
        self._poses: dict[str, Pose | None] = {}
        self._standing: dict[str, Vector] = {}
        self._fixed: dict[tuple[str, Vector], Vector] = {}
        """Antennas of endpoints without a body, in all frames of a layout."""
        self._down: dict[str, bool] = {}
        self.turns = 0
        """Grows with every frame."""

    def turn_to(self, frame: Frame) -> None:
        """Take the newest committed frame."""
        if frame is not self._frame:
            if self._frame is None or frame.layout is not self._frame.layout:
                self._fixed.clear()
            self._frame, self._sight = frame, None
            self._poses.clear()
            self._down.clear()
            self.turns += 1

    def body(self, endpoint: str) -> str:
        """Return the robot that an endpoint is or is on board of; its own name where it is on none."""
        return self._carriers.get(endpoint, endpoint)

    def is_down(self, endpoint: str) -> bool:
        """Whether the robot that an endpoint is, or is on board of, is out of service."""
        found = self._down.get(endpoint)
        if found is None:
            frame, body = self._frame, self.body(endpoint)
            found = frame is not None and body in frame.layout and frame.at(body, "down") != 0.0
            self._down[endpoint] = found
        return found

    def antenna(self, endpoint: str, mount: Vector) -> Vector:
        """Return the place (m, world frame) of an antenna: `mount` beside its body's own one, in the body's frame."""
        key = endpoint, mount
        found = self._fixed.get(key)
        if found is None:
            body = self.body(endpoint)
            pose = self._pose(body)
            if pose is not None:
                _, (px, py, pz), orientation = pose
                (ox, oy, oz), (mx, my, mz) = self._bodies[body].antenna, mount
                x, y, z = rotate(orientation, (ox + mx, oy + my, oz + mz))
                return px + x, py + y, pz + z
            px, py, pz = self._place(endpoint)
            x, y, z = mount
            found = self._fixed[key] = px + x, py + y, pz + z
        return found

    def velocity(self, endpoint: str) -> Vector:
        """Return how fast the body moves that an endpoint is, or is on board of (m/s, world frame); 0 without one."""
        robot, frame = self.body(endpoint), self._frame
        if frame is None or self._pose(robot) is None:
            return ORIGIN
        return velocity(self._bodies[robot], frame.layout[robot], frame.numbers)

    def vehicle_height_m(self, name: str) -> float | None:
        """Return how high the hull of a rover is; None for what is no vehicle."""
        deployment = self._deployment
        is_rover = deployment.is_hall and isinstance(deployment.robots.get(name), RoverRobot)
        return deployment.hall.rover.height if is_rover else None

    def _pose(self, robot: str) -> Pose | None:
        """Return the pose of a robot's last link; None for what has no body."""
        frame = self._frame
        if frame is None:
            return None
        if frame.layout is not self._layout:
            self._layout, self._bodies = frame.layout, dict(build_scene(self._deployment, frame.layout).bodies)
        if robot not in self._poses:
            body = self._bodies.get(robot)
            self._poses[robot] = (
                None if body is None else forward_kinematics(body, frame.layout[robot], frame.numbers)[-1]
            )
        return self._poses[robot]

    def _place(self, endpoint: str) -> Vector:
        """Return where the deployment says that an endpoint without a body is."""
        found = self._standing.get(endpoint)
        if found is None:
            places = (place for glob, place in self._places.items() if fnmatchcase(endpoint, glob))
            x, y, z = next(places, ORIGIN)
            found = self._standing[endpoint] = x, y, z
        return found

    def crossings(
        self, a: Vector, b: Vector, ignoring: frozenset[str], trace: Trace | None = None
    ) -> tuple[Crossing, ...]:
        """Return what the line between two places crosses, some bodies aside.

        `trace` is what who asks remembers of the line, if it asks in each frame.
        """
        if self._frame is None:
            return ()
        if self._sight is None:
            if self._sights is None:
                self._sights = LineOfSight(self._deployment)
            self._sight = self._sights.at(self._frame)
        return self._sight.look((a, b) if a <= b else (b, a), ignoring, Trace() if trace is None else trace)
