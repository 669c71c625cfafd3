"""The messages of a capture for viewers: scene, poses and log lines, as Foxglove's Protobuf.

Poses are every link's in the frame `world`, by the one forward kinematics. The scene hangs its shapes on the links
(`frame_locked`), so it is said once and when the layout changes. Foxglove, Lichtblick and (but for the scene) rerun
decode them.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from typing import Any, Final

from foxglove.messages import (
    Color,
    CubePrimitive,
    CylinderPrimitive,
    FrameTransform,
    FrameTransforms,
    Log,
    LogLevel,
    Point3,
    Pose,
    Quaternion,
    SceneEntity,
    SceneEntityDeletion,
    SceneEntityDeletionType,
    SceneUpdate,
    SpherePrimitive,
    Timestamp,
    TriangleListPrimitive,
    Vector3,
)

from foosim.deployment.schema import Deployment
from foosim.world.assembly.world import build_scene
from foosim.world.frame import Frame
from foosim.world.kinematics import forward_kinematics
from foosim.world.layout import Layout
from foosim.world.matter.mesh import Mesh
from foosim.world.scene import Box, Capsule, Hull, Scene, Shape, Sphere, Vector, moved, rotate
from foosim.world.scene import Quaternion as Turn

WORLD_FRAME: Final = "world"
SCENERY: Final = "scenery"
POSES: Final = "/tf"
SCENE: Final = "/scene"
LOG: Final = "/log"

VIEW_TYPES: Final[dict[str, Any]] = {SCENE: SceneUpdate, POSES: FrameTransforms, LOG: Log}
"""The Foxglove message of each topic."""

_LEVELS: Final = {"info": LogLevel.Info, "warning": LogLevel.Warning, "error": LogLevel.Error}
_SECOND_NS: Final = 1_000_000_000


@cache
def view_schema(message: Any) -> tuple[str, str, bytes]:
    """Return name, encoding and content of the schema of a Foxglove message."""
    schema = message.get_schema()
    return schema.name, schema.encoding, schema.data


class View:
    """Turns frames into messages for viewers. It remembers the scene of the newest layout."""

    def __init__(self, deployment: Deployment) -> None:
        self._deployment = deployment
        self._tick_ns = deployment.tick_ns
        self.poses_every = deployment.ticks(deployment.capture.poses_hz)
        """Ticks between two messages with poses."""
        self._layout: Layout | None = None
        self._scene = Scene({}, ())

    def turn_to(self, frame: Frame) -> bytes:
        """Return the SceneUpdate of a frame whose layout is new."""
        shown = _link_names(self._scene)
        self._layout = frame.layout
        self._scene = build_scene(self._deployment, frame.layout)
        gone = shown - _link_names(self._scene)
        at = self._timestamp(frame.tick)
        deletions = [
            SceneEntityDeletion(timestamp=at, type=SceneEntityDeletionType.MatchingId, id=link) for link in sorted(gone)
        ]
        entities = [_entity(at, SCENERY, WORLD_FRAME, self._scene.scenery)]
        for body in self._scene.bodies.values():
            entities += [_entity(at, link.name, link.name, link.shapes) for link in body.links]
        return SceneUpdate(deletions=deletions, entities=entities).encode()

    def poses(self, frame: Frame) -> bytes:
        """Return the FrameTransforms of all links at a frame of the layout that the scene shows."""
        assert self._layout is not None and self._layout.digest == frame.layout.digest, "the scene comes first"
        at = self._timestamp(frame.tick)
        numbers = frame.numbers
        transforms = []
        for name, body in self._scene.bodies.items():
            for link, position, orientation in forward_kinematics(body, frame.layout[name], numbers):
                transforms.append(
                    FrameTransform(
                        timestamp=at,
                        parent_frame_id=WORLD_FRAME,
                        child_frame_id=link,
                        translation=_vector(position),
                        rotation=_quaternion(orientation),
                    )
                )
        return FrameTransforms(transforms=transforms).encode()

    def log_line(self, level: str, text: str, tick: int) -> bytes:
        """Return the Log of one line; `level` is info, warning or error."""
        return Log(timestamp=self._timestamp(tick), level=_LEVELS[level], message=text, name="foosim").encode()

    def _timestamp(self, tick: int) -> Timestamp:
        return Timestamp(*divmod(tick * self._tick_ns, _SECOND_NS))


def _link_names(scene: Scene) -> set[str]:
    return {link.name for body in scene.bodies.values() for link in body.links}


def _entity(at: Timestamp, name: str, frame: str, shapes: Iterable[Shape]) -> SceneEntity:
    cubes, spheres, cylinders, triangles = [], [], [], []
    for shape in shapes:
        pose = Pose(position=_vector(shape.position), orientation=_quaternion(shape.orientation))
        red, green, blue, alpha = shape.colour
        colour = Color(r=red, g=green, b=blue, a=alpha)
        geometry = shape.geometry
        if isinstance(geometry, Box):
            cubes.append(CubePrimitive(pose=pose, size=_vector(_doubled(geometry.half)), color=colour))
        elif isinstance(geometry, Sphere):
            size = _doubled((geometry.radius, geometry.radius, geometry.radius))
            spheres.append(SpherePrimitive(pose=pose, size=_vector(size), color=colour))
        elif isinstance(geometry, Mesh | Hull):
            mesh = geometry.mesh if isinstance(geometry, Hull) else geometry
            points = [Point3(x=x, y=y, z=z) for x, y, z in mesh.vertices.tolist()]
            indices = mesh.triangles.ravel().tolist()
            triangles.append(TriangleListPrimitive(pose=pose, points=points, indices=indices, color=colour))
        else:
            across = 2.0 * geometry.radius
            size = (across, across, geometry.length)
            cylinders.append(
                CylinderPrimitive(pose=pose, size=_vector(size), bottom_scale=1.0, top_scale=1.0, color=colour)
            )
            if isinstance(geometry, Capsule):  # Foxglove has no capsule: a cylinder and two spheres look like one
                for end in (-geometry.length / 2, geometry.length / 2):
                    middle = moved(shape.position, rotate(shape.orientation, (0.0, 0.0, end)), 1.0)
                    at_end = Pose(position=_vector(middle), orientation=_quaternion(shape.orientation))
                    spheres.append(SpherePrimitive(pose=at_end, size=_vector((across, across, across)), color=colour))
    return SceneEntity(
        timestamp=at,
        frame_id=frame,
        id=name,
        frame_locked=True,
        cubes=cubes,
        spheres=spheres,
        cylinders=cylinders,
        triangles=triangles,
    )


def _doubled(half: Vector) -> Vector:
    return 2.0 * half[0], 2.0 * half[1], 2.0 * half[2]


def _vector(v: Vector) -> Vector3:
    return Vector3(x=v[0], y=v[1], z=v[2])


def _quaternion(q: Turn) -> Quaternion:
    return Quaternion(x=q[0], y=q[1], z=q[2], w=q[3])
