"""The scans of laser scanners, by rays cast from their readings where these are looked at."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from foosim.rendering.readings import DrawnWorld, Links, drawn_world
from foosim.world.components.optics import moving_links
from foosim.world.components.sight import Seen
from foosim.world.kinematics import forward_kinematics
from foosim.world.rays.boxes import Floats
from foosim.world.rays.caster import Placement
from foosim.world.rays.shapes import NOTHING, Forms, Part, Placed, Poses, rotated_each
from foosim.world.rays.solids import Meshes
from foosim.world.rays.sorted_boxes import SortedBoxes
from foosim.world.scene import ORIGIN, UPRIGHT
from foosim.world.spec import WorldSpec

FAR_M: Final = 1e9
"""Where links are that a reading does not have: they are beyond the range."""


class _Casting:
    """The solid shapes of a world: what stands is placed once, moving links whenever a reading is."""

    def __init__(self, world: DrawnWorld) -> None:
        scene, layout = world.scene, world.layout
        numbers = {link: number for number, link in enumerate(moving_links(scene.bodies))}
        still: list[Part] = [(shape, NOTHING, 0, ORIGIN, UPRIGHT) for shape in scene.scenery]
        moving: list[Part] = []
        for name, body in sorted(scene.bodies.items()):
            its = forward_kinematics(body, layout[name], [0.0] * layout.size) if body.is_solid else ()
            for index, (_, position, orientation) in enumerate(its):
                number, thing = numbers.get((name, index)), layout[name].index
                for shape in body.links[index].shapes:
                    if number is None:
                        still.append((shape, thing, 0, position, orientation))
                    else:
                        moving.append((shape, thing, number, ORIGIN, UPRIGHT))
        self._forms, self._count = Forms([*still, *moving], Meshes()), len(numbers)
        self._moving = slice(len(still), None)
        self._still = Poses(self._forms, slice(len(still)), np.array([ORIGIN]).T, np.array([UPRIGHT]).T)
        self._near = SortedBoxes(*self._still.boxes())

    def placement(self, links: Links) -> Placement:
        """Return all things where they are in a reading."""
        poses = np.full((self._count, 7), (FAR_M, FAR_M, FAR_M, *UPRIGHT))
        poses[links.numbers] = links.poses
        moving = Poses(self._forms, self._moving, poses.T[:3], poses.T[3:])
        columns = np.concatenate((self._still.columns, moving.columns), axis=1)
        return Placement(Placed(self._forms, columns, [self._near, SortedBoxes(*moving.boxes())]))


class Scans:
    """Casts the rays of the readings of one laser scanner, at their first look: the reading keeps their distances."""

    def __init__(self, spec: WorldSpec, settings: Any, robot: str, channel: str) -> None:
        self._spec, self._settings, self._robot = spec, settings, robot
        self._what = f"{settings.kind} {channel} of {robot}"
        self._directions = np.array(settings.directions)[None]

    def ranges(self, seen: Seen) -> Floats:
        """Return the distances (m), (rows, columns), between the least and the range."""
        its = self._settings
        found: Floats = np.clip(self._distances(seen), its.least, its.range).reshape(its.rows, its.columns)
        return found

    def points(self, seen: Seen) -> Floats:
        """Return the places that are met from the least distance on, (n, 3), in the frame of the mount (m)."""
        distances = self._distances(seen)
        met = np.isfinite(distances) & (distances >= self._settings.least)
        found: Floats = self._directions[0, met] * distances[met, None]
        return found

    def _distances(self, seen: Seen) -> Floats:
        found: Floats | None = seen.kept.get("drawn")
        if found is None:
            world = drawn_world(self._spec, self._what)
            casting = self._spec.shared("casting", lambda: _Casting(world))
            turn = np.array([[seen.qx], [seen.qy], [seen.qz], [seen.qw]])
            found = casting.placement(world.placed(seen, self._what)).fans(
                np.array([[seen.x], [seen.y], [seen.z]]),
                rotated_each(turn, self._directions),
                np.array([self._settings.range]),
                np.array([world.layout[self._robot].index]),
            )[0]
            seen.kept["drawn"] = found
        return found
