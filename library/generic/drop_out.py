"""Drop-outs: some readings are not sent, some commands not taken."""

from __future__ import annotations

from typing import Annotated

from foosim.common import units
from foosim.common.units import Quantity
from foosim.world.component_types.registry import modifier
from foosim.world.component_types.settings import ModifierSettings
from foosim.world.components.base import Modifier
from foosim.world.components.view import ModifierMounting, View

Probability = Annotated[float, Quantity(units.PROBABILITY, "0 %", "100 %")]


class DropOutSettings(ModifierSettings):
    """Drops each value with this `probability`, whatever happened to the others."""

    probability: Probability


@modifier("drop_out", DropOutSettings)
class DropOut(Modifier):
    """Drops some values."""

    def __init__(self, settings: DropOutSettings, at: ModifierMounting) -> None:
        from foosim.common.batched.noise import NoiseKey  # brings numpy, which readers of settings do not need

        self._probability = settings.probability
        self._stream = NoiseKey(at.key)

    def apply(self, values: list[float], view: View) -> list[float] | None:
        """Return the values, or None where they are dropped."""
        return None if self._stream.uniform(view.tick, 1, view.count)[0] < self._probability else values
