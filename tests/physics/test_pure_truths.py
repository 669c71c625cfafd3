"""Physical truths of the pure engine alone: energy, rest, no tunnelling; those of both are in test_bullet_truths.py."""

from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

Make = Callable[..., Any]


@pytest.fixture
def pure(world: Make) -> Make:
    return lambda *sets: world("engine=pure", *sets)


@pytest.fixture(scope="module")
def perfect(request: pytest.FixtureRequest) -> Any:
    """A table on which nothing but friction takes energy."""
    make = request.getfixturevalue("lasting_world")
    names = ("floor", "walls", "goal", "ramps")
    return make("engine=pure", *(f"table.surfaces.{name}.restitution=1" for name in names))


@settings(max_examples=60)
@given(
    x=st.floats(-0.55, 0.55),
    y=st.floats(-0.3, 0.3),
    z=st.floats(0.03, 0.12),
    vx=st.floats(-15, 15),
    vy=st.floats(-15, 15),
    vz=st.floats(-3, 1),
)
def test_energy_of_a_free_ball_never_rises(
    perfect: Any, x: float, y: float, z: float, vx: float, vy: float, vz: float
) -> None:
    """Not even where every rebound is perfect, in corners, on ramps, at goal posts and over the walls."""
    rise, first, _ = perfect.energy_rises((x, y, z), (vx, vy, vz), ticks=250)
    assert rise <= 1e-14 * max(abs(first), 1e-3)


def test_a_ball_comes_to_rest(pure: Make) -> None:
    one = pure()
    rise, first, touches = one.energy_rises((0.2, 0.1, 0.1), (-5.0, 4.0, 0.0), ticks=12_000)
    assert rise <= 1e-15 * first and touches > 3
    assert one.velocity == [0.0, 0.0, 0.0] and one.spin[:2] == [0.0, 0.0]


@pytest.mark.parametrize("speed", [15.0, 40.0])
def test_no_ball_passes_a_wall(pure: Make, speed: float) -> None:
    one = pure()
    for phase in range(40):
        one.put((0.45 - phase / 40 * speed * one.tick_s / 4, 0.2, 0.04), (speed, 0.3 * speed, 0.0))
        for _ in range(20):
            one.tick()
            assert one.position[0] < one.table.field.length / 2 and one.position[1] < one.table.field.width / 2


def test_a_pinned_ball_stops_the_foot(pure: Make) -> None:
    """A foot that presses a ball against the side wall with 90 N stands still, and so does the ball."""
    one = pure()
    name = "red.defence"
    x = one.scene.bodies[name].position[0]
    radius, wall = one.table.ball.radius, one.table.field.width / 2
    one.put((x, wall - radius - 0.01, radius))
    one.set_rod(name, (0.14, 0.0), (0.0, 0.0))
    for _ in range(500):
        one.tick({name: ((2.0, one.table.drive.slide.force), (0.0, one.table.drive.spin.torque))})
        assert wall - radius - 0.011 < one.position[1] <= wall - radius + 1e-9
    stop = wall - 2 * radius - one.table.rod.foot.width / 2 - one.table.lines["defence"].pitch / 2
    assert one.of(name, "joint_positions", 1)[0] == pytest.approx(stop, abs=2e-3)
    assert one.of(name, "contacts", 1)[0] == 0.0  # the touch began long ago and has not ended
    assert one.of(name, "contacts", 3)[2] == one.deployment.substeps - 1
    assert max(abs(speed) for speed in (*one.velocity, *one.of(name, "joint_velocities", 2))) < 0.1
