"""Gaussian noise: independent normal draws are added to the numbers of a reading or command."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from typing import TYPE_CHECKING

from foosim.world.component_types.per_field import PerField
from foosim.world.component_types.registry import modifier
from foosim.world.component_types.settings import ModifierSettings
from foosim.world.components.base import Modifier
from foosim.world.components.rows import Rows
from foosim.world.components.view import ModifierMounting, View

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


class GaussianNoiseSettings(ModifierSettings):
    """Adds a normal draw to each number: `std` is the standard deviation, of each field or of all.

    Values at an end of the sensor's range stay: they mean no measurement. The result is within that range.
    """

    std: PerField


@modifier("gaussian_noise", GaussianNoiseSettings, per_field={"std": 0.0})
class GaussianNoise(Modifier):
    """Adds a normal draw to each number."""

    def __init__(self, settings: GaussianNoiseSettings, at: ModifierMounting) -> None:
        from foosim.common.batched.noise import (  # brings numpy, which readers of settings do not need
            NoiseAhead,
            NoiseKey,
        )

        self.std = at.per_field(settings.std, 0.0)
        self.low, self.high = at.low, at.high
        self._is_bounded = any(map(isfinite, (*at.low, *at.high)))
        self.key = at.key
        self._stream, self._ahead = NoiseKey(at.key), NoiseAhead(at.key, at.numbers.size, at.period_ticks)

    def apply(self, values: list[float], view: View) -> list[float]:
        """Return the values with noise."""
        count = view.count
        noise = self._stream.normal(view.tick, len(values), count) if count else self._ahead.normal(view.tick)
        if not self._is_bounded:
            return [value + std * one for value, std, one in zip(values, self.std, noise, strict=True)]
        return [
            value if not low < value < high else min(max(value + std * one, low), high)
            for value, std, one, low, high in zip(values, self.std, noise, self.low, self.high, strict=True)
        ]

    @staticmethod
    def together(modifiers: Sequence[GaussianNoise]) -> GaussianNoises:
        """Return these as one, for values of shape (modifiers, numbers)."""
        return GaussianNoises(modifiers)


class GaussianNoises(Rows):
    """Several of them, of values of one length."""

    def __init__(self, modifiers: Sequence[GaussianNoise]) -> None:
        import numpy as np

        from foosim.common.batched.noise import NoiseKeys

        self._keys = NoiseKeys([one.key for one in modifiers])
        self._std = np.array([one.std for one in modifiers])
        self._low, self._high = (np.array(bounds) for bounds in zip(*((m.low, m.high) for m in modifiers), strict=True))
        self._is_bounded = bool(np.isfinite(self._low).any() or np.isfinite(self._high).any())

    def apply(self, values: NDArray[np.float64], view: View) -> NDArray[np.float64]:
        """Return the values with noise."""
        noisy: NDArray[np.float64] = values + self._std * self._keys.normal(view.tick, values.shape[1], view.count)
        if self._is_bounded:
            import numpy as np

            inside = (values > self._low) & (values < self._high)
            noisy = np.where(inside, np.minimum(np.maximum(noisy, self._low), self._high), values)
        return noisy
