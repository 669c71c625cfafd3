"""Draws the pictures of one layout's world."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foosim.world.components.optics import Optics
from foosim.world.layout import Layout
from foosim.world.scene import Quaternion, Scene, Vector


class Drawn(NamedTuple):
    """One picture: `colour` (height, width, 3) of red, green, blue from 0 to 255; `depth` (height, width), the distance
    along the camera's axis (m), 0 where nothing is seen; `segmentation` (height, width), 1 + the number of the thing in
    `Drawer.things`, 0 where nothing is seen."""

    colour: NDArray[np.uint8]
    depth: NDArray[np.float32]
    segmentation: NDArray[np.int32]


class Drawer:
    """Scenery and the fixed links of a scene are prepared once, moving links are placed for each picture.

    `things` are the names of what is seen: entities by their index in the layout, then scenery (as `Caster.things`).
    """

    def __init__(self, scene: Scene, layout: Layout) -> None:
        raise NotImplementedError

    def draw(
        self,
        optics: Optics,
        position: Vector,
        orientation: Quaternion,
        numbers: NDArray[np.intp],
        poses: NDArray[np.float64],
        velocities: NDArray[np.float64] | None = None,
        key: int = 0,
    ) -> Drawn:
        """Return what a camera at a pose (m, world frame) sees.

        Of the links that move (`optics.moving_links`), those in view are given by `numbers` (n,), with the `poses` of
        their frames (n, 7): position (m) and orientation (x, y, z, w) in the world frame. `velocities` (n, 6) (m/s,
        rad/s) blur them where the optics have an exposure. `key` is that of the draws of noise.
        """
        raise NotImplementedError
