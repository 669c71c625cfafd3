"""The pictures of a deployment's cameras, drawn from their readings where these are looked at."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from foosim.common.errors import BadValue, Malformed
from foosim.common.keyed_random import draw_key, draw_words
from foosim.rendering.drawer import Drawer, Drawn
from foosim.world.assembly.world import build_scene
from foosim.world.components.cameras import PictureSettings
from foosim.world.components.optics import moving_links
from foosim.world.components.sight import LINK, LINK_BLURRED, Sight
from foosim.world.layout import build_layout
from foosim.world.matter.mesh import AssetError
from foosim.world.spec import WorldSpec


class _Drawing:
    """What all cameras of a deployment are drawn with."""

    def __init__(self, spec: WorldSpec) -> None:
        spec.check_robot_files(spec.asset_files)
        layout = build_layout(spec)
        scene = build_scene(spec, layout)
        self.drawer, self.links = Drawer(scene, layout), len(moving_links(scene))


class Pictures:
    """Draws the readings of one camera, at their first look: the reading keeps what was drawn."""

    def __init__(self, spec: WorldSpec, settings: PictureSettings, robot: str, channel: str) -> None:
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

    @property
    def names(self) -> tuple[str, ...]:
        """The names of what a segmentation has: number n is `names[n - 1]`, 0 is nothing."""
        return self._drawing().drawer.things

    def _drawing(self) -> _Drawing:
        found = self._spec.shared("drawing", lambda: _Drawing(self._spec))
        assert isinstance(found, _Drawing)
        return found

    def _draw(self, sight: Sight) -> Drawn:
        try:
            drawing = self._drawing()
        except (AssetError, Malformed) as error:
            raise AssetError(f"{self._what} cannot be drawn here without the files of the world: {error}") from error
        optics, size = self._optics, LINK_BLURRED if self._optics.exposure else LINK
        if len(sight.links) % size:
            raise Malformed(f"{self._what}: links of {len(sight.links)} numbers, each has {size}")
        links = np.array(sight.links).reshape(-1, size)
        numbers = links[:, 0]
        if not ((numbers >= 0) & (numbers < drawing.links) & (numbers % 1.0 == 0.0)).all():
            raise Malformed(f"{self._what}: numbers of links are 0 to {drawing.links - 1}")
        self.draws += 1
        return drawing.drawer.draw(
            optics,
            (sight.x, sight.y, sight.z),
            (sight.qx, sight.qy, sight.qz, sight.qw),
            numbers.astype(np.intp),
            links[:, 1:LINK],
            links[:, LINK:] if optics.exposure else None,
            draw_words(self._key, max(0, int(sight.tick)))[0] if optics.noise else 0,
        )
