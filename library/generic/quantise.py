"""Quantisation: each number becomes the nearest multiple of a step, as an encoder or a converter gives it."""

from __future__ import annotations

from math import floor

from foosim.world.component_types.per_field import PerField
from foosim.world.component_types.registry import modifier
from foosim.world.component_types.settings import ModifierSettings
from foosim.world.components.base import Modifier
from foosim.world.components.view import ModifierMounting, View


class QuantiseSettings(ModifierSettings):
    """Rounds each number to the nearest multiple of `step`, upwards from the middle; a step of 0 leaves it."""

    step: PerField


@modifier("quantise", QuantiseSettings, per_field={"step": 0.0})
class Quantise(Modifier):
    """Rounds each number to a multiple of a step."""

    def __init__(self, settings: QuantiseSettings, at: ModifierMounting) -> None:
        self._steps = at.per_field(settings.step, 0.0)

    def apply(self, values: list[float], view: View) -> list[float]:
        """Return the values, rounded."""
        return [
            value if step == 0.0 else step * floor(value / step + 0.5)
            for value, step in zip(values, self._steps, strict=True)
        ]
