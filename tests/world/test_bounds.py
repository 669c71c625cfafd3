"""The limits of an actuator's commands, for commands of any type."""

from __future__ import annotations

from math import inf, nan

import pytest
from msgspec import Struct

from foosim.world.component_types.payloads import PayloadCodec
from foosim.world.components.base import Actuator
from foosim.world.components.bounds import CommandBounds


class Speeds(Struct, frozen=True):
    slide: float
    spin: float


class Mixed(Struct, frozen=True):
    mode: str
    count: int | None
    speeds: tuple[float, ...]


class Limited(Actuator):
    def __init__(self, limits: dict[str, tuple[float, float]], at: None) -> None:
        self._limits = limits

    def limits(self) -> dict[str, tuple[float, float]]:
        return self._limits

    def names(self) -> tuple[str, ...]:
        return ()


@pytest.mark.parametrize("number", [nan, inf, -inf])
def test_what_a_modifier_makes_infinite_is_refused(number: float) -> None:
    bounds = CommandBounds(Limited({"slide": (-1.0, 1.0), "spin": (-2.0, 2.0)}, None), PayloadCodec(Speeds, "speeds"))
    assert bounds.clamp(Speeds(0.0, number)) is None
    assert bounds.clamp(Speeds(3.0, -5.0)) == (Speeds(1.0, -2.0), [("slide", "", 3.0, 1.0), ("spin", "", -5.0, -2.0)])


def test_fields_of_any_type_are_clamped_and_keep_it() -> None:
    bounds = CommandBounds(Limited({"count": (0.0, 5.0), "speeds": (-1.0, 1.0)}, None), PayloadCodec(Mixed, "mixed"))
    free = Mixed("go", None, (0.5, -0.5))
    assert bounds.clamp(free) == (free, ())
    found = bounds.clamp(Mixed("go", 9, (0.5, -4.0)))
    assert found is not None and found[0] == Mixed("go", 5, (0.5, -1.0)) and type(found[0].count) is int
    assert [one.limit for one in found[1]] == [5.0, -1.0]
