"""Clipping: each number is held within a range, as by a saturated converter."""

from __future__ import annotations

from math import inf

from foosim.common.errors import BadValue
from foosim.world.component_types.per_field import Numbers, PerField, read_per_field
from foosim.world.component_types.registry import modifier
from foosim.world.component_types.settings import ModifierSettings
from foosim.world.components.base import Modifier
from foosim.world.components.view import ModifierMounting, View


class ClipSettings(ModifierSettings):
    """Holds each number within `low` and `high`; a field that is in neither keeps its range."""

    low: PerField | None = None
    high: PerField | None = None


@modifier("clip", ClipSettings, per_field={"low": None, "high": None})
class Clip(Modifier):
    """Holds each number within a range."""

    def __init__(self, settings: ClipSettings, at: ModifierMounting) -> None:
        self._low = at.per_field(settings.low, -inf)
        self._high = at.per_field(settings.high, inf)

    @staticmethod
    def check(settings: ClipSettings, numbers: Numbers) -> None:
        """Raise BadValue for a range without a number in it."""
        if settings.low is not None and settings.high is not None:
            both = zip(read_per_field(settings.low, numbers), read_per_field(settings.high, numbers), strict=True)
            for place, (low, high) in enumerate(both):
                if low is not None and high is not None and low > high:
                    raise BadValue(f"low is above the high of {numbers.field(place).name}, {high}", low)

    def apply(self, values: list[float], view: View) -> list[float]:
        """Return the values, held within their ranges."""
        return [min(max(value, low), high) for value, low, high in zip(values, self._low, self._high, strict=True)]
