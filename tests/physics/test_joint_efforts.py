"""What the motors of a rod applied in a tick's last substep, by closed forms, in both engines."""

from collections.abc import Callable
from math import sin
from typing import Any

import pytest

Make = Callable[..., Any]
NAME = "red.goal"
FORCE, TORQUE = 90.0, 0.5

engines = pytest.mark.parametrize("engine", ["bullet", "pure"])


def efforts(one: Any) -> Any:
    return one.of(NAME, "joint_efforts", 2)


@engines
@pytest.mark.parametrize("part", [0.25, 0.5])
def test_a_drive_shows_what_it_needs_in_the_last_substep(world: Make, engine: str, part: float) -> None:
    """All before at its limits, and then a part of these."""
    one = world(f"engine={engine}", "table.gravity=0 m/s2")
    substeps = one.deployment.substeps
    seconds = (substeps - 1 + part) * one.tick_s / substeps
    wanted = FORCE / one.rod_mass(NAME) * seconds, TORQUE / one.rod_inertia(NAME) * seconds
    one.tick({NAME: ((wanted[0], FORCE), (wanted[1], TORQUE))}, ball=False)
    assert one.of(NAME, "joint_velocities", 2) == pytest.approx(wanted, rel=1e-12)
    assert efforts(one) == pytest.approx([part * FORCE, part * TORQUE], rel=1e-9)


@engines
@pytest.mark.parametrize("angle", [0.0, 0.7, -1.5, 3.0])
def test_at_rest_a_drive_holds_the_weight_of_the_figures(world: Make, engine: str, angle: float) -> None:
    """m g r sin(angle); nothing along the slide, which is level."""
    one = world(f"engine={engine}")
    link = one.scene.bodies[NAME].links[1]
    one.set_rod(NAME, (0.0, angle), (0.0, 0.0))
    for _ in range(10):
        one.tick({NAME: ((0.0, FORCE), (0.0, TORQUE))}, ball=False)
    weight = -link.mass * one.table.gravity * link.centre_of_mass[2] * sin(angle)
    assert efforts(one) == pytest.approx([0.0, weight], abs=1e-12)
    assert one.of(NAME, "joint_positions", 2) == pytest.approx([0.0, angle], abs=1e-12)


@engines
def test_a_motor_without_a_force_or_a_command_has_no_effort(world: Make, engine: str) -> None:
    """Whatever it did before: Bullet itself would tell what it applied when it last had a force."""
    one = world(f"engine={engine}")
    for motors, wanted in (
        (((1000.0, FORCE), (1000.0, TORQUE)), [FORCE, TORQUE]),
        (((1000.0, 0.0), (1000.0, TORQUE)), [0.0, TORQUE]),
        (((1000.0, FORCE), (1000.0, TORQUE)), [FORCE, TORQUE]),
    ):
        one.tick({NAME: motors}, ball=False)
        assert efforts(one) == wanted
    one.engine.load([one.layout[NAME]], one.numbers)
    one.engine.step(one.deployment.substeps)
    one.engine.read([one.layout[NAME]], one.numbers)
    assert efforts(one) == [0.0, 0.0]
