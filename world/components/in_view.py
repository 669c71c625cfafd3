"""The moving bodies in the view of a camera. Compiled: each picture goes through all of them."""

from __future__ import annotations

from math import sqrt
from typing import Final

from foosim.common.exact_math import tan
from foosim.world.component_types.descriptions import ABSENT, POSE
from foosim.world.components.optics import Optics
from foosim.world.layout import Entity
from foosim.world.scene import Body, Quaternion, Vector, conjugate, moved, rotate

MOTION: Final = "linear_velocity", "angular_velocity", "joint_velocities"
DISTORTED: Final = 2.5
"""A lens with distortion sees up to half a picture more at each side (`rendering.lens`), and a few pixels."""


class Looks:
    """A body with moving links that look like something; `links` are the index and the number of each.

    It lies within `radius` of a place (m): of a free body the position in its state, of any other `place`; the ways of
    joints that slide come to it. `pose` and `motion` are the places in a frame of what its pictures depend on, as runs
    (first, end): without `motion` it does not blur.
    """

    def __init__(self, body: Body, entity: Entity, place: Vector, radius: float, links: list[tuple[int, int]]) -> None:
        self.body, self.entity, self.place, self.radius, self.links = body, entity, place, radius, links
        offsets, joints = entity.offsets, body.joints
        self.absent_at: int = offsets.get(ABSENT, -1)
        self.free_at: int = offsets[POSE[0]] if body.is_free else -1
        used = [0, 1] * body.is_free + [2] * bool(joints)
        self.pose = [self._run(POSE[n]) for n in used]
        is_swift = all(MOTION[n] in offsets for n in used if n != 1)
        moving = [n for n in used if is_swift and MOTION[n] in offsets]
        self.motion = [self._run(MOTION[n]) for n in moving]
        slides = [link.joint == "prismatic" for link in joints]
        self.slides: list[int] = [offsets[POSE[2]] + n for n, it_slides in enumerate(slides) if it_slides]
        self.speeds: list[tuple[int, bool]] = []
        """The places of all numbers of its motion; whether it is a turn."""
        for n, (first, end) in zip(moving, self.motion, strict=True):
            self.speeds += [(at, n == 1 or (n == 2 and not slides[at - first])) for at in range(first, end)]

    def _run(self, field: str) -> tuple[int, int]:
        return self.entity.offsets[field], self.entity.offsets[field] + self.entity.counts[field]

    def runs(self, exposure: float) -> list[tuple[int, int]]:
        """Return the places of what a picture with this exposure (s) depends on."""
        return self.pose + (self.motion if exposure > 0.0 else [])


class InView:
    """The moving bodies in the view of one camera."""

    def __init__(self, optics: Optics, bodies: list[Looks]) -> None:
        self.bodies = [(looks, float(number), looks.runs(optics.exposure)) for number, looks in enumerate(bodies)]
        self.exposure: float = optics.exposure
        self.far: float = optics.far
        self.wide: float = tan(optics.fov / 2.0) * (DISTORTED if any(optics.distortion) else 1.0)
        self.high: float = self.wide * optics.height / optics.width
        self.beside: float = sqrt(1.0 + self.wide * self.wide)
        self.above: float = sqrt(1.0 + self.high * self.high)
        self.is_all_around: bool = optics.shadows
        self._pose: tuple[Vector, Quaternion] | None = None
        self._aways: list[float] = []

    def moving(self, numbers: list[float], eye: Vector, orientation: Quaternion) -> list[float]:
        """Return the numbers of the bodies that touch the view from a pose (m, world frame), as `Seen.bodies`.

        With shadows these are all within `far`: what is beside the view throws shadows into it.
        """
        found: list[float] = []
        back = conjugate(orientation)
        if self._pose != (eye, orientation):  # a camera that stands keeps how far bodies are that stand
            self._pose = eye, orientation
            self._aways = [self.away(rotate(back, moved(looks.place, eye, -1.0))) for looks, _, _ in self.bodies]
        for (looks, number, runs), away_standing in zip(self.bodies, self._aways, strict=True):
            if looks.absent_at >= 0 and numbers[looks.absent_at] != 0.0:
                continue
            at, away, radius = looks.free_at, away_standing, looks.radius
            for slide in looks.slides:
                radius += abs(numbers[slide])
            if self.exposure > 0.0:
                arm = 2.0 * radius
                for place, is_turn in looks.speeds:
                    radius += abs(numbers[place]) * (arm if is_turn else 1.0) * self.exposure
            if at >= 0:
                away = self.away(rotate(back, moved((numbers[at], numbers[at + 1], numbers[at + 2]), eye, -1.0)))
            if away <= radius:
                found.append(number)
                for first, end in runs:
                    found += numbers[first:end]
        return found

    def away(self, middle: Vector) -> float:
        """Return the least radius with which a sphere there in the frame of the camera (m) touches its view."""
        x, y, z = middle
        if self.is_all_around:
            return sqrt(x * x + y * y + z * z) - self.far
        return max(-x, x - self.far, (abs(y) - x * self.wide) / self.beside, (abs(z) - x * self.high) / self.above)
