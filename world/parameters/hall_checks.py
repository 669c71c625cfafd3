"""Checks between the settings of a hall: a rover's parts fit each other, and it fits into the hall."""

from __future__ import annotations

from collections.abc import Iterator

from foosim.common.finding import Finding
from foosim.world.parameters.hall import HALL, Hall


def hall_findings(hall: Hall) -> Iterator[Finding]:
    """Yield what is wrong between the settings of a hall."""
    rover = hall.rover
    if 2 * rover.radius > min(hall.length, hall.width):
        yield Finding((HALL, "rover", "radius"), "more than half of the hall's least side")
    if rover.drive.track > 2 * rover.radius:
        what = "the wheels would be outside of the rover: more than twice its radius"
        yield Finding((HALL, "rover", "drive", "track"), what)
    if rover.battery.empty >= rover.battery.full:
        yield Finding((HALL, "rover", "battery", "empty"), "not below the full battery's voltage")
