"""A bias that walks: an offset of each number that begins with a draw and changes by one at each value.

Between two values the offset changes by a normal draw of standard deviation walk * sqrt(t), t being the period: a
Wiener process at the values' times (the rate random walk of an inertial sensor, IEEE Std 952).
"""

from __future__ import annotations

from math import sqrt

from foosim.world.component_types.per_field import PerField
from foosim.world.component_types.registry import modifier
from foosim.world.component_types.settings import ModifierSettings
from foosim.world.components.base import Modifier, slot
from foosim.world.components.view import ModifierMounting, WritableView

STEP, START = 0, 1
"""Slots of the draws."""


class BiasWalkSettings(ModifierSettings):
    """Adds an offset that walks: `initial` is its standard deviation at the start, `walk` that of a second's change.

    The default is 0.
    """

    initial: PerField | None = None
    walk: PerField | None = None


@modifier("bias_walk", BiasWalkSettings, per_field={"initial": 0.0, "walk": 0.0})
class BiasWalk(Modifier):
    """Adds an offset that walks to each number; the offset is in the frame."""

    _offset = slot(lambda settings, carrier: carrier.size)

    def __init__(self, settings: BiasWalkSettings, at: ModifierMounting) -> None:
        from foosim.common.batched.noise import NoiseAhead, NoiseKey  # brings numpy, which readers of settings need not

        initial, draws = at.per_field(settings.initial, 0.0), NoiseKey(at.key).normal(0, at.numbers.size, START)
        self._start = [std * one for std, one in zip(initial, draws, strict=True)]
        self._step = [std * sqrt(at.period_s) for std in at.per_field(settings.walk, 0.0)]
        self._steps = NoiseAhead(at.key, at.numbers.size, at.period_ticks, STEP)

    def apply(self, values: list[float], view: WritableView) -> list[float]:
        """Return the values with the present offsets, and let these walk on."""
        walked = view.read(self._offset)
        draws = self._steps.normal(view.tick)
        view.write(self._offset, *(way + std * one for way, std, one in zip(walked, self._step, draws, strict=True)))
        return [value + start + way for value, start, way in zip(values, self._start, walked, strict=True)]
