"""A cat that hunts a mouse with two eyes, at four levels of abstraction.

Its controller is that of MORSE's tutorial: straight on while both eyes see the mouse, a curve to the side of the one
eye that does, and turning on the spot while neither does. The kind of its eyes decides what seeing is: pixels of the
mouse's colour, a low thing on the ground by its distance, or the mouse itself, with its place. A cat that goes to
places is sent to that place instead.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from math import cos, hypot, sin
from typing import Any, Final

import numpy as np

from foosim.client.player import Commands, Player, Samples
from foosim.common.errors import BadValue
from foosim.deployment.schema import Deployment
from foosim.library.generic.camera import CameraSettings
from foosim.library.generic.depth_camera import DepthCameraSettings
from foosim.library.generic.pose import Pose
from foosim.library.generic.semantic_camera import SeenEntities, SemanticCameraSettings
from foosim.library.mobile.go_to import GoToSettings, Place
from foosim.library.mobile.v_w import Motion
from foosim.world.components.sight import Sight

EYES: Final = "left", "right"
MOTIONS: Final = {
    (True, True): Motion(2.0, 0.0),
    (True, False): Motion(1.5, 1.0),
    (False, True): Motion(1.5, -1.0),
    (False, False): Motion(0.0, -1.0),
}
"""The motion (m/s, rad/s) by whether the left and the right eye see the mouse."""
BLUER: Final = 1.5  # times as blue as red and as green is the mouse
PIXELS_MIN: Final = 8  # of fewer pixels it is not seen
NEARER: Final = 0.9  # what stands on the ground is nearer than this share of the distance of the ground,
APART_M: Final = 1.0  # and if it is no part of a taller thing, by this nearer than that
NEAR_M: Final = 2.0  # a cat that goes to places looks to its right when it is this near to where the mouse was seen


class Cat(Player):
    """The player. Its robot has the eyes `left` and `right`, of one kind, and a `pose`, which destinations need."""

    def __init__(self, deployment: Deployment, parameters: Mapping[str, Any]) -> None:
        """It has no parameters. Raises BadValue."""
        if parameters:
            raise BadValue("a cat has no parameters", sorted(parameters))
        self._deployment = deployment
        self._place: Place | None = None

    def act(self, tick: int, samples: Samples) -> Commands:
        """Return a motion, or a destination."""
        (cat,) = self.robots
        if any((cat, name) not in samples for name in (*EYES, "pose")):
            return {}
        its = self._deployment.robots[cat]
        looks: list[tuple[Any, Any]] = [(its.sensors[eye], samples[cat, eye].value) for eye in EYES]
        if isinstance(its.actuators["motion"], GoToSettings):
            pose = samples[cat, "pose"].value
            assert isinstance(pose, Pose)
            return {cat: self._destination(looks, pose)}
        left, right = [SEES[type(eye)](eye, seen) for eye, seen in looks]
        return {cat: MOTIONS[left, right]}

    def _destination(self, looks: Sequence[tuple[SemanticCameraSettings, SeenEntities]], pose: Pose) -> Place:
        """Return the place where the mouse was seen last; near that, and before, one to the right."""
        c, s = cos(pose.heading), sin(pose.heading)
        seen = [(eye.at.x + it.position[0], eye.at.y + it.position[1]) for eye, its in looks for it in its.objects]
        for ahead, left in seen[:1]:
            self._place = Place(pose.x + ahead * c - left * s, pose.y + ahead * s + left * c)
        if self._place is None or (not seen and hypot(self._place.x - pose.x, self._place.y - pose.y) < NEAR_M):
            self._place = None
            return Place(pose.x + NEAR_M * s, pose.y - NEAR_M * c)
        return self._place


def sees_colour(eye: CameraSettings, seen: Sight) -> bool:
    """Whether a picture has the colour of the mouse below its horizon, above which the sky is blue."""
    red, green, blue = np.moveaxis(seen.image()[eye.height // 2 :].astype(np.float32), 2, 0)
    return int(((blue > BLUER * red) & (blue > BLUER * green)).sum()) >= PIXELS_MIN


def sees_depth(eye: DepthCameraSettings, seen: Sight) -> bool:
    """Whether something stands on the ground that is lower than the eye.

    The axis of the eye is level, so what is above its middle row is taller.
    """
    depths, middle = seen.depth(), eye.height // 2
    far = np.where(depths > 0.0, depths, np.float32(eye.far))
    pixels = eye.width / 2.0 / np.tan(eye.angle / 2.0)  # for each m aside at a distance of 1 m
    ground = eye.at.z * pixels / (np.arange(eye.height - middle) + 0.5)
    is_low = (far[middle:] < NEARER * ground[:, None]) & (far[middle:] < far[:middle].min(axis=0) - APART_M)
    return int(is_low.sum()) >= PIXELS_MIN


def sees_entity(_: SemanticCameraSettings, seen: SeenEntities) -> bool:
    """Whether a mouse is among the entities in view."""
    return bool(seen.objects)


SEES: Final[Mapping[type, Callable[[Any, Any], bool]]] = {
    CameraSettings: sees_colour,
    DepthCameraSettings: sees_depth,
    SemanticCameraSettings: sees_entity,
}
