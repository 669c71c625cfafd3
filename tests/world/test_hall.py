"""A hall in a deployment: its schema and what it refuses, its layout, its scene, and what stands in a rover's way."""

from __future__ import annotations

from collections.abc import Callable
from math import pi
from typing import Final

import pytest

from foosim.common.errors import BadValue, DeploymentError
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.library.mobile.hall_obstacles import obstacles_of, start_findings
from foosim.world.assembly.initial_state import initial_frame
from foosim.world.assembly.world import build_scene, initial_numbers, world_status
from foosim.world.edits import Add, Edit, Push, Remove, Set, fitting_edits
from foosim.world.kinematics import forward_kinematics
from foosim.world.layout import build_layout
from foosim.world.rays.outlines import Circle, Rectangle, outline
from foosim.world.scene import Cylinder, Shape
from foosim.world.setting.settable import add_edit, set_edits
from tests.deployed import DEPLOY

WAREHOUSE: Final = (DEPLOY / "warehouse.yaml").read_text()
TABLE: Final = (DEPLOY / "table.yaml").read_text()
DEPLOYMENT: Final = load_deployment(WAREHOUSE, "warehouse.yaml")


def problems(text: str, *sets: str) -> list[str]:
    with pytest.raises(DeploymentError) as error:
        apply_sets(text, "x.yaml", sets)
    return [problem.partition(": ")[2] for problem in error.value.problems]


@pytest.mark.parametrize(
    ("setting", "problem"),
    [
        ("robots.base={model: rod, team: red, line: goal, sensors: {}, actuators: {}}",
         "robots.base.model: a robot of a table in a world without one, 'rod'"),
        ("robots.rover01.x=3 m", "robots.rover01.x: the rover starts in a wall of the hall, '3 m, 12.4 m'"),
        ("robots.rover01.x=-1 m", "robots.rover01.x: the rover starts in scenery.shelf-north-outer-2, '-1 m, 9 m'"),
        ("robots.rover03.x=4 m", "robots.rover03.x: the rover starts in the rover rover01, '4 m, 6.5 m'"),
        ("robots.rover01.x=-17.1 m", "robots.rover01.x: the rover starts in the station base, '-17.1 m, 0 m'"),
        ("robots.rover01.sensors.pose={kind: ball, rate: 10 Hz}",
         "robots.rover01.sensors.pose.kind: sensor of a table in a world without one, 'ball'"),
        ("robots.rover01.actuators={drive: {kind: rod_position}}",
         "robots.rover01.actuators.drive.kind: actuator of a table in a world without one, 'rod_position'"),
        ("robots.base.sensors={cells: {kind: battery, rate: 1 Hz}}",
         "robots.base.sensors.cells.kind: on a robot without a battery: base has no rule battery, 'battery'"),
        ("robots.rover01.sensors.drive={kind: battery, rate: 1 Hz}",
         "robots.rover01.sensors: a name that is also one of rover01's actuators, 'drive'"),
        ("robots.base.heading=0 deg",
         "robots.base: unknown key (there are: model, spare, tags, label, sensors, actuators, rules, x, y), 'heading'"),
        ("scenery.goods-1.surface=floor",
         "scenery.goods-1.surface: a surface for free bodies, in a world without any, 'floor'"),
        ("hall.rover.radius=9 m", "hall.rover.radius: more than half of the hall's least side, '9 m'"),
        ("hall.rover.drive.track=70 cm",
         "hall.rover.drive.track: the wheels would be outside of the rover: more than twice its radius, '70 cm'"),
        ("hall.rover.battery.empty=30 V", "hall.rover.battery.empty: not below the full battery's voltage, '30 V'"),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_refused_with_its_place(
    fleet_text: Callable[..., str], setting: str, problem: str
) -> None:
    elsewhere = {"'3 m, 12.4 m'": "y=12.4 m", "'-1 m, 9 m'": "y=9 m", "0 m'": "y=0 m", "'4 m, 6.5 m'": "y=6.5 m"}
    more = [f"robots.rover01.{y}" for end, y in elsewhere.items() if problem.endswith(end)]
    more += ["hall.width=17 m"] if "radius" in setting else []
    more += ["robots.rover03.y=6.5 m", "robots.rover01.x=4.2 m"] if "rover03" in setting else []
    assert problems(fleet_text(3), setting, *more)[:1] == [problem]


@pytest.mark.parametrize(
    ("sets", "problem"),
    [
        (["robots.base.y=20 m"], "robots.base.x: the station stands outside of the hall: "
         "valid are x from -20 to 20 m, y from -12.5 to 12.5 m, '-17.5 m, 20 m'"),
        (["robots.base.x=-19.9 m"], "robots.base.x: the station stands in a wall of the hall, '-19.9 m, 0 m'"),
        (["scenery.pallet={shape: box, x: -17 m, z: 1 m, length: 1 m, width: 1 m, height: 2 m}"],
         "robots.base.x: the station stands in scenery.pallet, '-17.5 m, 0 m'"),
    ],
)  # fmt: skip
def test_a_robot_in_an_obstacle_or_outside_is_refused(
    fleet_text: Callable[..., str], sets: list[str], problem: str
) -> None:
    assert problems(fleet_text(2), *sets)[0] == problem


def test_stations_do_not_overlap() -> None:
    second = DEPLOYMENT.robots["base"].model_copy(update={"x": -17.2})
    deployment = DEPLOYMENT.model_copy(update={"robots": {**DEPLOYMENT.robots, "second": second}})
    assert [(finding.location[1], finding.what) for finding in start_findings(deployment)] == [
        ("base", "the station stands in the station second"),
        ("second", "the station stands in the station base"),
    ]


def test_robots_of_a_kit_need_its_section() -> None:
    neither = problems(WAREHOUSE.replace("\nhall:\n", "\nhal:\n"))
    assert "unknown key, 'hal', nearest is 'hall'" in neither
    rover = "{model: rover, x: 0 m, y: 0 m, sensors: {}}"
    assert "robots.camera.model: a robot of a hall in a world without one, 'rover'" in problems(
        TABLE, f"robots.camera={rover}"
    )


def test_a_hall_has_no_ball_and_no_score_and_its_station_alone_cannot_leave() -> None:
    layout = build_layout(DEPLOYMENT)
    models = {"rover", "station", "differential_drive"}
    assert {entity.model for entity in layout.entities} == models and "world" not in layout
    assert world_status(DEPLOYMENT, initial_frame(DEPLOYMENT)).keys() == {"commands", "rovers"}
    assert {entity.model for entity in layout.entities if entity.can_leave} == models - {"station"}
    numbers = initial_numbers(DEPLOYMENT, layout)
    edits: list[Edit] = [Add("b2", []), Remove("b2"), Remove("base"), Push("rover01", (0.0, 0.0, 0.0))]
    fitting: list[Edit] = [Set("rover01", "down", [1.0]), Set("base", "down", [0.0]), Remove("rover02")]
    unfit: list[Edit] = [Set("rover01", "charge", [1.0, 2.0]), Set("base", "speed", [1.0]), Set("none", "down", [1.0])]
    assert list(fitting_edits(layout, numbers, [*edits, *unfit, *fitting])) == fitting


def test_rovers_start_where_they_are_declared() -> None:
    frame = initial_frame(DEPLOYMENT)
    assert frame.vector("rover03", "position", 3) == [-6.25, 11.25, 0.0]
    assert frame.at("rover03", "heading") == pytest.approx(-pi / 2)
    assert frame.vector("rover03", "orientation", 4) == pytest.approx([0.0, 0.0, -(0.5**0.5), 0.5**0.5])
    assert frame.at("rover03", "charge") == pytest.approx(0.95 * 250 * 3600)


def test_the_scene_has_rovers_where_they_are_and_their_antennas() -> None:
    layout = build_layout(DEPLOYMENT)
    scene, numbers = build_scene(DEPLOYMENT, layout), initial_numbers(DEPLOYMENT, layout)
    rover, base = scene.bodies["rover03"], scene.bodies["base"]
    ((name, position, orientation),) = forward_kinematics(rover, layout["rover03"], numbers)
    assert (name, position) == ("rover03", (-6.25, 11.25, 0.0)) and orientation[2] < 0.0
    assert (rover.antenna, base.antenna) == ((0.0, 0.0, 0.4), (0.0, 0.0, 3.0))
    hulls = [shape.geometry for body in (rover, base) for shape in body.links[0].shapes[:1]]
    assert hulls == [Cylinder(0.3, 0.5), Cylinder(0.2, 1.2)]


def test_obstacles_are_the_scenery_from_above() -> None:
    found = obstacles_of(DEPLOYMENT)
    assert len(found) == 4 + 1 + len(DEPLOYMENT.scenery)
    assert Rectangle(-12.5, 8.75, 1.0, 0.0, 4.25, 0.5) in found and Circle(-17.5, 0.0, 0.2) in found
    assert Circle(-15.0, 0.0, 0.2) in found, "a pillar"
    upright = Shape(Cylinder(0.4, 3.0), "walls", (0, 0, 0, 1), (1.0, 2.0, 1.5))
    assert outline(upright) == Circle(1.0, 2.0, 0.4)
    lying = Shape(Cylinder(0.4, 3.0), "walls", (0, 0, 0, 1), (1.0, 2.0, 0.4), (0.5**0.5, 0.0, 0.0, 0.5**0.5))
    around = outline(lying)
    assert isinstance(around, Rectangle)
    assert (around.half_along, around.half_across) == pytest.approx((0.4, 1.5))


@pytest.mark.parametrize(
    ("x", "y", "clear"),
    [
        (2.5, 0, True),
        (2.49, 0, False),
        (0, 1.5, True),
        (0, 1.49, False),
        (2.35, 1.35, False),
        (2.36, 1.36, True),
        (0, 0, False),
    ],
)
def test_a_circle_is_clear_of_a_rectangle_from_where_it_touches(x: float, y: float, clear: bool) -> None:
    straight, turned = Rectangle(0, 0, 1, 0, 2, 1), Rectangle(0, 0, 0, 1, 2, 1)
    for side_x, side_y in ((1, 1), (-1, 1), (1, -1), (-1, -1)):
        assert straight.is_clear(side_x * x, side_y * y, 0.5) is clear
        assert turned.is_clear(-side_y * y, side_x * x, 0.5) is clear


def test_no_robot_is_added_or_put_outside_of_the_hall() -> None:
    layout = build_layout(DEPLOYMENT)
    numbers = initial_numbers(DEPLOYMENT, layout)
    with pytest.raises(BadValue, match=r"beyond the bounds of the world: rover21 would .* '9999 m, 0 m, "):
        add_edit(DEPLOYMENT, layout, numbers, layout["rover21"], "9999,0")
    with pytest.raises(BadValue, match="beyond the bounds of the world: rover01"):
        set_edits(DEPLOYMENT, layout, numbers, layout["rover01"], "at", "0,-9999")
    assert add_edit(DEPLOYMENT, layout, numbers, layout["rover21"]).name == "rover21"
