"""Batteries: the charge against what it must be by energy, chargers, and drives without power."""

from __future__ import annotations

from math import sqrt
from typing import Any, Final

import pytest

from foosim.common.errors import DeploymentError
from foosim.deployment.loader import load_deployment
from foosim.library.mobile.hall_settings import hall_of
from foosim.world.assembly.world import WorldMarks
from foosim.world.components.fitted import sensors_of
from foosim.world.components.view import SensingView
from foosim.world.frame import Frame
from tests.deployment.halls import hall, problems_of
from tests.kinematic_yard import TICK_S, Yard, yard_text

CAPACITY_J: Final = 1000.0
IDLE_W: Final = 3.0
DRAG_N: Final = 20.0
CELL: Final = {"kind": "battery", "capacity": "1 kJ", "idle": "3 W", "drag": "20 N"}
CIRCLE: Final = {"x": "1 m", "y": "-2 m", "radius": "50 cm", "power": "40 W"}


def battery(**more: Any) -> dict[str, Any]:
    return {"cell": {**CELL, **more}}


def mover(*places: tuple[str, str], **more: Any) -> dict[str, Any]:
    """Something that goes along a straight path with 2 m/s."""
    path = [{"x": x, "y": y} for x, y in places]
    size = {"shape": "box", "length": "20 cm", "width": "20 cm", "height": "20 cm"}
    return {"model": "mover", "path": path, "speed": "2 m/s", **size, **more}


def yard(**robots: dict[str, Any]) -> Yard:
    return Yard(yard_text(robots))


def charge(world: Yard, robot: str = "cart") -> float:
    return world.vector(robot, "cell.charge")[0]


def test_a_battery_loses_idle_power_and_drag_by_the_way() -> None:
    """E = E0 - (P + F v) t at a constant speed, which `track` keeps exactly."""
    world = yard(cart=mover(("0 m", "0 m"), ("30 m", "40 m"), rules=battery(charge="80 %")))
    assert charge(world) == 0.8 * CAPACITY_J
    world.step(400)
    expected = 0.8 * CAPACITY_J - (IDLE_W + DRAG_N * 2.0) * 400 * TICK_S
    assert charge(world) == pytest.approx(expected, rel=1e-12)


def test_the_way_of_what_accelerates_is_what_it_has_gone() -> None:
    """A base that speeds up with a to v has gone v t - v v / (2 a) but for the steps of time."""
    base = {"model": "differential_drive", "speed": "1 m/s", "acceleration": "2 m/s2", "rules": battery()}
    world = yard(cart=base)
    world.put("cart", "motion.set_point", 1.0, 0.0)
    world.step(300)
    gone = world.vector("cart", "position")[0]
    assert gone == pytest.approx(3.0 - 0.25, abs=0.006)
    assert charge(world) == pytest.approx(CAPACITY_J - IDLE_W * 3.0 - DRAG_N * gone, rel=1e-12)


@pytest.mark.parametrize(
    ("x", "is_in"), [("1 m", True), ("1.4 m", True), ("0.6 m", True), ("1.6 m", False), ("0.4 m", False)]
)
def test_a_place_charges_whoever_is_within_its_radius(x: str, is_in: bool) -> None:
    base = {"model": "holonomic", "at": {"x": x, "y": "-2 m"}, "rules": battery(charge="50 %", chargers=[CIRCLE])}
    world = yard(cart=base)
    world.step(200)
    assert charge(world) == pytest.approx(0.5 * CAPACITY_J + ((40.0 if is_in else 0.0) - IDLE_W) * 2.0, rel=1e-12)


def test_several_chargers_give_together_and_never_more_than_the_capacity() -> None:
    rules = battery(charge="99 %", chargers=[CIRCLE, {**CIRCLE, "y": "-1.8 m", "power": "10 W"}])
    world = yard(cart={"model": "holonomic", "at": {"x": "1 m", "y": "-2 m"}, "rules": rules})
    world.step(10)
    assert charge(world) == pytest.approx(990.0 + 47.0 * 0.1, rel=1e-12)
    world.step(100)
    assert charge(world) == CAPACITY_J


def test_what_has_the_tag_charges_while_it_passes() -> None:
    """A tanker goes by at 2 m/s, 60 cm beside the cart: within 1 m on 1.6 m of its way, which takes 0.8 s."""
    rules = battery(idle="0 W", charge="10 %", chargers=[{"tag": "tanker", "radius": "1 m", "power": "100 W"}])
    tanker = mover(("-3 m", "60 cm"), ("3 m", "60 cm"), tags=["tanker"])
    world = yard(cart={"model": "holonomic", "rules": rules}, tanker=tanker)
    world.step(300)
    assert charge(world) == pytest.approx(100.0 + 100.0 * 0.8, abs=100.0 * TICK_S * 1.01)


DRIVES: Final[dict[str, tuple[dict[str, Any], str, tuple[float, ...]]]] = {
    "differential_drive": ({"acceleration": "2 m/s2"}, "motion.set_point", (1.0, 0.0)),
    "holonomic": ({"acceleration": "2 m/s2"}, "motion.set_point", (0.6, 0.8, 0.0)),
}


@pytest.mark.parametrize("model", DRIVES)
def test_an_empty_battery_stops_the_drives(model: str) -> None:
    """The robot brakes as fast as it can, v v / (2 a), and stands, whatever it is told; charged, it goes on."""
    settings, slot, told = DRIVES[model]
    world = yard(cart={"model": model, **settings, "rules": battery(capacity="20 J", drag="10 N", idle="0 W")})
    frames = [world.numbers.copy()]
    world.put("cart", slot, *told)
    world.step(150)
    assert charge(world) > 0.0
    while charge(world) > 0.0:
        world.step()
    empty_at = world.vector("cart", "position")
    frames.append(world.numbers.copy())
    world.step(100)
    there = world.vector("cart", "position")
    gone = sqrt(sum((a - b) ** 2 for a, b in zip(there, empty_at, strict=True)))
    assert gone == pytest.approx(1.0 / 4.0, abs=0.006)
    assert world.vector("cart", "linear_velocity") == [0.0, 0.0, 0.0] and world.vector("cart", slot) == [*told]
    assert charge(world) == 0.0
    one, other = (Frame(tick, world.layout, _array(numbers)) for tick, numbers in enumerate(frames))
    assert WorldMarks(world.deployment, world.layout).between(one, other) == [
        (1, "empty", "the battery of cart is empty")
    ]
    world.put("cart", "cell.charge", 20.0)
    world.step(50)
    assert sum(map(abs, world.vector("cart", "linear_velocity"))) > 0.5


def _array(numbers: list[float]) -> Any:
    import numpy as np

    return np.array(numbers)


def test_a_rotorcraft_without_power_brakes_and_hovers() -> None:
    craft = {"model": "rotorcraft", "at": {"z": "2 m"}, "rules": battery(capacity="10 J", drag="10 N", idle="0 W")}
    world = yard(cart=craft)
    world.put("cart", "pilot.has_target", 1.0)
    world.put("cart", "pilot.target", 50.0, 0.0, 2.0, 0.0)
    world.step(600)
    assert charge(world) == 0.0
    x, _, z = world.vector("cart", "position")
    assert 1.0 < x < 10.0 and z == 2.0 and world.vector("cart", "linear_velocity") == [0.0, 0.0, 0.0]


RIGID: Final = {
    "substeps": 2,
    "engine": "mujoco",
    "physics": {"gravity": "10 m/s2"},
}


def test_a_quadrotor_without_power_falls() -> None:
    """z = z0 - g t t / 2, however its rotors were to turn; with power they hold it for a while."""
    quad = {"model": "quadrotor", "at": {"z": "20 m"}, "rules": battery(capacity="3 J", idle="10 W", drag="0 N")}
    world = Yard(yard_text({"cart": quad}, **RIGID))
    entity = world.layout["cart"]
    slot = next(field for field in entity.offsets if field.endswith(".set_point"))
    world.put("cart", slot, *[600.0] * 4)
    world.step(31)
    assert charge(world) == 0.0
    speed, height = world.vector("cart", "linear_velocity")[2], world.vector("cart", "position")[2]
    world.step(100)
    assert world.vector("cart", "linear_velocity")[2] == pytest.approx(speed - 10.0, rel=1e-6)
    assert world.vector("cart", "position")[2] == pytest.approx(height + speed - 5.0, abs=0.06)


def test_the_sensor_gives_share_and_voltage() -> None:
    sensors = {"gauge": {"kind": "battery", "rate": "10 Hz"}}
    rules = battery(charge="40 %", full="25 V", empty="20 V")
    world = yard(cart={"model": "holonomic", "sensors": sensors, "rules": rules})
    (one,) = sensors_of(world.deployment, world.layout, world.layout["cart"])
    reading = one.sample(SensingView(0, world.numbers))
    assert (reading.share, reading.voltage) == pytest.approx((0.4, 22.0), rel=1e-12)


@pytest.mark.parametrize(
    ("rules", "sensors", "said"),
    [
        ({"cell": {"kind": "battery"}}, {}, "robots.cart.rules.cell.kind: a battery needs a capacity, for example "),
        (battery(empty="13 V"), {}, "robots.cart.rules.cell: the empty battery's voltage is not below the full one's"),
        ({**battery(), "more": CELL}, {}, "robots.cart.rules.more.kind: a second battery: the first is cell"),
        ({}, {"own": {"kind": "battery", "rate": "1 Hz"}},
         "robots.cart.sensors.own.kind: on a robot without a battery: cart has no rule battery"),
        (battery(chargers=[{"radius": "1 m", "power": "1 W"}]), {},
         "robots.cart.rules.cell.chargers[0]: a charger has x and y, or a tag"),
        (battery(chargers=[{**CIRCLE, "tag": "dock"}]), {},
         "robots.cart.rules.cell.chargers[0]: a charger has x and y, or a tag"),
    ],
)  # fmt: skip
def test_a_battery_that_cannot_be_is_refused(rules: dict[str, Any], sensors: dict[str, Any], said: str) -> None:
    with pytest.raises(DeploymentError) as error:
        load_deployment(yard_text({"cart": {"model": "holonomic", "rules": rules, "sensors": sensors}}), "f")
    assert said in str(error.value)


def test_a_rover_of_a_hall_has_the_halls_battery() -> None:
    rover = "robots: {r: {model: rover, x: 1 m, y: 1 m, rules: {battery: {kind: battery, capacity: 1 kJ}}}}\n"
    (problem,) = problems_of(hall(rover))
    assert "robots.r.rules.battery.capacity: not of a rover of the hall" in problem
    world = Yard(
        hall("robots: {s: {model: station, x: 0 m, y: 0 m}, r: {model: rover, x: 9 m, y: 0 m, charge: 50 %}}\n")
    )
    its = hall_of(world.deployment)
    full, idle = its.rover.battery.capacity, its.rover.battery.idle
    assert world.vector("r", "charge") == [0.5 * full]
    world.put("r", "drive.set_point", 0.5, 0.5)
    world.step(50)
    gone = world.vector("r", "wheel_travel")[0]
    assert world.vector("r", "charge")[0] == pytest.approx(0.5 * full - idle - its.rover.battery.drag * gone)
    world.put("r", "drive.set_point", 0.0, 0.0)
    for reach, gives in ((0.01, 0.0), (-0.01, its.station.charge_power)):
        world.put("r", "wheel_speeds", 0.0, 0.0)
        world.put("r", "position", its.station.charge_radius + reach)
        before = world.vector("r", "charge")[0]
        world.step(50)
        assert world.vector("r", "charge")[0] - before == pytest.approx(gives - idle)
    world.put("r", "charge", full - 0.5)
    world.step()
    assert gone > 0.3 and world.vector("r", "charge") == [full]
