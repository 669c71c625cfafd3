"""Pictures of the table: by the kernel in C, by its twin in numpy, and by the software renderer of Bullet.

All draw the same shapes in the same places: colours, depth and segmentation, without shadows. Rods and balls have moved
before each picture. Times are of the processor, medians by turns. The first picture of a frame is one of a camera that
was elsewhere before; the second is another camera's of the same frame; the standing one is that of a camera that draws
its next frame.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from math import degrees
from statistics import median
from typing import Any, Final
from unittest.mock import patch

import numpy as np
import pybullet
from numpy.typing import NDArray

from bench.runs import ROOT
from foosim.common import exact_math
from foosim.deployment.loader import load_deployment
from foosim.kernels import raster
from foosim.rendering.drawer import Drawer
from foosim.world.assembly.world import build_scene, initial_numbers
from foosim.world.components.optics import Optics, moving_links
from foosim.world.kinematics import forward_kinematics
from foosim.world.layout import Layout, build_layout
from foosim.world.matter.mesh import Mesh
from foosim.world.scene import Box, Capsule, Cylinder, Hull, Scene, Shape, Sphere, drawn, looks_of, place, rotate

SIZES: Final = ((320, 180), (640, 480))
TURNS: Final = 15
EYE: Final = (0.0, 0.0, 1.1)
DOWN: Final = (-0.5, 0.5, 0.5, 0.5)
"""Looks down, the long side of the table from left to right."""
STEP_M: Final = 1e-4


@dataclass(frozen=True, slots=True)
class Pictures:
    """Milliseconds of processor time for a picture of this size, by what draws it; ratios in the same run."""

    width: int
    height: int
    ms: dict[str, float]
    of_bullet: dict[str, float]
    of_first: dict[str, float]


class TinyRenderer:
    """The software renderer of Bullet, with the shapes of a scene."""

    def __init__(self, scene: Scene, layout: Layout) -> None:
        self._client = pybullet.connect(pybullet.DIRECT)
        self._moving: list[tuple[int, Shape, int]] = []
        self._things: list[int] = []
        scenery = list(dict.fromkeys(shape.name for shape in scene.scenery))
        for shape in drawn(scene.scenery):
            self._add(shape, len(layout.names) + scenery.index(shape.name), shape.position, shape.orientation)
        moving = moving_links(scene.bodies)
        bodies = sorted(scene.bodies.items())
        looks = iter(looks_of(link for _, body in bodies for link in body.links))
        for name, body in bodies:
            for index, (_, position, orientation) in enumerate(
                forward_kinematics(body, layout[name], [0.0] * layout.size)
            ):
                for shape in next(looks)[1]:
                    where = place(shape, position, orientation)
                    number = self._add(shape, layout[name].index, *where)
                    if (name, index) in moving:
                        self._moving.append((number, shape, moving.index((name, index))))

    def _add(self, shape: Shape, thing: int, position: Any, orientation: Any) -> int:
        geometry = shape.geometry
        kind: dict[str, Any]
        if isinstance(geometry, Box):
            kind = {"shapeType": pybullet.GEOM_BOX, "halfExtents": geometry.half}
        elif isinstance(geometry, Sphere):
            kind = {"shapeType": pybullet.GEOM_SPHERE, "radius": geometry.radius}
        elif isinstance(geometry, Cylinder | Capsule):
            form = pybullet.GEOM_CYLINDER if isinstance(geometry, Cylinder) else pybullet.GEOM_CAPSULE
            kind = {"shapeType": form, "radius": geometry.radius, "length": geometry.length}
        else:
            mesh = geometry.mesh if isinstance(geometry, Hull) else geometry
            assert isinstance(mesh, Mesh)
            corners = {"vertices": mesh.vertices.tolist(), "indices": mesh.triangles.reshape(-1).tolist()}
            kind = {"shapeType": pybullet.GEOM_MESH, **corners}
        visual = pybullet.createVisualShape(rgbaColor=shape.colour, physicsClientId=self._client, **kind)
        self._things.append(thing)
        return int(pybullet.createMultiBody(0.0, -1, visual, position, orientation, physicsClientId=self._client))

    def place(self, poses: NDArray[np.float64]) -> None:
        """Place moving links (n, 7)."""
        for number, shape, link in self._moving:
            x, y, z, *orientation = poses[link].tolist()
            where = place(shape, (x, y, z), tuple(orientation))
            pybullet.resetBasePositionAndOrientation(number, *where, physicsClientId=self._client)

    def draw(self, optics: Optics, position: Any, orientation: Any) -> tuple[NDArray[Any], NDArray[Any]]:
        """Return colour (height, width, 4) and segmentation, as `Drawer.draw` numbers it."""
        ahead, up = (rotate(orientation, axis) for axis in ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0)))
        aspect = optics.width / optics.height
        fov = 2.0 * exact_math.atan(exact_math.tan(optics.fov / 2.0) / aspect)
        target = [a + b for a, b in zip(position, ahead, strict=True)]
        _, _, colour, _, numbers = pybullet.getCameraImage(
            *(optics.width, optics.height, pybullet.computeViewMatrix(position, target, up)),
            pybullet.computeProjectionMatrixFOV(degrees(fov), aspect, optics.near, optics.far),
            shadow=0,
            renderer=pybullet.ER_TINY_RENDERER,
            physicsClientId=self._client,
        )
        things = np.array([*self._things, -1]) + 1
        return colour, things[np.reshape(numbers, (optics.height, optics.width))]

    def close(self) -> None:
        """End the client of Bullet."""
        pybullet.disconnect(self._client)


def poses_of(scene: Scene, layout: Layout, numbers: list[float]) -> NDArray[np.float64]:
    """Return the poses (n, 7) of the links that move."""
    found = []
    for name, index in moving_links(scene.bodies):
        _, position, orientation = forward_kinematics(scene.bodies[name], layout[name], numbers)[index]
        found.append((*position, *orientation))
    return np.array(found).reshape(-1, 7)


def rendering() -> list[Pictures]:
    """Draw the table of deploy/ in all ways, by turns."""
    path = ROOT / "deploy" / "table.yaml"
    deployment = load_deployment(path.read_text(), path.name)
    layout = build_layout(deployment)
    scene = build_scene(deployment, layout)
    poses = poses_of(scene, layout, initial_numbers(deployment, layout))
    tiny = TinyRenderer(scene, layout)
    found = [_measured(width, height, Drawer(scene, layout), tiny, poses) for width, height in SIZES]
    tiny.close()
    return found


def _measured(width: int, height: int, drawer: Drawer, tiny: TinyRenderer, poses: NDArray[np.float64]) -> Pictures:
    optics = Optics(width, height, 1.25, 0.05, 10.0)
    numbers = np.arange(len(poses))
    times: dict[str, list[float]] = {}

    def timed(name: str, draw: Callable[..., Any], *given: Any) -> None:
        begun_ns = time.process_time_ns()
        draw(optics, *given)
        times.setdefault(name, []).append((time.process_time_ns() - begun_ns) / 1e6)

    for turn in range(TURNS):
        moved = poses.copy()
        moved[:, 0] += STEP_M * turn
        aside = STEP_M * (turn + 1)
        tiny.place(moved)
        timed("bullet", tiny.draw, (0.0, aside, EYE[2]), DOWN)
        timed("first", drawer.draw, (0.0, aside, EYE[2]), DOWN, numbers, moved)
        timed("second", drawer.draw, (0.0, -aside, EYE[2]), DOWN, numbers, moved)
        drawer.draw(optics, EYE, DOWN, numbers, moved)
        timed("standing", drawer.draw, EYE, DOWN, numbers, poses)
        with patch.object(raster, "C", None):
            timed("numpy", drawer.draw, (aside, aside, EYE[2]), DOWN, numbers, moved)
    ms = {name: median(some) for name, some in times.items()}
    of_bullet = {name: ms[name] / ms["bullet"] for name in ("first", "numpy")}
    return Pictures(width, height, ms, of_bullet, {name: ms[name] / ms["first"] for name in ("second", "standing")})


def lines(found: list[Pictures]) -> list[str]:
    """Return the figures in lines."""
    made = []
    for size in found:
        ms = ", ".join(f"{name} {value:.1f}" for name, value in size.ms.items())
        made.append(f"{size.width}x{size.height}: ms of processor time: {ms}")
        ratios = [f"{name} / bullet {value:.2f}" for name, value in size.of_bullet.items()]
        ratios += [f"{name} / first {value:.2f}" for name, value in size.of_first.items()]
        made.append(f"  {', '.join(ratios)}")
    return made
