"""Wind on rigid bodies: against the drag of a box, and set during a run."""

from __future__ import annotations

from functools import cache
from math import sqrt
from pathlib import Path
from typing import Any, Final

import pytest

from foosim.simulation.run import rehearse
from foosim.simulation.simulation import Simulation
from foosim.simulation.system import Settings
from foosim.world.frame import Frame
from tests.kinematic_yard import TICK_S, yard_text

NAME: Final = "yard.yaml"
DENSITY, GRAVITY, WIND = 1.2, 9.80665, 3.0


def cube(side: float, mass: float, **more: Any) -> dict[str, Any]:
    return {"model": "box", "size": [f"{side} m"] * 3, "mass": f"{mass} kg", "speed_limit": "20 m/s", **more}


def yard(wind: dict[str, Any] | None, events: list[dict[str, Any]] | None = None, /, **objects: Any) -> str:
    """Cubes and a robot that moves by kinematics on a great floor."""
    return yard_text(
        {"k": {"model": "holonomic", "at": {"x": "-9 m"}}},
        objects=objects,
        rules={} if wind is None else {"wind": {"kind": "wind", **wind}},
        events=events or [],
        engine="mujoco",
        substeps=4,
        scene={"kind": "empty", "length": "200 m", "width": "200 m"},
    )


def frames_of(text: str, ticks: int, nodes: int = 1) -> list[Frame]:
    frames: list[Frame] = []
    rehearse(text, NAME, ticks, nodes, settings=Settings(on_commit=frames.append))
    return frames


SLIDING: Final = {
    "light": cube(0.2, 0.1, surface="frictionless", at={"z": "10 cm"}),
    "heavy": cube(0.2, 10.0, at={"y": "1 m", "z": "10 cm"}),
}
TURNED: Final = [{"at": "3 s", "entity": "world", "set": {"wind.x": "-3 m/s", "wind.y": "1 m/s"}}]


@cache
def sliding(nodes: int) -> tuple[Frame, ...]:
    return tuple(frames_of(yard({"x": f"{WIND} m/s"}, TURNED, **SLIDING), 600, nodes))


def test_a_light_cube_drifts_by_the_drag_of_a_box_and_a_heavy_one_stays() -> None:
    """m v' = density / 2 x A (W - v)^2, so v = W - W / (1 + W c t) with c = density A / (2 m); viscosity adds 0.1 %."""
    c = DENSITY * 0.04 / (2.0 * 0.1)
    for frame in sliding(1)[20:300]:
        expected = WIND - WIND / (1.0 + WIND * c * frame.tick * TICK_S)
        assert frame.vector("light", "linear_velocity", 1)[0] == pytest.approx(expected, rel=0.02)
    last = sliding(1)[-1]
    assert last.vector("light", "linear_velocity", 2)[0] < -1.0 and last.vector("light", "position", 2)[1] > 0.3
    assert last.vector("heavy", "position", 2) == pytest.approx((0.0, 1.0), abs=1e-3)
    assert last.vector("k", "position", 2) == [-9.0, 0.0]


@pytest.mark.parametrize("lift", [0.0, 1.0])
def test_what_falls_comes_to_its_terminal_speed(lift: float) -> None:
    """v = sqrt(2 m g / (density A)) relative to the air."""
    cubes = {"c": cube(0.5, 0.1, at={"z": "60 m"})}
    last = frames_of(yard({"z": f"{lift} m/s"}, **cubes), 500)[-1]
    terminal = sqrt(2.0 * 0.1 * GRAVITY / (DENSITY * 0.25))
    assert last.vector("c", "linear_velocity", 3)[2] == pytest.approx(lift - terminal, rel=0.01)


def test_without_wind_there_is_no_air() -> None:
    last = frames_of(yard(None, c=cube(0.5, 0.1, at={"z": "60 m"})), 200)[-1]
    assert last.vector("c", "linear_velocity", 3)[2] == pytest.approx(-GRAVITY * 2.0, rel=1e-6)


def test_wind_that_rises_moves_what_was_at_rest(tmp_path: Path) -> None:
    file = tmp_path / NAME
    file.write_text(yard({}, **SLIDING))
    with Simulation(file, network=False) as simulation:
        simulation.step(ticks=100)
        assert simulation.frame.at("light", "still_ticks") >= 50
        simulation.set("world", "wind.x", "10 m/s")
        simulation.step(ticks=100)
        assert simulation.frame.vector("light", "position", 1)[0] > 1.0
        simulation.set("world", "wind.x", "0 m/s")
        simulation.step(ticks=1)
        assert simulation.frame.at("world", "wind.x") == 0.0
