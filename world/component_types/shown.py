"""The Foxglove messages that show readings: the fields that each needs of a reading and of its sensor's settings.

Here they are names; `capture.shown_readings` builds them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

POSE_IN_FRAME: Final = "foxglove.PoseInFrame"
LOCATION_FIX: Final = "foxglove.LocationFix"
LASER_SCAN: Final = "foxglove.LaserScan"

PLANAR_POSE: Final = ("x", "y", "heading")
"""In the world frame: m, m, rad from +x towards +y."""
POSE: Final = ("x", "y", "z", "qx", "qy", "qz", "qw")
"""In the world frame: m, and a unit quaternion."""


@dataclass(frozen=True, slots=True)
class Needed:
    """The needs of a message: all fields of one of `choices`, a number each, or several where `is_several`; and an
    attribute of the settings."""

    choices: tuple[tuple[str, ...], ...]
    is_several: bool = False
    settings: tuple[str, ...] = ()


MESSAGES: Final[Mapping[str, Needed]] = MappingProxyType(
    {
        LASER_SCAN: Needed((("distances",),), is_several=True, settings=("bearings",)),
        LOCATION_FIX: Needed((("latitude", "longitude", "altitude"),)),
        POSE_IN_FRAME: Needed((PLANAR_POSE, POSE)),
    }
)
"""Distances are in m, `bearings` those of the first and the last (rad, from x towards y of the mount); latitude and
longitude are in degrees, altitude in m."""
