"""The pictures of a deployment's cameras, drawn from their readings where these are looked at."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foosim.common.errors import BadValue, Malformed
from foosim.common.keyed_random import draw_key, draw_words
from foosim.common.limits import COUNTER_MAX
from foosim.rendering.drawer import Drawer, Drawn
from foosim.rendering.readings import drawn_world
from foosim.world.components.cameras import PictureSettings
from foosim.world.components.optics import Optics
from foosim.world.components.sight import Sight
from foosim.world.spec import WorldSpec


def drawer_of(spec: WorldSpec, what: str) -> Drawer:
    """Return what draws a world for all its cameras. Raises AssetError without its files, for `what`."""
    world = drawn_world(spec, what)
    return spec.shared("drawer", lambda: Drawer(world.scene, world.layout))


class PictureSource(NamedTuple):
    """What is drawn: with which optics, which pictures, and the name of the kind."""

    optics: Optics
    pictures: Sequence[str]
    kind: str


class PictureShape(NamedTuple):
    """The shape and the type of pictures of a kind, and the greatest value of a pixel."""

    shape: tuple[int, ...]
    form: type[np.generic]
    most: float


class Pictures:
    """Draws the readings of one camera, at their first look: the reading keeps what was drawn."""

    def __init__(self, spec: WorldSpec, settings: PictureSettings | PictureSource, robot: str, channel: str) -> None:
        self._spec, self._optics, self._kinds = spec, settings.optics, settings.pictures
        self._what = f"{settings.kind} {channel} of {robot}"
        self._key = draw_key(spec.seed, "picture", robot, channel)
        self._newest: tuple[Sight, Drawn] | None = None
        """The last drawn reading: it may have been decoded more than once."""
        self.draws = 0
        """The count of pictures that were drawn."""

    def picture(self, kind: str, sight: Sight) -> NDArray[Any]:
        """Return the `image`, `depth` or `segmentation` of a reading.

        Raises BadValue for one that the camera does not have, AssetError without a mesh of the world, Malformed for a
        reading that the network has changed.
        """
        if kind not in self._kinds:
            has = " and ".join(f"{one}()" for one in self._kinds)
            raise BadValue(f"{self._what} has {has} alone", kind)
        drawn = sight.kept.get("drawn")
        if drawn is None:
            if self._newest is None or self._newest[0] != sight:
                self._newest = sight, self._draw(sight)
            drawn = sight.kept["drawn"] = self._newest[1]
        found: NDArray[Any] = getattr(drawn, "colour" if kind == "image" else kind)
        return found

    def shapes(self) -> dict[str, PictureShape]:
        """Return the shapes of the camera's pictures, by their kind."""
        shape = self._optics.height, self._optics.width
        shapes = {
            "image": PictureShape((*shape, 3), np.uint8, 255.0),
            "depth": PictureShape(shape, np.float32, self._optics.far),
            "segmentation": PictureShape(shape, np.int32, float(np.iinfo(np.int32).max)),
        }
        return {kind: shapes[kind] for kind in self._kinds}

    @property
    def names(self) -> tuple[str, ...]:
        """The names of what a segmentation has: number n is `names[n - 1]`, 0 is nothing."""
        return drawer_of(self._spec, self._what).things

    def _draw(self, sight: Sight) -> Drawn:
        optics, drawer = self._optics, drawer_of(self._spec, self._what)
        links = drawn_world(self._spec, self._what).placed(sight, self._what, optics.exposure)
        if not 0.0 <= sight.tick <= COUNTER_MAX:
            raise Malformed(f"{self._what}: no tick, {sight.tick:g}")
        self.draws += 1
        return drawer.draw(
            optics,
            (sight.x, sight.y, sight.z),
            (sight.qx, sight.qy, sight.qz, sight.qw),
            links.numbers,
            links.poses,
            links.velocities if optics.exposure else None,
            draw_words(self._key, int(sight.tick))[0] if optics.noise else 0,
        )
