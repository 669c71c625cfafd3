"""What is drawn from readings: the scene of their world, and the moving links of the bodies in them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foosim.common.errors import Malformed
from foosim.world.assembly.world import build_scene
from foosim.world.components.in_view import Looks
from foosim.world.components.sight import Seen, moving_bodies
from foosim.world.kinematics import forward_kinematics, twist
from foosim.world.layout import Layout, build_layout
from foosim.world.matter.mesh import AssetError
from foosim.world.scene import ORIGIN, Scene
from foosim.world.scenery import read_contents
from foosim.world.spec import WorldSpec


class Links(NamedTuple):
    """Links by number, their poses (n, 7) and velocities (n, 6): all 0 without an exposure."""

    numbers: NDArray[np.intp]
    poses: NDArray[np.float64]
    velocities: NDArray[np.float64]


class DrawnWorld(NamedTuple):
    """A world, the layout of which numbers its bodies and links."""

    scene: Scene
    layout: Layout
    bodies: list[Looks]

    def placed(self, seen: Seen, what: str, exposure: float = 0.0) -> Links:
        """Return the links of the bodies in a reading; Malformed for one that the network has changed."""
        given, frame = seen.bodies, [0.0] * self.layout.size
        numbers: list[int] = []
        poses: list[tuple[float, ...]] = []
        velocities: list[tuple[float, ...]] = []
        start = 0
        while start < len(given):
            if not (0.0 <= given[start] < len(self.bodies) and given[start].is_integer()):
                raise Malformed(f"{what}: numbers of bodies are 0 to {len(self.bodies) - 1}")
            looks = self.bodies[int(given[start])]
            start += 1
            for first, end in looks.runs(exposure):
                frame[first:end] = given[start : start + end - first]
                start += end - first
            if start > len(given):
                raise Malformed(f"{what}: the last body has too few numbers")
            at = forward_kinematics(looks.body, looks.entity, frame)
            for index, number in looks.links:
                numbers.append(number)
                poses.append((*at[index][1], *at[index][2]))
                blurs = exposure and looks.motion
                linear, angular = twist(looks.body, looks.entity, frame, index) if blurs else (ORIGIN, ORIGIN)
                velocities.append((*linear, *angular))
        return Links(np.array(numbers, np.intp), np.array(poses).reshape(-1, 7), np.array(velocities).reshape(-1, 6))


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
    return DrawnWorld(scene, layout, moving_bodies(scene.bodies, layout))
