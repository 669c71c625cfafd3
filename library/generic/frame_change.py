"""Change of the frame of reference: positions, directions, headings and orientations as another frame has them.

A point p of the world is R^T (p - o) in a frame whose origin is at o and which is turned by R about the world's z.
"""

from __future__ import annotations

from math import pi
from typing import Annotated, Final

from foosim.common import units
from foosim.common.errors import BadValue
from foosim.common.exact_math import cos, sin
from foosim.common.spec_base import default
from foosim.common.units import Quantity
from foosim.world.component_types.per_field import Numbers
from foosim.world.component_types.registry import modifier
from foosim.world.component_types.settings import ModifierSettings
from foosim.world.components.base import Modifier
from foosim.world.components.view import ModifierMounting, View

Length = Annotated[float, Quantity(units.LENGTH, "-100 km", "100 km")]
Angle = Annotated[float, Quantity(units.ANGLE, "-360 deg", "360 deg")]
POSITION, DIRECTION, HEADING, ORIENTATION = "position", "direction", "heading", "orientation"
GROUPS: Final = (POSITION, DIRECTION, HEADING, ORIENTATION)
"""Groups of fields that are other numbers in another frame: x, y and maybe z of a point, those of a velocity or force,
an angle from +x towards +y, a quaternion x, y, z, w. A field of such a name is a group of its own."""


class FrameChangeSettings(ModifierSettings):
    """Gives positions, directions, headings and orientations in a frame at `x`, `y`, `z`, turned by `yaw` about z."""

    x: Length = default("0 m")
    y: Length = default("0 m")
    z: Length = default("0 m")
    yaw: Angle = default("0 deg")


@modifier("frame_change", FrameChangeSettings)
class FrameChange(Modifier):
    """Gives positions, directions, headings and orientations in another frame."""

    def __init__(self, settings: FrameChangeSettings, at: ModifierMounting) -> None:
        self._origin = settings.x, settings.y, settings.z
        self._yaw = settings.yaw
        self._cos, self._sin = cos(settings.yaw), sin(settings.yaw)
        self._points, self._directions, self._headings = (at.numbers.places(group) for group in GROUPS[:3])
        self._orientations = at.numbers.places(ORIENTATION)
        self._half_cos, self._half_sin = cos(0.5 * settings.yaw), sin(0.5 * settings.yaw)

    @staticmethod
    def check(settings: FrameChangeSettings, numbers: Numbers) -> None:
        """Raise BadValue where nothing changes with the frame."""
        if not any(map(numbers.places, GROUPS)):
            fields = ", ".join(field.name for field in numbers.fields)
            raise BadValue(f"none of {fields} is a {', '.join(GROUPS[:-1])} or {GROUPS[-1]}", settings.kind)

    def apply(self, values: list[float], view: View) -> list[float]:
        """Return the values in the frame."""
        changed = list(values)
        for places, origin in ((self._points, self._origin), (self._directions, (0.0, 0.0, 0.0))):
            if places:
                moved = [values[place] - origin[axis] for axis, place in enumerate(places)]
                east, north = moved[0], moved[1]
                moved[0], moved[1] = east * self._cos + north * self._sin, north * self._cos - east * self._sin
                for place, value in zip(places, moved, strict=True):
                    changed[place] = value
        for place in self._headings:
            heading = values[place] - self._yaw
            changed[place] = heading - 2.0 * pi if heading > pi else heading + 2.0 * pi if heading <= -pi else heading
        if self._orientations:
            x, y, z, w = (values[place] for place in self._orientations)
            c, s = self._half_cos, self._half_sin
            turned = c * x + s * y, c * y - s * x, c * z - s * w, c * w + s * z
            for place, value in zip(self._orientations, turned, strict=True):
                changed[place] = value
        return changed
