"""Contacts and rest of bodies of any kind against closed forms, at values drawn by a fixed seed.

Sliding in any course, thin plates, what is carried, a grip, slopes and stacks over a minute, what is slow and moves.
"""

from __future__ import annotations

from itertools import combinations
from math import atan2, cos, degrees, dist, hypot, pi, radians, remainder, sin
from random import Random
from typing import Any, Final

import pytest

from foosim.common.errors import DeploymentError
from foosim.deployment.loader import load_deployment
from foosim.node.physics.interface import Island
from foosim.node.physics.mujoco_islands import SEATED_MAX, CompositionEngine
from foosim.world.components.drives import NO_DRIVES, Drives, Motor
from foosim.world.matter.physics import Side
from foosim.world.scene import ORIGIN, Body, Box, Link, turn
from tests.kinematic_yard import Together, yard_text
from tests.solids import GRAVITY, TICK_S, Solids, ball, box, physics, shape

SEED: Final = 34
Y: Final = (0.0, 1.0, 0.0)
Z: Final = (0.0, 0.0, 1.0)
MINUTE: Final = 6_000


@pytest.mark.parametrize("case", range(8))
def test_a_box_slides_in_a_line_as_far_as_its_friction_lets_it(case: int) -> None:
    """Whatever its course and its yaw are: v^2 / (2 mu g), in the direction of its speed."""
    draw = Random(SEED * 100 + case)
    half = draw.choice(((0.3, 0.3, 0.05), (0.1, 0.1, 0.1), (0.15, 0.08, 0.1)))
    mu, speed, course = draw.uniform(0.2, 0.8), draw.uniform(1.0, 3.0), draw.uniform(-pi, pi)
    one = Solids([box("a", half, 2.0)], physics(floor=Side(0.0, mu), default=Side(0.0, 1.0)))
    velocity = speed * cos(course), speed * sin(course), 0.0
    one.put("a", (0.0, 0.0, half[2]), turn(Z, draw.uniform(-pi, pi)), velocity)
    one.run(400)
    x, y, _ = one.get("a", "position")
    way, turned = hypot(x, y), degrees(remainder(atan2(y, x) - course, 2 * pi))
    print(f"{way:.4f} m, {turned:.2f} degrees beside its course")
    assert way == pytest.approx(speed * speed / (2 * mu * GRAVITY), rel=0.02)
    assert abs(turned) < 1.0


@pytest.mark.parametrize("substeps", [1, 2, 4, 20])
@pytest.mark.parametrize("case", range(3))
def test_a_rebound_has_the_restitution_at_any_substep(case: int, substeps: int) -> None:
    """Of 0.5 to 10 ms, within 10 %."""
    draw = Random(SEED * 300 + 10 * case + substeps)
    bounce = draw.uniform(0.1, 0.9)
    feel = physics(ball=Side(1.0, 0.0), floor=Side(bounce, 0.0))
    one = Solids([ball("a", 0.1, 1.0, "ball")], feel, substeps=substeps)
    one.put("a", (0.0, 0.0, 0.5), velocity=(0.0, 0.0, -draw.uniform(1.0, 4.0)))
    before = now = 0.0
    while now <= 0.0:
        before = now
        one.run(1)
        now = one.get("a", "linear_velocity")[2]
    print(f"{now / -before / bounce:.3f} of the restitution {bounce:.3f}")
    assert now == pytest.approx(-bounce * before, rel=0.1)


@pytest.mark.parametrize("case", range(8))
def test_a_ball_stays_on_a_plate_of_a_millimetre(case: int) -> None:
    """As long as it goes no farther than its radius in a substep."""
    draw = Random(SEED * 200 + case)
    radius, substeps = draw.uniform(0.01, 0.05), draw.choice((2, 4, 10))
    speed = 0.9 * radius / (TICK_S / substeps)
    plate = shape(Box((0.5, 0.5, 0.0005)), "floor")
    one = Solids([ball("a", radius, 0.1)], scenery=(plate,), substeps=substeps)
    one.put("a", (0.0, 0.0, radius + draw.uniform(0.001, 0.1)), velocity=(0.0, 0.0, -speed))
    one.run(200)
    assert one.get("a", "position")[2] == pytest.approx(radius + 0.0005, abs=0.001)


def test_each_of_many_shapes_of_a_link_is_felt() -> None:
    """A bar of forty boxes: a ball lies on the last one."""
    boxes = tuple([shape(Box((0.05, 0.05, 0.05)), position=(0.1 * number, 0.0, 0.0)) for number in range(40)])
    bar = Body("bar", "bar", (0.0, 0.0, 1.0), (Link("bar", "fixed", boxes, 1.0, (0.1,) * 3),))
    one = Solids([ball("a", 0.05, 0.1), bar], scenery=())
    one.put("a", (3.9, 0.0, 1.11))
    one.run(100)
    assert one.get("a", "position")[2] == pytest.approx(1.1, abs=0.001)


def test_a_tower_of_four_hundred_boxes_lands_in_one_piece() -> None:
    """Sixteen layers of 25, 2 cm apart, fall on one another: nothing is thrown about."""
    draw = Random(SEED)
    names = [f"b{number:03}" for number in range(400)]
    one = Solids([box(name, (0.1, 0.1, 0.1), 1.0) for name in names], substeps=2)
    for number, name in enumerate(names):
        x, y = (0.22 * place + draw.uniform(-0.01, 0.01) for place in (number % 5, number // 5 % 5))
        one.put(name, (x, y, 0.15 + 0.22 * (number // 25)))
    fastest = 0.0
    for _ in range(45):
        one.run(1)
        fastest = max(fastest, *[dist(ORIGIN, one.get(name, "linear_velocity")) for name in names])
    assert fastest < 3.0, "16 gaps of 2 cm: 2.8 m/s in free fall"


def test_a_mover_carries_what_stands_on_it() -> None:
    """At 0.5 m/s for 4 s: a box on top goes along, after what it slides until it has the speed, v^2 / (2 mu g)."""
    top = Body("m", "mover", ORIGIN, (Link("m", "free", (shape(Box((0.5, 0.5, 0.1))),), 0.0, ORIGIN),))
    one = Solids([box("a", (0.1, 0.1, 0.1), 1.0), top], scenery=())
    engine = CompositionEngine(one.feel, TICK_S / one.substeps, one.substeps, (), one.bodies[:1], one.bodies[1:])
    one.put("a", (0.0, 0.0, 0.3))
    for tick in range(400):
        one.put("m", (0.5 * TICK_S * tick, 0.0, 0.1), velocity=(0.5, 0.0, 0.0))
        one.push(engine)
    x, _, z = one.get("a", "position")
    assert x == pytest.approx(2.0 - 0.25 / (2 * 0.5 * GRAVITY), abs=0.01)
    assert z == pytest.approx(0.3, abs=0.001) and one.get("a", "partners")[0] == 1.0


def test_a_box_in_a_moving_grip_does_not_slip() -> None:
    """Two fingers hold 200 g with 8 N each, and shake it for 10 s: by less than 2 mm."""
    finger = shape(Box((0.01, 0.02, 0.04)))
    links = [Link("lift", "prismatic", (), 1.0, (0.01,) * 3, axis=Z, limits=(-1.0, 1.0))]
    for name, x in (("left", -0.06), ("right", 0.06)):
        about = {"axis": (1.0, 0.0, 0.0), "limits": (-0.05, 0.05), "parent": 0, "position": (x, 0.0, 0.0)}
        links.append(Link(name, "prismatic", (finger,), 0.1, (0.001,) * 3, **about))  # type: ignore[arg-type]
    grip = Body("grip", "grip", (0.0, 0.0, 1.0), tuple(links))
    one = Solids([box("a", (0.04, 0.04, 0.04), 0.2), grip], physics(default=Side(0.0, 0.9)), scenery=())
    one.put("a", (0.0, 0.0, 1.0))
    for tick in range(1_100):
        lift = 0.3 * sin(pi * (tick - 100) * TICK_S) if tick >= 100 else 0.0
        one.drives["grip"] = Drives((Motor(lift, 200.0), Motor(0.5, 8.0), Motor(-0.5, 8.0)))
        one.run(1)
        if tick == 99:
            held = one.get("a", "position")[2] - one.get("grip", "joint_positions")[0]
    slipped = abs(one.get("a", "position")[2] - one.get("grip", "joint_positions")[0] - held)
    print(f"slipped by {slipped * 1e3:.2f} mm")
    assert slipped < 0.002


# --- rest ------------------------------------------------------------------------------------------------------------


PLANK: Final = {"shape": "box", "length": "8 m", "width": "4 m", "height": "20 cm", "z": "1 m"}
POST: Final[dict[str, Any]] = {"model": "holonomic", "at": {"x": "-20 m"}}


def world(gravity: float, robots: dict[str, Any] | None = None, **sections: Any) -> Together:
    """A yard beside a robot that stands still."""
    felt = {"gravity": f"{gravity} m/s2"}
    text = yard_text({"post": POST, **(robots or {})}, engine="mujoco", substeps=4, physics=felt, **sections)
    return Together(text, {"pole.urdf": POLE})


def one_box(**place: str) -> dict[str, Any]:
    return {"a": {"model": "box", "size": ["20 cm"] * 3, "mass": "1 kg", "at": place}}


def grid(cells: int, side_m: float) -> bytes:
    """An OBJ file: a level square of triangles around the origin."""
    step = side_m / cells
    places = [(step * x - side_m / 2, step * y - side_m / 2) for y in range(cells + 1) for x in range(cells + 1)]
    corners = [1 + x + (cells + 1) * y for y in range(cells) for x in range(cells)]
    faces = [f"f {a} {a + 1} {a + cells + 2}\nf {a} {a + cells + 2} {a + cells + 1}" for a in corners]
    return "\n".join([*[f"v {x} {y} 0" for x, y in places], *faces, ""]).encode()


def test_a_mesh_carries_what_slides_over_its_triangles() -> None:
    """From piece to piece of 800 triangles: it hops by no more than 4 mm, and goes as far as its friction lets it."""
    land = {"land": {"shape": "mesh", "file": "land.obj", "z": "50 cm", "surface": "floor"}}
    text = yard_text({"post": POST}, engine="mujoco", substeps=4, scenery=land, objects=one_box(x="-1.5 m", z="60 cm"))
    yard = Together(text, {"land.obj": grid(20, 4.0)})
    yard.step(20)
    start = yard.vector("a", "position")
    yard.put("a", "linear_velocity", 3.0, 0.7, 0.0)
    for _ in range(150):
        yard.step()
        assert yard.vector("a", "position")[2] == pytest.approx(start[2], abs=0.004)
    moves = 0.8 * 0.8 * 9.80665
    assert dist(yard.vector("a", "position"), start) == pytest.approx((9.0 + 0.49) / (2 * moves), rel=0.03)


@pytest.mark.parametrize(
    ("sections", "why"),
    [
        (
            {"surfaces": {"rubber": {"restitution": 0.5}}, "tick": "100 ms", "substeps": 8},
            r"substeps: too few for the restitution of the surface rubber.*\(valid from 10 on\), 8",
        ),
        (
            {"scenery": {"deck": {**PLANK, "surface": "goal"}}},
            "scenery.deck.surface: scenery deck has an unknown surface .*'goal'",
        ),
    ],
)
def test_contacts_that_would_not_be_right_are_refused(sections: dict[str, Any], why: str) -> None:
    text = {"engine": "mujoco", "substeps": 4, "objects": one_box(z="2 m"), **sections}
    with pytest.raises(DeploymentError, match=why):
        load_deployment(yard_text({"post": POST}, **text), "yard.yaml")
    felt = {"tick": "10 ms", "scenery": {"deck": {**PLANK, "surface": "ice"}}, "surfaces": {"ice": {"friction": 0.01}}}
    load_deployment(yard_text({"post": POST}, **{**text, **felt}), "yard.yaml")


@pytest.mark.parametrize(("x", "speed", "z"), [(0.0, 0.0, 3.2), (2.5, 2.0, 3.2), (0.0, 0.0, 0.1), (49.5, 1.0, 0.1)])
def test_a_floor_carries_what_is_on_it_and_ends_at_its_edges(x: float, speed: float, z: float) -> None:
    """On a deck above the floor: what rests stays, also below the deck, and what rolls falls at either edge."""
    deck = {"deck": {**PLANK, "z": "3 m", "surface": "floor"}}
    ball_on = {"a": {"model": "sphere", "radius": "10 cm", "mass": "1 kg", "at": {"x": f"{x} m", "z": f"{z} m"}}}
    yard = world(GRAVITY, objects=ball_on, scenery=deck)
    yard.put("a", "linear_velocity", speed, 0.0, 0.0)
    yard.put("a", "angular_velocity", 0.0, speed / 0.1, 0.0)
    places = []
    for _ in range(100):
        yard.step()
        places.append(yard.vector("a", "position"))
    ends = 4.0 if z > 1.0 else 50.0
    fallen_s = (x + speed * 1.0 - ends) / speed if speed else 0.0
    on_it = [height for at, _, height in places if at < ends]
    assert on_it == pytest.approx([z] * len(on_it), abs=0.001)
    assert places[-1][0] == pytest.approx(x + speed, abs=0.01)
    assert places[-1][2] == pytest.approx(z - GRAVITY * fallen_s**2 / 2, abs=0.05)


def test_a_floor_stops_what_comes_from_below() -> None:
    """A ball at 15 m/s against the underside of a deck, 1 m thick, turns back."""
    deck = {"deck": {**PLANK, "height": "1 m", "z": "3 m", "surface": "floor"}}
    below = {"a": {"model": "sphere", "radius": "10 cm", "mass": "1 kg", "at": {"z": "2 m"}}}
    yard = world(GRAVITY, objects=below, scenery=deck)
    yard.put("a", "linear_velocity", 0.0, 0.0, 15.0)
    yard.step(50)
    assert yard.vector("a", "position")[2] < 2.5


def test_islands_without_end_take_bounded_memory_and_change_nothing() -> None:
    """Each pair of fifty boxes as an island: more than an engine keeps, and the first one again."""
    boxes = {f"b{n:02}": {**one_box()["a"], "at": {"x": f"{n - 25} m", "z": "1 m"}} for n in range(50)}
    yard = world(GRAVITY, objects=boxes)
    pairs = list(combinations([entity for entity in yard.layout.entities if entity.is_free], 2))
    assert len(pairs) > SEATED_MAX
    engine: Any = yard.engine
    found = []
    for pair in (*pairs, pairs[0]):
        numbers = [*yard.numbers]
        engine.solve(Island(pair, (), (NO_DRIVES, NO_DRIVES)), numbers, numbers)
        found.append(numbers)
        assert len(engine._seated) <= SEATED_MAX
    assert found[0] == found[-1] != yard.numbers


def test_what_falls_slowly_goes_on_falling() -> None:
    """At 15 mm/s2, which a threshold of speed takes for rest after 0.7 s."""
    yard = world(0.015, objects=one_box(z="1 m"))
    yard.step(300)
    assert yard.vector("a", "position")[2] == pytest.approx(1.0 - 0.015 * 9.0 / 2, abs=0.001)


def test_what_drifts_slowly_goes_on_drifting() -> None:
    yard = world(0.0, objects=one_box(z="1 m"))
    yard.put("a", "linear_velocity", 0.0099, 0.0, 0.0)
    yard.step(500)
    assert yard.vector("a", "position")[0] == pytest.approx(0.0099 * 5.0, rel=1e-6)


def test_a_ball_at_its_highest_point_rolls_back() -> None:
    """On a slope of 0.05 degrees it is slow for seconds: 5/7 g sin(a) is 6 mm/s2."""
    slope = {
        "slope": {"shape": "box", "length": "8 m", "width": "4 m", "height": "20 cm", "z": "1 m", "pitch": "0.05 deg"}
    }
    ball_on = {"a": {"model": "sphere", "radius": "10 cm", "mass": "1 kg", "at": {"z": "1.2 m"}}}
    yard = world(GRAVITY, objects=ball_on, scenery=slope)
    yard.step(20)
    yard.put("a", "linear_velocity", -0.02, 0.0, 0.0)
    yard.put("a", "angular_velocity", 0.0, -0.2, 0.0)
    places = []
    for _ in range(100):
        yard.step(10)
        places.append(yard.vector("a", "position")[0])
    assert min(places) < -0.02 and places[-1] > 0.05, "it goes up, and down again"


POLE: Final = b"""<robot name="pole"><link name="foot"/>
<link name="rod"><inertial><origin xyz="0 0 0.5"/><mass value="1"/>
<inertia ixx="0.08" iyy="0.08" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><origin xyz="0 0 1"/><geometry><sphere radius="0.02"/></geometry></collision></link>
<joint name="pivot" type="continuous"><parent link="foot"/><child link="rod"/><axis xyz="0 1 0"/></joint></robot>"""


def test_a_pole_just_past_its_balance_falls() -> None:
    """By 2 mrad: what it turns grows by e every 0.26 s."""
    pole = {"model": "urdf", "file": "pole.urdf", "fixed": True, "at": {"z": "2 m"}, "actuators": {}}
    yard = world(GRAVITY, {"pole": pole})
    yard.put("pole", "joint_positions", 0.002)
    yard.step(300)
    assert abs(yard.vector("pole", "joint_positions")[0]) > 1.0


def test_a_box_on_a_slope_of_15_degrees_and_a_stack_of_ten_stay_for_a_minute() -> None:
    """They come to rest, without creep: they are where they were after 10 s, to the last bit."""
    slope = {
        "slope": {
            "shape": "box",
            "length": "4 m",
            "width": "4 m",
            "height": "20 cm",
            "x": "9 m",
            "z": "1 m",
            "pitch": "15 deg",
        }
    }
    objects = {f"b{n}": {**one_box(x="0 m", y=f"{(-1) ** n * 2} mm", z=f"{0.1 + 0.2 * n} m")["a"]} for n in range(10)}
    angle, away = radians(15.0), 0.2
    on_it = {"x": f"{9 + away * sin(angle)} m", "z": f"{1 + away * cos(angle)} m", "pitch": "15 deg"}
    yard = world(GRAVITY, objects=objects | {"c": one_box(**on_it)["a"]}, scenery=slope)
    yard.step(10)
    began = yard.vector("c", "position")
    yard.step(290)
    assert dist(began, yard.vector("c", "position")) < 0.001
    yard.step(700)
    rest = list(yard.numbers)
    yard.step(MINUTE - 1_000)
    assert yard.numbers == rest
