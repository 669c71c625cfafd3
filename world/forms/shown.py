"""The messages of Foxglove by which captures show readings: what each needs of a reading and of its sensor's settings.

Here they are names; `capture.shown_readings` makes them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

from foosim.common.errors import show
from foosim.world.forms.payloads import PayloadCodec

if TYPE_CHECKING:
    from foosim.world.forms.forms import Component

POSE_IN_FRAME: Final = "foxglove.PoseInFrame"
LOCATION_FIX: Final = "foxglove.LocationFix"
LASER_SCAN: Final = "foxglove.LaserScan"

PLANAR_POSE: Final = ("x", "y", "heading")
"""In the world frame: m, m, rad from +x towards +y."""
POSE: Final = ("x", "y", "z", "qx", "qy", "qz", "qw")
"""In the world frame: m, and a unit quaternion."""


@dataclass(frozen=True, slots=True)
class Needed:
    """What a message needs: all fields of one of `choices`, a number each, or several where `is_several`; and what the
    settings have as an attribute."""

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


def shown_problems(found: Component) -> Iterator[str]:
    """Yield what is wrong with the message that a sensor names, if it names one."""
    if found.shown_as == "":
        return
    if found.shown_as not in tuple(MESSAGES):  # whatever it is
        yield f"shown_as is one of {', '.join(MESSAGES)}, not {show(found.shown_as)}"
        return
    needed = MESSAGES[found.shown_as]
    assert found.value is not None, "checked before"
    fields = PayloadCodec(found.value, found.name).fields
    there = {field.name for field in fields if (field.is_several if needed.is_several else field.is_number)}
    if not any(there.issuperset(choice) for choice in needed.choices):
        what = "tuples of numbers" if needed.is_several else "numbers"
        choices = " or ".join(", ".join(choice) for choice in needed.choices)
        yield f"its reading {found.value.__name__} lacks the {what} that {found.shown_as} shows: {choices}"
    for name in needed.settings:
        if name not in found.settings.model_fields and not hasattr(found.settings, name):
            yield f"its settings {found.settings.__name__} lack {name}, which {found.shown_as} shows"
