"""The pictures of a world at its frames: of a sensor that is a camera, and of the whole world from a corner.

One that a frame gives equals one that the packet of its tick gives, without modifiers of the sensor and noise of the
network.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import Final

from foosim.common.exact_math import tan
from foosim.rendering.pictures import Pictures, PictureSource
from foosim.rendering.readings import drawn_world
from foosim.world.assembly.world import initial_numbers
from foosim.world.component_types.payloads import PayloadCodec
from foosim.world.components.cameras import DEFAULT_FOV, PictureSettings, towards
from foosim.world.components.entities import mounting_of
from foosim.world.components.in_view import InView
from foosim.world.components.optics import Optics
from foosim.world.components.sight import Sight, looks_of
from foosim.world.components.view import View
from foosim.world.kinematics import forward_kinematics
from foosim.world.layout import Layout
from foosim.world.scene import Quaternion, Vector, conjugate, drawn, enclosing, moved, rotate, shape_box, swept_box
from foosim.world.spec import WorldSpec

OVERVIEW: Final = "overview"
WAY: Final[Vector] = (0.36, 0.48, -0.8)
"""The direction in which an overview looks, of length 1."""
FAR: Final = 4.0
"""How far an overview sees, in its distances from the middle."""
FOV_ABOVE: Final = 0.6
DOWN: Final[Quaternion] = (-0.5, 0.5, 0.5, 0.5)
"""Looks straight down, with the world's x to the right and its y up."""
GROUND_M: Final = 0.05
"""Lower scenery is ground: it does not widen an overview."""


def cameras_of(spec: WorldSpec) -> dict[tuple[str, str], PictureSettings]:
    """Return the settings of the cameras of a world, by robot and channel, in name order."""
    return {
        (robot, channel): settings
        for robot, its in sorted(spec.robots.items())
        for channel, settings in sorted(its.sensors.items())
        if isinstance(settings, PictureSettings)
    }


class Camera:
    """A camera of a world. `picture` of its readings draws them."""

    def __init__(self, spec: WorldSpec, layout: Layout, robot: str, channel: str) -> None:
        settings = cameras_of(spec)[robot, channel]
        self.robot, self.channel, self.settings = robot, channel, settings
        self.pictures: Final = Pictures(spec, settings, robot, channel)
        component = settings.component_type
        self._entity = layout[robot]
        self._sensor = component.factory(settings, mounting_of(spec, layout, self._entity))
        self._codec = PayloadCodec(component.value, component.name, self.pictures)
        self._schedule = spec.schedule(settings)

    def is_due(self, tick: int) -> bool:
        """Whether the camera takes a picture at a tick."""
        return self._schedule.is_due(tick)

    def at(self, tick: int, numbers: Sequence[float]) -> Sight | None:
        """Return the reading at a frame; None while its robot is absent."""
        if self._entity.is_absent(numbers):
            return None
        sight: Sight = self._sensor.sample(View(tick, numbers))
        sight.kept["drawn_by"] = self.pictures
        return sight

    def of(self, payload: bytes) -> Sight:
        """Return the reading in a packet. Raises Malformed."""
        sight: Sight = self._codec.decode(payload)
        return sight


class Overview:
    """The whole world, from a corner above it, or from straight above all that stands."""

    def __init__(self, spec: WorldSpec, layout: Layout, width: int, height: int, *, is_above: bool = False) -> None:
        """Raises AssetError without a mesh of the world."""
        fov, way, self._turned = (FOV_ABOVE, (0.0, 0.0, -1.0), DOWN) if is_above else (DEFAULT_FOV, WAY, towards(WAY))
        low, high = _shown(spec, layout)
        middle = moved(moved(low, low, -0.5), high, 0.5)
        corners = product((low[0], high[0]), (low[1], high[1]), (low[2], high[2]))
        seen = [rotate(conjugate(self._turned), moved(corner, middle, -1.0)) for corner in corners]
        away = max([max(abs(y), abs(z) * width / height) / tan(fov / 2.0) - x for x, y, z in seen])
        self._eye = moved(middle, way, -away)
        optics = Optics(width, height, fov, 0.01 * away, FAR * away, samples=2)
        self.pictures: Final = Pictures(spec, PictureSource(optics, ("image",), OVERVIEW), OVERVIEW, OVERVIEW)
        self._in_view = InView(optics, looks_of(mounting_of(spec, layout, layout.entities[0])))

    def at(self, tick: int, numbers: Sequence[float]) -> Sight:
        """Return the reading at a frame."""
        bodies = self._in_view.moving(list(numbers), self._eye, self._turned)
        sight = Sight(float(tick), *self._eye, *self._turned, tuple(bodies))
        sight.kept["drawn_by"] = self.pictures
        return sight


def _shown(spec: WorldSpec, layout: Layout) -> tuple[Vector, Vector]:
    """Return the box around scenery above the ground, else bodies on fixed bases, and free bodies at the beginning."""
    scene, numbers = drawn_world(spec, OVERVIEW).scene, initial_numbers(spec, layout)
    boxes = [box for shape in drawn(scene.scenery) if (box := shape_box(shape))[1][2] > GROUND_M]
    bodies = [body for body in scene.bodies.values() if any(link.shapes for link in body.links)]
    boxes = boxes or [swept_box(body) for body in bodies if not body.is_free]
    for body in bodies:
        entity = layout[body.name]
        if body.is_free and not entity.is_absent(numbers):
            base = forward_kinematics(body, entity, numbers)[0][1]
            low, high = swept_box(body)
            boxes.append((moved(low, base, 1.0), moved(high, base, 1.0)))
    return enclosing(boxes or [((-5.0, -5.0, 0.0), (5.0, 5.0, 0.0))])
