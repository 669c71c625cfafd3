"""What both engines promise to a node, beyond physics: the contact log, motors, and independence of what is parked."""

from collections.abc import Iterator
from math import sqrt
from operator import mul
from pathlib import Path

import pytest

from foosim.deployment.loader import apply_sets, load_deployment
from foosim.library.table.settings import table_of
from foosim.node.physics.interface import Engine
from foosim.world.assembly.world import initial_numbers
from foosim.world.layout import Layout, build_layout
from foosim.world.scene import Vector
from tests.placing import place_ball
from tests.shared_engine import make_shared_engine

TEXT = (Path(__file__).parents[2] / "deploy" / "table.yaml").read_text()
TABLE = load_deployment(TEXT, "table.yaml")
LAYOUT = build_layout(TABLE)
BALL, ROD = LAYOUT["ball"], LAYOUT["red.goal"]
ENGINES = ["bullet", "pure"]
OFF = ((0.0, 0.0), (0.0, 0.0))


@pytest.fixture(params=ENGINES)
def engine(request: pytest.FixtureRequest) -> Iterator[Engine]:
    settings = apply_sets(TEXT, "table.yaml", [f"engine={request.param}", "table.contact_erp=0"])
    made = make_shared_engine(load_deployment(settings, "table.yaml"), LAYOUT)
    yield made
    made.close()


def tick(engine: Engine, layout: Layout, numbers: list[float], *rods: str) -> None:
    bodies = [layout["ball"], *(layout[name] for name in rods)]
    engine.load(bodies, numbers)
    engine.command(bodies[1:], [OFF for _ in rods])
    engine.step(TABLE.substeps)
    engine.read(bodies, numbers)


def contacts(numbers: list[float], name: str = "ball") -> list[float]:
    start = LAYOUT[name].offsets["contacts"]
    return numbers[start : start + 3]


def test_a_bounce_is_logged_once_with_its_impulse(engine: Engine) -> None:
    numbers = initial_numbers(TABLE, LAYOUT)
    place_ball(numbers, BALL, (0.0, 0.3, 0.1), (0.0, 3.0, 0.0))
    logs = []
    for _ in range(20):
        tick(engine, LAYOUT, numbers)
        logs.append(contacts(numbers))
    touched = [log for log in logs if log != [0.0, 0.0, -1.0]]
    assert len(touched) == 1
    count, impulse, last = touched[0]
    assert count == 1.0 and 0 <= last < TABLE.substeps
    bounce = 1 + table_of(TABLE).surfaces.walls.restitution
    assert impulse == pytest.approx(bounce * 3.0 * table_of(TABLE).ball.mass, rel=1e-6)


def test_a_touch_that_lasts_is_no_new_touch(engine: Engine) -> None:
    """Whether it lasts is told by the log of the tick before, which is in the frame."""
    logs = []
    for last in (-1.0, 2.0, 3.0):
        numbers = initial_numbers(TABLE, LAYOUT)
        place_ball(numbers, BALL, (0.0, 0.3225, 0.1), (0.0, 0.04, 0.0))
        numbers[BALL.offsets["contacts"] + 2] = last
        tick(engine, LAYOUT, numbers)
        logs.append(contacts(numbers)[0])
    assert logs == [1.0, 1.0, 0.0]


def test_rolling_on_the_floor_is_no_contact_and_a_kick_is_one_of_both(engine: Engine) -> None:
    numbers = initial_numbers(TABLE, LAYOUT)
    radius = table_of(TABLE).ball.radius
    place_ball(numbers, BALL, (-0.522 - 0.0075 - radius - 0.003, 0.0, radius), (1.0, 0.0, 0.0))
    sums = {"ball": [0.0, 0.0], "red.goal": [0.0, 0.0]}
    for _ in range(8):
        tick(engine, LAYOUT, numbers, "red.goal")
        for name, total in sums.items():
            total[0] += contacts(numbers, name)[0]
            total[1] += contacts(numbers, name)[1]
    assert sums["ball"][0] == 1.0 and sums["ball"][1] > 0.0
    assert sums["ball"] == sums["red.goal"]
    tick(engine, LAYOUT, numbers)
    assert contacts(numbers) == [0.0, 0.0, -1.0]


def test_a_rod_without_a_command_swings_freely(engine: Engine) -> None:
    """It does not follow the command of an earlier tick."""
    numbers = initial_numbers(TABLE, LAYOUT)
    engine.load([ROD], numbers)
    engine.command([ROD], [((3.0, 90.0), (100.0, 2.0))])
    engine.step(TABLE.substeps)
    engine.load([ROD], numbers)
    engine.step(TABLE.substeps)
    engine.read([ROD], numbers)
    start = ROD.offsets["joint_velocities"]
    assert numbers[start : start + 2] == [0.0, 0.0]


def test_what_is_parked_is_not_in_the_way(engine: Engine) -> None:
    numbers = initial_numbers(TABLE, LAYOUT)
    radius = table_of(TABLE).ball.radius
    place_ball(numbers, BALL, (-0.6 + radius, 0.0, radius), (3.0, 0.0, 0.0))
    tick(engine, LAYOUT, numbers, "red.goal")  # on the table now, parked from the next tick on
    for _ in range(60):
        tick(engine, LAYOUT, numbers)
    assert numbers[BALL.offsets["position"]] > -0.3


def test_what_is_not_asked_for_is_left_as_it_is(engine: Engine) -> None:
    numbers = initial_numbers(TABLE, LAYOUT)
    place_ball(numbers, BALL, (0.1, 0.2, 0.05), (1.0, 1.0, 0.0))
    for index in range(LAYOUT.size):
        if not BALL.start <= index < BALL.stop:
            numbers[index] = float(index)
    numbers[BALL.offsets["football.wait_ticks"]] = 77.0
    before = numbers.copy()
    tick(engine, LAYOUT, numbers)
    changed = {index for index in range(LAYOUT.size) if numbers[index] != before[index]}
    assert changed and all(BALL.start <= index < BALL.offsets["quarantined"] for index in changed)


@pytest.mark.parametrize("kind", ENGINES)
@pytest.mark.parametrize(("restitution", "friction"), [(0.8, 0.2), (0.3, 0.05), (0.01, 0.01), (1.0, 0.6)])
def test_balls_meet_with_the_values_of_their_pair(kind: str, restitution: float, friction: float) -> None:
    """Head-on, one of the two spinning. The impulse of friction is friction x impulse while they slip."""
    balls = f"table.surfaces.balls={{restitution: {restitution}, friction: {friction}}}"
    sets = [f"engine={kind}", "table.contact_erp=0", "table.gravity=0 m/s2", balls, "table.spare_balls=1"]
    deployment = load_deployment(apply_sets(TEXT, "table.yaml", sets), "table.yaml")
    layout = build_layout(deployment)
    pair = [layout["ball"], layout["ball-2"]]
    numbers = initial_numbers(deployment, layout)
    for ball, side in zip(pair, (-1.0, 1.0), strict=True):
        place_ball(numbers, ball, (0.03 * side, 0.05, 0.1), (-2.0 * side, 0.0, 0.0))
    spin = pair[0].offsets["angular_velocity"]
    numbers[spin : spin + 3] = [0.0, 0.0, 1000.0]
    engine = make_shared_engine(deployment, layout)
    for _ in range(10):
        engine.load(pair, numbers)
        engine.step(deployment.substeps)
        engine.read(pair, numbers)
    engine.close()
    one, other = (numbers[ball.offsets["linear_velocity"] : ball.offsets["linear_velocity"] + 3] for ball in pair)
    assert (other[0] - one[0]) / 4.0 == pytest.approx(restitution, abs=1e-3)
    assert other[1] == pytest.approx(friction * 2.0 * (1 + restitution), rel=0.01)
    assert one[1] == pytest.approx(-other[1], rel=1e-6)


@pytest.mark.parametrize("kind", ENGINES)
def test_what_balls_feel_of_one_another_changes_nothing_else(kind: str) -> None:
    speeds = []
    for balls in ("{restitution: 0.8, friction: 0.2}", "{restitution: 0.01, friction: 10}"):
        sets = [f"engine={kind}", "table.contact_erp=0", f"table.surfaces.balls={balls}"]
        deployment = load_deployment(apply_sets(TEXT, "table.yaml", sets), "table.yaml")
        numbers = initial_numbers(deployment, LAYOUT)
        place_ball(numbers, BALL, (0.0, 0.3, 0.03), (1.0, 3.0, 0.0))
        engine = make_shared_engine(deployment, LAYOUT)
        for _ in range(40):
            tick(engine, LAYOUT, numbers)
        engine.close()
        speeds.append(numbers[BALL.offsets["linear_velocity"] : BALL.offsets["linear_velocity"] + 3])
    assert speeds[0][1] < -1.0 and speeds[1] == pytest.approx(speeds[0], rel=1e-6)


@pytest.mark.parametrize("kind", ENGINES)
@pytest.mark.parametrize(
    ("turned", "start", "velocity", "normal"),
    [
        ("", (-0.15, 0.2, 0.3), (8.0, 0.0, 0.0), (-1.0, 0.0, 0.0)),
        ("", (-0.15, 0.2 - 0.045 * sqrt(0.5), 0.3), (8.0, 0.0, 0.0), (-sqrt(0.5), -sqrt(0.5), 0.0)),
        ("", (0.01, 0.21, 0.54), (0.0, 0.0, -8.0), (0.0, 0.0, 1.0)),
        ("pitch: 90 deg,", (0.02, 0.2, 0.54), (0.0, 0.0, -8.0), (0.0, 0.0, 1.0)),
    ],
    ids=["side", "slanting", "upper face", "lying"],
)
def test_balls_bounce_off_cylinders(kind: str, turned: str, start: Vector, velocity: Vector, normal: Vector) -> None:
    """A post, of 27.5 mm radius, with the ball's makes 45 mm: the ball leaves along the normal, and never gets in."""
    size = "radius: 27.5 mm, length: 12 cm, y: 20 cm, z: 30 cm"
    post = f"scenery={{post: {{shape: cylinder, {size}, {turned} surface: walls}}}}"
    sets = [f"engine={kind}", "table.contact_erp=0", "table.gravity=0 m/s2", post, "table.surfaces.walls.friction=0"]
    deployment = load_deployment(apply_sets(TEXT, "table.yaml", sets), "table.yaml")
    numbers = initial_numbers(deployment, LAYOUT)
    place_ball(numbers, BALL, start, velocity)
    engine = make_shared_engine(deployment, LAYOUT)
    at, speed = BALL.offsets["position"], BALL.offsets["linear_velocity"]
    for _ in range(25):
        tick(engine, LAYOUT, numbers)
        x, y, z = numbers[at], numbers[at + 1] - 0.2, numbers[at + 2] - 0.3
        across, along = (sqrt(y * y + z * z), x) if turned else (sqrt(x * x + y * y), z)
        assert across > 0.0275 + 0.0170 or abs(along) > 0.06 + 0.0170, "the ball is in the post"
    engine.close()
    change = [after - before for after, before in zip(numbers[speed : speed + 3], velocity, strict=True)]
    bounce = (1 + table_of(deployment).surfaces.walls.restitution) * abs(sum(map(mul, normal, velocity)))
    # Within what the way of a substep, 4 mm, turns the normal by.
    assert change == pytest.approx([bounce * part for part in normal], abs=0.09 * bounce)
