"""The frames of a deployment as pages draw them: scene, moments, overlays; each moment as packed float32.

The poses are those of `world.kinematics.forward_kinematics`. A link that hangs on the world by fixed joints alone, or
by one free joint, needs no arithmetic: its pose is constant, or seven numbers of the frame, which are taken for all
such links at once. The poses and numbers of absent entities are NaN.
"""

from __future__ import annotations

import struct
from collections.abc import Collection, Mapping, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from foosim.common.errors import BadValue, UnknownName
from foosim.console.shown.overlays import Overlays
from foosim.console.shown.scene_json import scene_content
from foosim.console.shown.source import Moment
from foosim.console.shown.tracks import Pose
from foosim.deployment.schema import Deployment
from foosim.rendering.cameras import Camera, cameras_of
from foosim.rendering.png import encode_png, visible
from foosim.world.assembly.world import build_scene
from foosim.world.component_types.descriptions import ABSENT
from foosim.world.frame import Frame
from foosim.world.kinematics import forward_kinematics
from foosim.world.layout import Entity, Layout, build_layout
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
        """The poses of fixed links; the rows of other links are overwritten."""
        self._jointed: list[tuple[int, Body, Entity]] = []
        leaving = [entity for entity in layout.entities if entity.can_leave]
        self._flags = np.array([entity.offsets[ABSENT] for entity in leaving], np.intp)
        """The slots that flag absent entities."""
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
        """Return the places of absent entities in the list of entities that can be absent."""
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


class Drawing:
    """One deployment's world."""

    def __init__(self, deployment: Deployment) -> None:
        """`deployment` has the contents of the files that it names."""
        self.deployment, self.layout = deployment, build_layout(deployment)
        self.scene = build_scene(deployment, self.layout)
        self.poser = Poser(self.layout, self.scene)
        bodies = self.scene.bodies.items()
        names = [link.name for _, body in bodies for link in body.links]
        self.links: dict[str, int] = {name: place for place, name in enumerate(names)}
        """The place of each link in the order of the scene, by name."""
        self.entities: dict[str, int] = {name: self.links[body.links[-1].name] for name, body in bodies}
        """That of each entity's last link, by the entity's name."""
        self._overlays: Overlays | None = None
        self._cameras: dict[tuple[str, str], Camera] = {}

    def known(self, poses: Mapping[str, Pose]) -> NDArray[np.float32]:
        """Return poses of links by name, in the order of the scene; NaN for links without one."""
        rows = np.full((len(self.links), 7), np.nan, np.float32)
        for link, (position, orientation) in poses.items():
            place = self.links.get(link)
            if place is not None:
                rows[place] = (*position, *orientation)
        return rows

    def content(self) -> dict[str, Any]:
        """Return the scene as pages read it."""
        return scene_content(self.deployment, self.layout, self.scene)

    def moment(self, frame: Frame, jump: bool = False, paused: bool = False) -> Moment:
        """Return the moment of a frame."""
        values = frame.values
        return Moment(frame.tick, self.poser.poses(values), self.poser.numbers(values), jump, paused)

    def picture(self, frame: Frame, robot: str, channel: str, kind: str, payload: bytes = b"") -> bytes:
        """Return the picture of a camera's packet, without one what it sees at a frame, as PNG.

        Raises UnknownName without such a camera, BadValue for one of another kind or an absent robot, AssetError.
        """
        key = robot, channel
        if key not in self._cameras:
            known = cameras_of(self.deployment)
            if key not in known:
                raise UnknownName("no camera", f"{robot}/{channel}", [f"{one}/{other}" for one, other in known])
            self._cameras[key] = Camera(self.deployment, self.layout, robot, channel)
        camera = self._cameras[key]
        sight = camera.of(payload) if payload else camera.at(frame.tick, frame.numbers)
        if sight is None:
            raise BadValue("its robot is absent", f"{robot}/{channel}")
        return encode_png(visible(kind, sight.picture(kind)))

    def overlays(self, frame: Frame, wanted: Collection[str]) -> list[dict[str, Any]]:
        """Return the message with these overlays, and a note of each sensor that cannot be drawn from here on."""
        if self._overlays is None:
            self._overlays = Overlays(self.deployment, self.layout)
        content = self._overlays.content(frame, wanted)
        notes = [{"type": "note", "level": "error", "text": text} for text in self._overlays.failures()]
        return [content, *notes]
