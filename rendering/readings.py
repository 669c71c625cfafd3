"""What is drawn from readings: the scene of their world, and the moving links in them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foosim.common.errors import Malformed
from foosim.world.assembly.world import build_scene
from foosim.world.components.optics import moving_links
from foosim.world.components.sight import LINK, Seen
from foosim.world.layout import Layout, build_layout
from foosim.world.matter.mesh import AssetError
from foosim.world.scene import Scene
from foosim.world.scenery import read_contents
from foosim.world.spec import WorldSpec


class Links(NamedTuple):
    """Links by number, their poses (n, 7), and what else is known of each (n, more)."""

    numbers: NDArray[np.intp]
    poses: NDArray[np.float64]
    more: NDArray[np.float64]


class DrawnWorld(NamedTuple):
    """A world, the layout of which numbers its links."""

    scene: Scene
    layout: Layout
    links: list[tuple[str, int]]

    def placed(self, seen: Seen, what: str, size: int = LINK) -> Links:
        """Return the links of a reading with `size` numbers each; Malformed for one that the network has changed."""
        if len(seen.links) % size:
            raise Malformed(f"{what}: links of {len(seen.links)} numbers, each has {size}")
        links = np.array(seen.links).reshape(-1, size)
        numbers = links[:, 0]
        if not ((numbers >= 0) & (numbers < len(self.links)) & (numbers % 1.0 == 0.0)).all():
            raise Malformed(f"{what}: numbers of links are 0 to {len(self.links) - 1}")
        return Links(numbers.astype(np.intp), links[:, 1:LINK], links[:, LINK:])


def drawn_world(spec: WorldSpec, what: str) -> DrawnWorld:
    """Return the world that all readings of a deployment are drawn in. Raises AssetError without its files."""
    return spec.shared("drawn world", lambda: _built(spec, what))


def _built(spec: WorldSpec, what: str) -> DrawnWorld:
    fetched = spec.fetched
    try:
        if fetched:
            spec = spec.with_contents(read_contents(spec.scenery, fetched, spec.robot_files(fetched)))
        spec.check_robot_files(spec.asset_files)
        layout = build_layout(spec)
        scene = build_scene(spec, layout)
    except (AssetError, Malformed) as error:
        raise AssetError(f"{what} cannot be drawn here without the files of the world: {error}") from error
    return DrawnWorld(scene, layout, moving_links(scene))
