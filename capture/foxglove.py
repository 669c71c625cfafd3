"""The messages of a capture for viewers: scene, poses and log lines, as Foxglove's Protobuf.

Poses are every link's in the frame `world`, by the one forward kinematics. The scene hangs its shapes on the links
(`frame_locked`), so it is written once and when other bodies are present. Foxglove, Lichtblick and (but for the scene)
rerun decode them.
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
from foosim.world.assembly.presence import Presence
from foosim.world.assembly.world import build_scene
from foosim.world.frame import Frame
from foosim.world.kinematics import forward_kinematics
from foosim.world.layout import Entity
from foosim.world.matter.mesh import Mesh
from foosim.world.scene import Body, Box, Capsule, Hull, Shape, Sphere, Vector, drawn, looks_of, moved, rotate
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
    """Turns frames into messages for viewers. It remembers the entities in the newest scene."""

    def __init__(self, deployment: Deployment) -> None:
        self._deployment = deployment
        self._tick_ns = deployment.tick_ns
        self.poses_every = deployment.ticks(deployment.capture.poses_hz)
        """Ticks between two messages with poses."""
        self._bodies: list[tuple[Entity, Body]] = []
        self._scenery: tuple[Shape, ...] = ()
        self._presence: Presence | None = None
        self._absent: frozenset[int] = frozenset()

    def turn_to(self, frame: Frame) -> bytes | None:
        """Return the SceneUpdate of a frame in which others are present than in the one before; None where none are.

        It is the whole scene: a reader that begins with it needs none before it.
        """
        if self._presence is not None and self._presence.absent(frame.numbers) is self._absent:
            return None
        if self._presence is None:
            scene = build_scene(self._deployment, frame.layout)
            self._presence, self._scenery = Presence(frame.layout), scene.scenery
            self._bodies = [(frame.layout[name], body) for name, body in scene.bodies.items()]
        self._absent = self._presence.absent(frame.numbers)
        at = self._timestamp(frame.tick)
        gone = [link for entity, body in self._bodies if entity.index in self._absent for link in body.links]
        deletions = [
            SceneEntityDeletion(timestamp=at, type=SceneEntityDeletionType.MatchingId, id=link.name) for link in gone
        ]
        entities = [_entity(at, SCENERY, WORLD_FRAME, drawn(self._scenery))]
        for link, shapes in looks_of(link for _, body in self._present for link in body.links):
            entities.append(_entity(at, link.name, link.name, shapes))
        return SceneUpdate(deletions=deletions, entities=entities).encode()

    @property
    def _present(self) -> list[tuple[Entity, Body]]:
        return [(entity, body) for entity, body in self._bodies if entity.index not in self._absent]

    def poses(self, frame: Frame) -> bytes:
        """Return the FrameTransforms of all links at a frame of the scene that is shown."""
        at = self._timestamp(frame.tick)
        numbers = frame.numbers
        transforms = []
        for entity, body in self._present:
            for link, position, orientation in forward_kinematics(body, entity, numbers):
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
