"""An entity that moves by kinematics stays within the reach of its speed in a tick."""

from __future__ import annotations

from typing import Any, Final

import pytest

from tests.kinematic_yard import TICK_S, Yard, yard_text

PATH: Final = {"shape": "sphere", "radius": "20 cm", "path": [{"x": "1 m"}, {"x": "2 m"}], "speed": "2 m/s"}
MODELS: Final[dict[str, tuple[dict[str, Any], float]]] = {
    "differential_drive": ({"speed": "1 m/s"}, 1.0),
    "holonomic": ({"speed": "2 m/s"}, 2.0),
    "rotorcraft": ({"speed": "3 m/s", "climb": "4 m/s"}, 5.0),
    "mover": (PATH, 2.0),
}


@pytest.mark.parametrize("model", MODELS)
def test_a_place_beyond_the_reach_of_a_tick_is_a_problem(model: str) -> None:
    settings, speed = MODELS[model]
    yard = Yard(yard_text({"r": {"model": model, **settings}}))
    entity, before = yard.layout["r"], list(yard.numbers)
    for share, is_valid in ((0.999, True), (1.001, False)):
        x, y, z = yard.vector("r", "position")
        yard.put("r", "position", x + 0.6 * share * speed * TICK_S, y, z + 0.8 * share * speed * TICK_S)
        assert (yard.stepper.world.problem(entity, yard.numbers, before, 0) == "") is is_valid
        yard.numbers[:] = before
