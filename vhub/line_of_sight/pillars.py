"""Upright cylinders around bodies: they say which bodies a line of sight may pass."""

from __future__ import annotations

from typing import TypeAlias

from foosim.world.rays.boxes import MARGIN_M
from foosim.world.scene import Vector

Pillar: TypeAlias = tuple[str, float, float, float, float, float]
"""The name of a body, and an upright cylinder around it: x, y, the square of its radius, its least and greatest z (m).

A plain tuple, as every line of a frame is compared with each.
"""


def pillar(name: str, x: float, y: float, radius: float, low_z: float, high_z: float) -> Pillar:
    """Return a pillar that is a little larger than what is given."""
    radius += MARGIN_M
    return name, x, y, radius * radius, low_z - MARGIN_M, high_z + MARGIN_M


def pillars_met_by(pillars: list[Pillar], line: tuple[Vector, Vector]) -> list[str]:
    """Return the names whose pillars a line may pass, seen from above as if it had no ends: it says where to look."""
    (ax, ay, az), (bx, by, bz) = line
    way_x, way_y = bx - ax, by - ay
    square = way_x * way_x + way_y * way_y
    low_z, high_z = (az, bz) if az <= bz else (bz, az)
    met = []
    for name, x, y, reach, bottom, top in pillars:
        aside = (x - ax) * way_y - (y - ay) * way_x
        if aside * aside <= reach * square and top >= low_z and bottom <= high_z:
            met.append(name)
    return met
