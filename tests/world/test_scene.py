"""The table's scene: where things are, how links move, what a body can reach."""

from math import cos, pi, sin, sqrt

import pytest
import yaml

from foosim.deployment.loader import apply_sets, load_deployment
from foosim.library.table.rod import RodRobot
from foosim.library.table.settings import table_of
from foosim.world.assembly.islands import table_reach_of
from foosim.world.assembly.world import build_scene, initial_numbers
from foosim.world.kinematics import forward_kinematics
from foosim.world.layout import build_layout
from foosim.world.scene import Box, Shape, Vector, inertia_about_axis, multiply, place, rotate, swept_box, turn
from tests.deployed import DEPLOYMENT, LAYOUT, TEXT, deployed
from tests.placing import place_ball

TABLE = table_of(DEPLOYMENT)
SCENE = build_scene(DEPLOYMENT, LAYOUT)


def inside(shape: Shape, point: Vector, slack: float = 1e-9) -> bool:
    assert isinstance(shape.geometry, Box)
    x, y, z, w = shape.orientation
    offset = tuple(a - b for a, b in zip(point, shape.position, strict=True))
    local = rotate((-x, -y, -z, w), (offset[0], offset[1], offset[2]))
    return all(abs(a) <= half + slack for a, half in zip(local, shape.geometry.half, strict=True))


def solid(point: Vector) -> set[str]:
    """The surfaces of the scenery that hold a point."""
    return {shape.surface for shape in SCENE.scenery if inside(shape, point)}


def test_rotations_compose() -> None:
    one, other = turn((0.0, 1.0, 0.0), 0.3), turn((0.0, 0.0, 1.0), -1.2)
    vector = (0.2, -0.5, 0.7)
    assert rotate(multiply(one, other), vector) == pytest.approx(rotate(one, rotate(other, vector)))
    assert rotate(turn((0.0, 1.0, 0.0), pi / 2), (0.0, 0.0, -1.0)) == pytest.approx((-1.0, 0.0, 0.0))


def test_red_is_at_negative_x_and_blue_is_mirrored() -> None:
    for line in ("goal", "defence", "midfield", "attack"):
        red, blue = SCENE.bodies[f"red.{line}"], SCENE.bodies[f"blue.{line}"]
        assert red.position[0] == TABLE.lines[line].x == -blue.position[0]
    assert SCENE.bodies["red.goal"].position == (-0.522, 0.0, 0.084)
    assert list(SCENE.bodies) == [entity.name for entity in LAYOUT.entities if entity.is_solved]


def test_feet_hang_down_slide_and_turn() -> None:
    numbers = initial_numbers(DEPLOYMENT, LAYOUT)
    entity, body = LAYOUT["red.attack"], SCENE.bodies["red.attack"]
    start = entity.offsets["joint_positions"]
    foot = body.links[1].shapes[2]
    for slide, angle in ((0.0, 0.0), (0.05, 0.4), (-0.1, -2.0)):
        numbers[start : start + 2] = slide, angle
        (carriage, there, upright), (spin, position, orientation) = forward_kinematics(body, entity, numbers)
        assert (carriage, spin) == ("red.attack/slide", "red.attack/spin")
        assert there == position == (0.224, slide, 0.084) and upright == (0.0, 0.0, 0.0, 1.0)
        down = TABLE.rod.foot_radius - TABLE.rod.foot.height / 2
        centre, _ = place(foot, position, orientation)
        assert centre == pytest.approx((0.224 - down * sin(angle), slide, 0.084 - down * cos(angle)))


def test_a_ball_is_where_its_slots_say() -> None:
    numbers = initial_numbers(DEPLOYMENT, LAYOUT)
    place_ball(numbers, LAYOUT["ball"], (0.1, 0.2, 0.3))
    poses = forward_kinematics(SCENE.bodies["ball"], LAYOUT["ball"], numbers)
    assert poses == [("ball", (0.1, 0.2, 0.3), (0.0, 0.0, 0.0, 1.0))]


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_the_table_is_closed_but_for_its_goals(side: float) -> None:
    end, wide = TABLE.field.length / 2, TABLE.field.width / 2
    assert solid((0.0, side * (wide + 0.02), 0.05)) == {"walls"}
    for y in (-0.3, -0.15, 0.15, 0.3):
        assert solid((side * (end + 0.02), y, 0.05)) == {"walls"}
    assert solid((side * (end + 0.02), 0.0, TABLE.goal.height + 0.01)) == {"walls"}
    pocket = side * (end + TABLE.walls.thickness + TABLE.goal.depth)
    for x in (side * end, side * (end + 0.05), 0.99 * pocket):
        for y in (-0.1, 0.0, 0.1):
            assert solid((x, y, 0.02)) == set()
            assert solid((x, y, -0.02)) == {"floor"}
    assert solid((pocket + side * 0.01, 0.0, 0.03)) == {"goal"}
    assert solid((0.95 * pocket, TABLE.goal.width / 2 + 0.01, 0.03)) == {"goal"}
    assert solid((0.95 * pocket, 0.0, TABLE.goal.height + 0.01)) == {"goal"}


@pytest.mark.parametrize("side_x", [-1.0, 1.0])
@pytest.mark.parametrize("side_y", [-1.0, 1.0])
def test_a_ramp_rises_from_goal_edge_and_side_wall_to_the_corner(side_x: float, side_y: float) -> None:
    end, wide, leg, height = TABLE.field.length / 2, TABLE.field.width / 2, TABLE.ramps.leg, TABLE.ramps.height
    for far_x, far_y, z in (
        (0.0, leg, 0.0),
        (leg, 0.0, 0.0),
        (1e-4, 1e-4, height * (1 - 2e-4 / leg)),
        (leg / 4, leg / 4, height / 2),
    ):
        x, y = side_x * (end - far_x), side_y * (wide - far_y)
        corner_x, corner_y = side_x * 1e-5, side_y * 1e-5  # off the edge, towards the corner
        assert "ramps" in solid((x + corner_x, y + corner_y, z - 1e-6))
        assert "ramps" not in solid((x, y, z + 1e-6))
    assert "ramps" not in solid((side_x * (end - 0.6 * leg), side_y * (wide - 0.6 * leg), -1e-4))


def test_islands_reach_as_far_as_bodies_do() -> None:
    reach = table_reach_of(DEPLOYMENT, LAYOUT)
    for _, name, axis in reach.rods:
        low, high = swept_box(SCENE.bodies[name])
        assert axis - reach.half_width_m <= low[0] and high[0] <= axis + reach.half_width_m
        assert reach.z_low_m <= low[2] and high[2] <= reach.z_high_m
        rod = DEPLOYMENT.robots[name]
        assert isinstance(rod, RodRobot)
        stroke = TABLE.lines[rod.line].half_stroke
        assert high[1] == pytest.approx(TABLE.rod.length / 2 + stroke)
    assert swept_box(SCENE.bodies["ball"])[1] == (TABLE.ball.radius,) * 3


def test_inertia_comes_from_the_parts() -> None:
    """A goal keeper's rod: a hollow cylinder and one box that hangs below the axis."""
    link = SCENE.bodies["red.goal"].links[1]
    rod = TABLE.rod
    tube = rod.tube_mass * (rod.radius**2 + rod.inner_radius**2) / 2
    figure = rod.figure_mass * ((0.02**2 + 0.09**2) / 12 + 0.016**2)
    assert inertia_about_axis(link) == pytest.approx(tube + figure)
    assert link.mass == pytest.approx(0.946)
    assert link.mass * link.centre_of_mass[2] == pytest.approx(-rod.figure_mass * 0.016)
    assert link.inertia[0] == pytest.approx(link.inertia[2], rel=0.01)
    assert sqrt(sum(part * part for part in link.centre_of_mass)) < 0.001


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_strip_rises_from_the_floor_to_the_side_wall(side: float) -> None:
    """Along the whole wall, in front of the ramps' corners, too."""
    sets = ["table.strips={height: 6 mm, width: 20 mm}", "table.ramps.height=0 mm"]
    spec = deployed(*sets)
    strips = [shape for shape in build_scene(spec, build_layout(spec)).scenery if shape.surface == "ramps"]
    wide = TABLE.field.width / 2
    assert len(strips) == 2
    for x in (-0.59, 0.0, 0.3, 0.59):
        for share in (0.01, 0.5, 0.99):
            y, z = side * (wide - 0.02 * (1 - share)), 0.006 * share
            assert any(inside(shape, (x, y, z - 1e-6), 0.0) for shape in strips)
            assert not any(inside(shape, (x, y, z + 1e-6), 0.0) for shape in strips)
        assert not any(inside(shape, (x, side * (wide - 0.021), -1e-6), 0.0) for shape in strips)


@pytest.mark.parametrize(("inner", "mass"), [("0 mm", 1.736), ("6 mm", 0.760)])
def test_a_rod_without_a_mass_is_of_steel(inner: str, mass: float) -> None:
    """7,850 kg/m3 of a tube, or of a solid rod: about twice as heavy, and it turns harder."""
    sets = [f"table.rod.inner_radius={inner}"]
    data = yaml.safe_load(apply_sets(TEXT, "table.yaml", sets))
    del data["table"]["rod"]["mass"]
    spec = load_deployment(yaml.safe_dump(data, sort_keys=False), "table.yaml")
    rod = table_of(spec).rod
    assert rod.mass is None and rod.tube_mass == pytest.approx(mass, abs=0.001)
    link = build_scene(spec, build_layout(spec)).bodies["red.goal"].links[1]
    figure = rod.figure_mass * ((0.02**2 + 0.09**2) / 12 + 0.016**2)
    assert link.mass == pytest.approx(rod.tube_mass + rod.figure_mass)
    assert inertia_about_axis(link) == pytest.approx(rod.tube_mass * (rod.radius**2 + rod.inner_radius**2) / 2 + figure)
