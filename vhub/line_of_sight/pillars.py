"""Upright cylinders around bodies: they say which bodies a line of sight may pass."""

from __future__ import annotations

from foosim.world.rays.boxes import MARGIN_M
from foosim.world.scene import Vector


class Pillar:
    """An upright cylinder around a body: its x and y, the square of its radius, its least and greatest z (m); its name.

    It is a little larger than what is given.
    """

    __slots__ = ("high_z", "low_z", "name", "reach", "x", "y")

    def __init__(self, name: str, x: float, y: float, radius: float, low_z: float, high_z: float) -> None:
        radius += MARGIN_M
        self.name, self.x, self.y, self.reach = name, x, y, radius * radius
        self.low_z, self.high_z = low_z - MARGIN_M, high_z + MARGIN_M


def pillars_met_by(pillars: list[Pillar], line: tuple[Vector, Vector]) -> list[str]:
    """Return the names whose pillars a line may pass, seen from above as if it had no ends: it says where to look."""
    (ax, ay, az), (bx, by, bz) = line
    way_x, way_y = bx - ax, by - ay
    square = way_x * way_x + way_y * way_y
    low_z, high_z = (az, bz) if az <= bz else (bz, az)
    met = []
    for pillar in pillars:
        aside = (pillar.x - ax) * way_y - (pillar.y - ay) * way_x
        if aside * aside <= pillar.reach * square and pillar.high_z >= low_z and pillar.low_z <= high_z:
            met.append(pillar.name)
    return met
