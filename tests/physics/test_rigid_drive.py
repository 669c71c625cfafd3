"""A rigid robot on two wheels against closed forms: it drives and turns as told, pushes as its wheels' friction and its
motors allow, and rests.
"""

from __future__ import annotations

from math import pi, sqrt
from typing import Any, Final

import pytest

from foosim.world.assembly.rest import REST_NS
from tests.kinematic_yard import TICK_S, Together, yard_text

GRAVITY: Final = 9.80665
FRICTION: Final = 0.8 * 0.8
"""Of two surfaces that a deployment says nothing of."""
CASTER_M: Final = 0.25 - 0.02
"""From the axle to a caster, of the default robot: the radius less the clearance."""
SUBSTEPS: Final = 4


def yard(sections: dict[str, Any] | None = None, **robot: Any) -> Together:
    bot = {"model": "differential_drive", "dynamics": "rigid", **robot}
    return Together(yard_text({"bot": bot}, engine="mujoco", substeps=SUBSTEPS, **(sections or {})))


def told(one: Together, linear: float, angular: float, ticks: int) -> None:
    one.put("bot", "motion.set_point", linear, angular)
    one.step(ticks)


@pytest.mark.parametrize("speed", [0.2, -0.5, 1.0])
def test_it_drives_straight_at_the_commanded_speed(speed: float) -> None:
    """After t seconds with the acceleration a: v t - v |v| / (2 a).

    Within a hundredth: where a wheel touches the floor differs by a little from one substep to the next. Leaning on a
    caster, by a hundredth of a wheel's radius, it is some millimetres ahead or behind.
    """
    one = yard()
    told(one, speed, 0.0, 200)
    before = one.vector("bot", "position")[0]
    one.step(100)
    x, y, _ = one.vector("bot", "position")
    assert x - before == pytest.approx(speed * 1.0, rel=0.01)
    assert x == pytest.approx(speed * 3.0 - speed * abs(speed) / 2.0, rel=0.01, abs=0.005)
    assert abs(y) < 0.01 * abs(x)
    left, right = one.vector("bot", "wheel_travel")
    assert left == pytest.approx(x, rel=0.01)
    assert right == pytest.approx(x, rel=0.01)
    assert one.vector("bot", "wheel_speeds") == pytest.approx([speed, speed], rel=0.01)


@pytest.mark.parametrize(("linear", "angular"), [(0.0, 2.0), (0.5, 1.0), (-0.3, -0.8)])
def test_it_turns_at_the_commanded_rate(linear: float, angular: float) -> None:
    """Within what the width of the wheels leaves open: each touches the floor anywhere along its 3 cm of 40 cm."""
    one = yard()
    told(one, linear, angular, 200)
    before = one.vector("bot", "heading")[0]
    assert one.vector("bot", "angular_velocity")[2] == pytest.approx(angular, rel=0.03 / 0.4)
    one.step(100)
    turned = (one.vector("bot", "heading")[0] - before + pi) % (2 * pi) - pi
    assert turned == pytest.approx(angular * 1.0, rel=0.03 / 0.4)
    vx, vy, _ = one.vector("bot", "linear_velocity")
    assert sqrt(vx * vx + vy * vy) == pytest.approx(abs(linear), abs=0.05)


def test_its_motors_accelerate_it_by_their_torque() -> None:
    """Both wheels push with 2 T / r what is as heavy as the robot and, rolling, twice half of a wheel."""
    one = yard(acceleration="50 m/s2", torque="1 N m", speed="2 m/s")
    told(one, 2.0, 0.0, 50)
    acceleration = 2 * 1.0 / 0.08 / (20.0 + 1.0)
    assert one.vector("bot", "linear_velocity")[0] == pytest.approx(acceleration * 50 * TICK_S, rel=0.03)
    assert one.vector("bot", "joint_efforts") == pytest.approx([1.0, 1.0], rel=0.01)


def test_on_little_friction_its_wheels_slip_and_push_as_that_allows() -> None:
    """The wheels have the commanded speed after a tenth of a second; the robot, which leans on a caster, gains at most
    mu g, and at least what the wheels carry of it."""
    slippery = {"surfaces": {"floor": {"friction": 0.05}}}
    one = yard(slippery, acceleration="10 m/s2", torque="20 N m")
    told(one, 1.0, 0.0, 100)
    mu = 0.05 * 0.8
    assert one.vector("bot", "wheel_speeds") == pytest.approx([1.0, 1.0], rel=0.01)
    print(one.vector("bot", "linear_velocity"))
    assert 0.9 * mu * GRAVITY < one.vector("bot", "linear_velocity")[0] <= 1.02 * mu * GRAVITY


BLOCK_M: Final = 0.06
"""How high the block is that a bumper, 2 cm above the floor, meets."""


def block(mass: float) -> dict[str, Any]:
    """A low box ahead, which slides and does not tip."""
    size = ["40 cm", "60 cm", f"{BLOCK_M} m"]
    return {
        "objects": {"block": {"model": "box", "size": size, "mass": f"{mass} kg", "at": {"x": "60 cm", "z": "3 cm"}}}
    }


def traction(height: float) -> float:
    """The greatest force with which the default robot pushes at a height (N).

    The force leans it on its rear caster, so that the wheels carry m g - F z / c: F = mu (m g - F z / c).
    """
    return FRICTION * 20.0 * GRAVITY / (1.0 + FRICTION * height / CASTER_M)


LEAST, MOST = traction(BLOCK_M), traction(0.02)
"""A bumper pushes somewhere between its lower edge and the height of the block."""


def strong(mass: float) -> Together:
    return yard(block(mass), torque="30 N m", surface="frictionless", bumper="40 cm")


def pushed(one: Together, ticks: int) -> float:
    """The mean force on the robot (N)."""
    total = 0.0
    for _ in range(ticks):
        one.step()
        total += sum(one.vector("bot", "partner_impulses"))
    return total / (ticks * TICK_S)


def test_it_pushes_what_the_friction_of_its_wheels_allows() -> None:
    mass = 0.9 * LEAST / (FRICTION * GRAVITY)
    one = strong(mass)
    told(one, 0.3, 0.0, 200)
    assert pushed(one, 100) == pytest.approx(FRICTION * mass * GRAVITY, rel=0.03)
    assert one.vector("block", "linear_velocity")[0] == pytest.approx(0.3, rel=0.03)


def test_it_does_not_push_more_than_the_friction_of_its_wheels_allows() -> None:
    """The wheels turn as they are told, and slip."""
    one = strong(1.1 * MOST / (FRICTION * GRAVITY))
    told(one, 0.3, 0.0, 200)
    at = one.vector("block", "position")[0]
    force = pushed(one, 100)
    print(f"{force:.1f} N, between {LEAST:.1f} and {MOST:.1f}")
    assert 0.97 * LEAST < force < 1.03 * MOST
    assert one.vector("block", "position")[0] == pytest.approx(at, abs=0.002)
    assert one.vector("bot", "wheel_speeds") == pytest.approx([0.3, 0.3], abs=0.01)


def test_it_does_not_push_more_than_its_motors_can() -> None:
    """2 T / r, which is less than the friction of its wheels allows: these stand still."""
    one = yard(block(40.0), torque="3 N m", surface="frictionless", bumper="40 cm")
    told(one, 0.3, 0.0, 200)
    assert pushed(one, 100) == pytest.approx(2 * 3.0 / 0.08, rel=0.03)
    assert one.vector("bot", "wheel_speeds") == pytest.approx([0.0, 0.0], abs=0.01)


@pytest.mark.parametrize("is_driven", [False, True])
def test_it_rests_without_drift(is_driven: bool) -> None:
    """From the start, and after a drive: half a second after it stands it is at rest, to the last bit."""
    one = yard()
    if is_driven:
        told(one, 0.5, 1.0, 150)
        told(one, 0.0, 0.0, 100)
    one.step(round(REST_NS / 1e9 / TICK_S) + 200)
    rest = list(one.numbers)
    assert one.vector("bot", "linear_velocity") == [0.0, 0.0, 0.0]
    assert one.vector("bot", "wheel_speeds") == [0.0, 0.0]
    one.step(100)
    assert one.numbers == rest
    told(one, 0.2, 0.0, 100)
    assert one.vector("bot", "linear_velocity")[0] == pytest.approx(0.2 * one_ahead(one), abs=0.01)


def one_ahead(one: Together) -> float:
    """The share of its way ahead that goes along x of the world."""
    _, y, z, _ = one.vector("bot", "orientation")
    return 1.0 - 2.0 * (y * y + z * z)


def test_a_state_that_is_not_finite_comes_into_quarantine() -> None:
    """What follows from it is not derived: the tick goes on to the check of all states."""
    one = yard()
    one.step()
    solve = one.engine.solve  # type: ignore[union-attr]

    def failing(*arguments: Any) -> None:
        solve(*arguments)
        one.put("bot", "orientation", float("nan"))

    one.engine.solve = failing  # type: ignore[method-assign, union-attr]
    with pytest.raises(AssertionError, match=r"bot is in quarantine for 1 s, .*: its new orientation is nan"):
        one.step()


def test_it_starts_on_its_wheels() -> None:
    """Within the gap of its casters nothing moves when it is set down."""
    one = yard(at={"z": "0 m", "yaw": "30 deg"})
    start = one.vector("bot", "position")
    one.step(50)
    assert one.vector("bot", "position") == pytest.approx(start, abs=0.001)
    assert one.vector("bot", "contacts")[0] == 0.0
