"""Checks between the settings of a hall: a rover's parts fit each other, and it fits into the hall."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from foosim.common import units
from foosim.common.finding import Finding, Location
from foosim.common.plain_data import PlainData
from foosim.world.parameters.hall import HALL

ROVER: Final[Location] = (HALL, "rover")


def hall_findings(data: PlainData) -> Iterator[Finding]:
    """Yield what is wrong between the settings of a hall."""
    radius, track = data.length(*ROVER, "radius"), data.length(*ROVER, "drive", "track")
    sides = [side for name in ("length", "width") if (side := data.length(HALL, name)) is not None]
    if radius is not None and sides and 2 * radius > min(sides):
        yield Finding((*ROVER, "radius"), "more than half of the hall's least side", data.get(*ROVER, "radius"))
    if radius is not None and track is not None and track > 2 * radius:
        what = "the wheels would be outside of the rover: more than twice its radius"
        yield Finding((*ROVER, "drive", "track"), what, data.get(*ROVER, "drive", "track"))
    location: Location = (*ROVER, "battery", "empty")
    empty, full = (data.quantity(units.VOLTAGE, *ROVER, "battery", key) for key in ("empty", "full"))
    if empty is not None and full is not None and not empty < full:
        yield Finding(location, "not below the full battery's voltage", data.get(*location))
