"""URDF files as people have them: what is mended and noted, how masses and looks come about, and which base is free."""

from __future__ import annotations

import json
from contextlib import closing
from itertools import repeat
from typing import Final

import numpy as np
import pytest

from foosim.deployment.text.yaml import locate_in, plain, read_tree
from foosim.world.bodies.findings import SHOWN_MAX, BadRobot
from foosim.world.bodies.inertia import principal_of, solid, solid_of, turned
from foosim.world.bodies.urdf import Robot, body_of, read_urdf
from foosim.world.bodies.urdf_base import base_of
from foosim.world.bodies.urdf_text import as_json, snippet
from foosim.world.bodies.visual_meshes import drawn_content, undrawn_content, undrawn_meshes
from foosim.world.components.drives import Drives, Motor
from foosim.world.components.joint_names import joint_indices
from foosim.world.matter.mesh import AssetError, Mesh
from foosim.world.scene import ORIGIN, UPRIGHT, Box, Mimic, Shape, Sphere, from_rpy
from tests.solids import Solids, box, physics

MASS: Final = '<inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01"/></inertial>'
BALL: Final = '<collision><geometry><sphere radius="0.1"/></geometry></collision>'
LIMIT: Final = '<limit lower="-1" upper="1" effort="5" velocity="2"/>'
SHARD: Final = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\n"


def link(name: str, content: str = MASS + BALL) -> str:
    return f'<link name="{name}">{content}</link>\n'


def joint(name: str, ends: str, content: str = LIMIT, kind: str = "revolute") -> str:
    """A joint between two links of one letter."""
    return f'<joint name="{name}" type="{kind}"><parent link="{ends[0]}"/><child link="{ends[1]}"/>{content}</joint>\n'


def read(*parts: str, drawn: bytes = b"") -> Robot:
    """A robot of these parts, each on a line; `drawn` is the drawn form of a mesh `a.obj`."""
    text = f'<robot name="r">\n{"".join(parts)}</robot>'
    return read_urdf("r.urdf", {"r.urdf": text.encode(), "a.obj.visual": drawn})


def pair(content: str = LIMIT, kind: str = "revolute", child: str = MASS + BALL) -> Robot:
    """A robot of two links a, b and a joint j between them."""
    return read(link("a"), link("b", child), joint("j", "ab", content, kind))


def limit(**values: str) -> str:
    return "<limit " + " ".join(f'{key}="{value}"' for key, value in values.items()) + "/>"


# --- joints ----------------------------------------------------------------------------------------------------------

JOINTS: Final = {
    "effort 0": (
        limit(lower="-1", upper="1", effort="0", velocity="2"),
        ("revolute", 0.0, 2.0),
        "an effort of 0, of joint j (line 4): its motor applies no force",
    ),
    "velocity 0": (
        limit(lower="-1", upper="1", effort="5", velocity="0"),
        ("revolute", 5.0, 0.0),
        "a velocity of 0, of joint j (line 4): its motor cannot move it",
    ),
    "no effort": (
        limit(lower="-1", upper="1", velocity="2"),
        ("revolute", float("inf"), 2.0),
        "no effort in the limit of joint j (line 4): its motor has no greatest effort",
    ),
    "no ends": (
        limit(effort="5", velocity="2"),
        ("continuous", 5.0, 2.0),
        "neither lower nor upper in the limit of joint j (line 4): it turns without end",
    ),
    "ends far away": (
        limit(lower="-1e16", upper="1e16", effort="5", velocity="2"),
        ("continuous", 5.0, 2.0),
        "limits beyond 1000 rad, of joint j (line 4): it turns without end",
    ),
    "equal ends": (
        limit(lower="0.5", upper="0.5", effort="0", velocity="0"),
        ("fixed", float("inf"), float("inf")),
        "limits 0.5 to 0.5 hold joint j (line 4): it is fixed there",
    ),
}


@pytest.mark.parametrize("case", JOINTS)
def test_limits_that_have_one_meaning_are_noted(case: str) -> None:
    content, about, note = JOINTS[case]
    robot = pair(content)
    its = robot.links[1]
    assert ((its.joint, its.effort, its.speed), robot.notes) == (about, (note,))


def test_a_joint_with_equal_limits_is_fixed_where_they_are() -> None:
    axis, at = '<axis xyz="0 0 1"/>', '<origin xyz="1 0 0" rpy="0 1.5707963267948966 0"/>'
    turning = pair(limit(lower="0.5", upper="0.5", effort="1", velocity="1") + axis).links[1]
    assert turning.orientation == pytest.approx(from_rpy(0.0, 0.0, 0.5))
    sliding = pair(limit(lower="2", upper="2", effort="1", velocity="1") + axis + at, "prismatic").links[1]
    assert sliding.position == pytest.approx((3.0, 0.0, 0.0))


def mimic(leader: str, ratio: float = 1.0, offset: float = 0.0) -> str:
    return f'{LIMIT}<mimic joint="{leader}" multiplier="{ratio}" offset="{offset}"/>'


def test_joints_follow_the_first_of_their_chain() -> None:
    links = [link(name) for name in "abcd"]
    robot = read(
        *links, joint("k", "ab", mimic("j", 2.0, 0.1)), joint("j", "ac"), joint("l", "ad", mimic("k", -3.0, 1.0))
    )
    assert [(one.joint_name, one.mimic) for one in robot.links[1:]] == [
        ("k", Mimic(2, 2.0, 0.1)),
        ("j", None),
        ("l", Mimic(2, -6.0, 1.0 - 3.0 * 0.1)),
    ]
    assert "follows j x -6 + 0.7 rad" in " ".join(_text(robot))


def test_a_joint_that_follows_one_that_is_fixed_is_fixed() -> None:
    held = joint("j", "ab", limit(lower="0.2", upper="0.2", effort="1", velocity="1") + '<axis xyz="0 0 1"/>')
    robot = read(link("a"), link("b"), link("c"), held, joint("k", "ac", mimic("j", 2.0, 0.1) + '<axis xyz="0 0 1"/>'))
    assert robot.moving == () and robot.links[2].orientation == pytest.approx(from_rpy(0.0, 0.0, 0.5))
    assert robot.notes[1] == "joint k follows j (line 6): that does not move it, it is at 0.5"


@pytest.mark.parametrize(
    ("leaders", "what"),
    [
        (("k", "x"), r"6: no joint of this name to follow, 'x'"),
        (("j", "k"), r"5: a joint that follows itself, 'j > j'"),
        (("k", "j"), r"5: a joint that follows itself, 'j > k > j'"),
    ],
)
def test_a_joint_follows_no_joint_that_is_none(leaders: tuple[str, str], what: str) -> None:
    joints = [joint(name, ends, mimic(leader)) for name, ends, leader in zip("jk", ("ab", "ac"), leaders, strict=True)]
    with pytest.raises(AssetError, match=rf"(^|\n)r\.urdf:{what}"):
        read(link("a"), link("b"), link("c"), *joints)


# --- masses ----------------------------------------------------------------------------------------------------------


def inertial(mass: str | None, **moments: str) -> str:
    words = " ".join(f'{key}="{value}"' for key, value in moments.items())
    weight = "" if mass is None else f'<mass value="{mass}"/>'
    return f"<inertial>{weight}{f'<inertia {words}/>' if words else ''}</inertial>"


@pytest.mark.parametrize(
    "content",
    [
        inertial("0", ixx="1", iyy="1", izz="1"),
        inertial("1e-9", ixx="1", iyy="1", izz="1"),
        inertial(None, ixx="1", iyy="1", izz="1"),
        inertial("0"),
    ],
)
def test_a_link_below_a_milligram_has_no_mass(content: str) -> None:
    robot = pair("", "fixed", content)
    assert (robot.links[1].mass, robot.links[1].inertia) == (0.0, ORIGIN)
    assert robot.notes == ("a mass below 1 mg, of link b (line 3): it counts as none",)


BOX: Final = '<collision><origin xyz="{x} 0 0"/><geometry><box size="1 2 3"/></geometry></collision>'


@pytest.mark.parametrize(
    "moments",
    [
        {},
        {"ixx": "0", "iyy": "0", "izz": "0"},
        {"ixx": "1", "iyy": "1", "izz": "9"},
        {"ixx": "-1", "iyy": "1", "izz": "1"},
        {"ixx": "1", "ixy": "2", "iyy": "1", "izz": "1"},
        {"ixx": "9e8", "iyy": "9e8", "izz": "9e8"},
        {"ixx": "1e-12", "iyy": "1e-12", "izz": "1e-12"},
    ],
)
def test_an_inertia_that_no_body_has_is_that_of_the_shapes_at_the_files_mass(moments: dict[str, str]) -> None:
    """Two boxes beside one another are one box."""
    b = pair(child=inertial("6", **moments) + BOX.format(x=0.5) + BOX.format(x=1.5)).links[1]
    assert b.inertia == pytest.approx(principal_of(solid(Box((1.0, 1.0, 1.5)), 6.0).tensor).moments)
    assert (b.mass, b.centre_of_mass) == (6.0, ORIGIN)


@pytest.mark.parametrize(
    ("moments", "used"),
    [
        ({"ixx": "0", "iyy": "0", "izz": "0"}, 0.4 * 6.0 * (6.0 / 1000.0 * 3.0 / (4.0 * np.pi)) ** (2.0 / 3.0)),
        ({"ixx": "1", "iyy": "1", "izz": "7"}, 3.0),
    ],
)
def test_without_shapes_it_is_even_over_the_axes(moments: dict[str, str], used: float) -> None:
    robot = pair(child=inertial("6", **moments))
    assert robot.links[1].inertia == pytest.approx((used,) * 3)
    (note,) = robot.notes
    shown = " and ".join((", ".join([moments["ixx"], moments["iyy"]]), moments["izz"]))
    assert note.startswith(f"inertia of link b (line 3): principal moments of {shown} kg m2")
    assert f"; instead it has {used:.3g}, {used:.3g}, {used:.3g} kg m2, " in note, "both values"


def test_shapes_have_shares_of_a_mass_by_their_volumes() -> None:
    """A turned box and a ball: the centre is nearer to the greater one."""
    box = Shape(Box((0.5, 0.5, 1.0)), "", (0, 0, 0, 1), (1.0, 0.0, 0.0), from_rpy(0.0, 1.0, 0.0))
    ball = Shape(Sphere(0.5), "", (0, 0, 0, 1))
    whole = solid_of([box, ball], 3.0)
    assert whole.centre == pytest.approx((2.0 / (2.0 + np.pi / 6.0), 0.0, 0.0)) and whole.mass == pytest.approx(3.0)
    alone = solid_of([box], 3.0)
    assert alone.tensor == pytest.approx(turned(solid(box.geometry, 3.0).tensor, box.orientation))


@pytest.mark.parametrize("fixed", [True, False])
def test_moments_that_a_file_has_rounded_up_are_computed(fixed: bool) -> None:
    plate = inertial("1", ixx="0.083", iyy="0.083", izz="0.167") + BALL
    robot = read(link("a", plate), link("b", plate), joint("j", "ab"))
    body = body_of(robot, "r", (0.0, 0.0, 2.0), UPRIGHT, fixed=fixed, surfaces=repeat("default"), speed_limit=9.0)
    assert robot.notes == () and [one.inertia for one in body.links] == [(0.083, 0.083, 0.166)] * 2
    with closing(Solids([body])) as one:  # MuJoCo refuses others
        one.run(1)


SLIDER: Final = (
    link("w", ""),
    link("x", ""),
    link("y", inertial("0")),
    link("b", inertial("10", ixx="0.2", iyy="0.3", izz="0.4") + BALL),
    link("p", ""),
    link("t", BALL),
    joint("jx", "wx", limit(lower="-9", upper="9", effort="500", velocity="2"), "prismatic"),
    joint("jy", "xy", limit(lower="-9", upper="9", effort="500", velocity="2") + '<axis xyz="0 1 0"/>', "prismatic"),
    joint("yaw", "yb", limit(effort="50", velocity="3") + '<axis xyz="0 0 1"/>', "continuous"),
    joint("pan", "bp", limit(effort="5", velocity="3") + '<axis xyz="0 0 1"/>', "continuous"),
    joint("tilt", "pt", limit(effort="5", velocity="3") + '<axis xyz="0 1 0"/>', "continuous"),
)


def test_links_without_a_mass_between_joints_and_at_their_end_borrow_some() -> None:
    robot = read(*SLIDER)
    masses = {one.name: one.mass for one in robot.links}
    assert masses == {"w": 0.0, "x": 0.01, "y": 0.01, "b": 10.0, "p": 0.01, "t": 0.01}
    noted = [note for note in robot.notes if "has no mass and moves" in note]
    lent = "it has 0.01 kg and moments of 0.0003 kg m2, a thousandth of b"
    assert noted == [
        f"link {name} has no mass and moves (line {line}): {lent}"
        for name, line in zip("xypt", (3, 4, 6, 7), strict=True)
    ]


def test_a_robot_with_links_without_a_mass_moves_as_its_heavy_ones_do() -> None:
    """500 N at 10 kg; all of its motors reach their speeds, and hold still against gravity."""
    body = body_of(read(*SLIDER), "r", (0.0, 0.0, 2.0), UPRIGHT, fixed=True, surfaces=repeat("default"))
    with closing(Solids([body], feel=physics())) as one:
        one.drives["r"] = Drives((Motor(100.0, 500.0), *(Motor(0.0, 50.0),) * 4))
        one.run(2)
        assert one.get("r", "joint_velocities")[0] == pytest.approx(500.0 / 10.0 * 0.02, rel=0.005)
        one.drives["r"] = Drives(tuple(Motor(speed, 500.0) for speed in (0.3, -0.2, 0.5, -0.7, 1.0)))
        one.run(20)
        assert one.get("r", "joint_velocities") == pytest.approx([0.3, -0.2, 0.5, -0.7, 1.0], abs=1e-3)
        one.drives["r"] = Drives(tuple(Motor(0.0, 500.0) for _ in range(5)))
        one.run(20)
        before = one.get("r", "joint_positions")
        one.run(100)
        assert one.get("r", "joint_positions") == pytest.approx(before, abs=1e-5)


def test_a_fixed_robot_without_any_mass_carries_others() -> None:
    table = body_of(read(link("a", BALL)), "t", (0.0, 0.0, 2.0), UPRIGHT, fixed=True, surfaces=repeat("default"))
    with closing(Solids([box("b", (0.1, 0.1, 0.1), 1.0), table], feel=physics())) as one:
        one.put("b", (0.0, 0.0, 2.2))
        one.run(50)
        assert one.get("b", "position") == pytest.approx([0.0, 0.0, 2.2], abs=1e-3)


def test_a_joint_in_a_robot_without_any_mass_moves_nothing() -> None:
    with pytest.raises(AssetError, match=r"^r\.urdf:3: the joint j moves nothing: no link has a mass, 'b'$"):
        read(link("a", BALL), link("b", ""), joint("j", "ab"))


# --- names, findings -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["tf/frame", "left arm", "Gelenk_\u00e4 \u2192", "x" * 256, "1.0", "a:b"])
def test_names_are_as_they_are_written(name: str) -> None:
    robot = read(link("a"), link(name), joint("j", "ab").replace('"b"', f'"{name}"').replace('"j"', f'"{name}"'))
    assert (robot.links[1].name, robot.moving) == (name, (name,))
    assert robot.links[1].joint_name == name


def test_what_is_passed_over_is_noted_once_a_kind_with_its_lines() -> None:
    robot = read(
        link("a"), '<transmission name="t"/>\n', '<gazebo><plugin filename="a.so"/></gazebo>\n', "<gazebo/>\n<dance/>\n"
    )
    assert robot.notes == (
        "passed over: transmission (line 3): actuators are the deployment's",
        "passed over: gazebo (lines 4, 5): it is for another simulator",
        "passed over: plugin (line 4): sensors, actuators and rules are the deployment's",
        "passed over: dance (line 6): it is not part of a body",
    )


def test_each_bad_element_has_its_line_in_one_error_and_their_count_is_bounded() -> None:
    links = [link("a"), *(link(f"b{number}", MASS + BALL.replace("0.1", "0")) for number in range(SHOWN_MAX + 7))]
    bad = joint("j", "ab", limit(lower="1", upper="-1", effort="-1", velocity="x") + '<axis xyz="0 0 0"/>')
    with pytest.raises(BadRobot) as few:
        read(*links[:2], bad.replace('"b"', '"b0"'), "<dance/>")
    places = [text.split(": ")[0] for text in str(few.value).splitlines()]
    assert places == ["r.urdf:3"] + ["r.urdf:4"] * 4
    assert few.value.notes == ("passed over: dance (line 5): it is not part of a body",)
    with pytest.raises(BadRobot) as many:
        read(*links)
    assert len(str(many.value).splitlines()) == SHOWN_MAX + 1 and str(many.value).endswith("... and 8 more")


@pytest.mark.parametrize("kind", ["hinge", "planar"])
def test_a_joint_of_an_unknown_type_is_read_on_and_not_called_fixed(kind: str) -> None:
    limits = limit(lower="1", upper="-1", effort="x", velocity="0") + '<axis xyz="0 0 0"/>'
    joints = joint("j", "ab", limits + '<mimic joint="none"/>', kind), joint("k", "ac", mimic("j"))
    with pytest.raises(BadRobot) as refusal:
        read(link("a"), link("b"), link("c"), *joints)
    errors = [line.removeprefix("r.urdf:5: ") for line in str(refusal.value).splitlines()]
    assert [error.split(",")[0] for error in errors] == [
        "an unknown type of joint",
        "effort of limit is not a finite number",
        "reversed limits: lower is 1",
        "an axis without a direction",
        "no joint of this name to follow",
    ]
    assert refusal.value.notes == ()


def test_an_element_twice_is_one_and_blank_lines_above_the_head_are_passed_over() -> None:
    axis = '<axis xyz="0 0 1"/>'
    assert pair(LIMIT + axis + axis).links[1].axis == (0.0, 0.0, 1.0)
    with pytest.raises(AssetError, match=r"^r\.urdf:4: a robot without links"):
        read_urdf("r.urdf", {"r.urdf": b"\n \n<?xml version='1.0'?>\n<robot/>"})


# --- looks -----------------------------------------------------------------------------------------------------------

RED: Final = '<material name="red"><color rgba="1 0 0 1"/></material>'


def visual(shape: str, material: str = "") -> str:
    return f"<visual><geometry>{shape}</geometry>{material}</visual>"


def test_looks_have_shapes_and_colours_of_their_own() -> None:
    looks = [
        visual('<box size="2 4 6"/>', '<material name="red"/>'),
        visual('<sphere radius="3"/>'),
        visual('<mesh filename="a.obj" scale="1 2 -3"/>', '<material name="x"><color rgba="0 0 1 0.5"/></material>'),
    ]
    robot = read(RED, link("a", MASS + BALL + "".join(looks)), drawn=drawn_content("a.obj", SHARD))
    box, ball, mesh = robot.links[0].visuals
    assert (box.geometry, box.colour, ball.geometry) == (Box((1.0, 2.0, 3.0)), (1.0, 0.0, 0.0, 1.0), Sphere(3.0))
    assert ball.colour == (0.6, 0.6, 0.6, 1.0) and mesh.colour == (0.0, 0.0, 1.0, 0.5)
    assert isinstance(mesh.geometry, Mesh) and robot.notes == ()
    plain = {tuple(place) for place in mesh.geometry.vertices.tolist()}
    assert plain == {(0.0, 0.0, -0.0), (1.0, 0.0, 0.0), (0.0, 2.0, 0.0), (0.0, 0.0, -3.0)}
    one, other, third = mesh.geometry.vertices[mesh.geometry.triangles[0]]
    assert np.cross(other - one, third - one)[2] < 0.0, "mirrored, a triangle's outside stays outside"
    (shape,) = robot.links[0].shapes
    assert shape.colour == (1.0, 0.0, 0.0, 1.0), "what collides has the colour of the first visual, as ever"


@pytest.mark.parametrize(
    ("looks", "why"),
    [
        ("<visual/>", "a visual without geometry"),
        (visual('<sphere radius="-1"/>'), "radius of sphere is not within 0.0001 to 1000, '-1'"),
        (visual("<cone/>"), "an unknown shape, there are box, sphere, cylinder, capsule, mesh, 'cone'"),
        (visual('<mesh filename="b.obj"/>'), "the file of a mesh is missing, 'b.obj'"),
        (
            visual('<mesh filename="file:///a.obj"/>'),
            "a mesh is a path relative to this file, or package://PACKAGE/PATH, 'file:///a.obj'",
        ),
    ],
)  # fmt: skip
def test_a_visual_that_cannot_be_drawn_is_no_error(looks: str, why: str) -> None:
    robot = read(link("a", MASS + BALL + looks), drawn=undrawn_content("a.obj: too round"))
    assert robot.notes == (f"a visual is not drawn (line 2): {why}",) and robot.links[0].visuals == ()


def test_meshes_that_cannot_be_drawn_for_one_reason_are_one_note() -> None:
    looks = visual('<mesh filename="a.obj"/>') + "\n"
    robot = read(link("a", MASS + BALL + looks * 2), drawn=undrawn_content("a.obj: too round"))
    assert robot.notes == ("a visual is not drawn, a.obj (lines 2, 3): too round",)
    whole = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
    drawn = {"a.obj": undrawn_content("a.obj: gone"), "b.obj": drawn_content("b.obj", whole)}
    given = {"r.urdf": b"", **{f"{name}.visual": content for name, content in drawn.items()}}
    assert undrawn_meshes(given) == ["a visual is not drawn, a.obj: gone"]


def test_a_bad_colour_is_no_error() -> None:
    material = '<material name="m"><color rgba="2 0 0 1"/></material>'
    robot = read(link("a", MASS + BALL + visual('<sphere radius="1"/>', material)))
    assert robot.notes == ("a colour is not used (line 2): a share of a colour is not within 0 to 1, '2 0 0 1'",)
    assert robot.links[0].visuals[0].colour == (0.6, 0.6, 0.6, 1.0)


# --- the proposal ----------------------------------------------------------------------------------------------------


def below(x: float, content: str = LIMIT) -> str:
    return f'<origin xyz="{x} 0 -0.5"/><axis xyz="0 1 0"/>{content}'


TWO: Final = (link("a"), link("b"), link("c"))
SHIN: Final = MASS.replace("<mass", '<origin xyz="0 0 -0.3"/><mass') + BALL
LEGS: Final = (
    *TWO,
    *(link(name) for name in "de"),
    *(joint(ends, ends, below(float(ends in ("ac", "ce")))) for ends in ("ab", "ac", "bd", "ce")),
)
UPRIGHT_AXIS: Final = '<axis xyz="0 0 1"/>'
BASES: Final[dict[str, tuple[bool, tuple[str, ...]]]] = {
    "an object": (False, (link("a"),)),
    "an arm": (True, (*TWO, joint("j", "ab"), joint("k", "bc"))),
    "wheels": (False, (*TWO, joint("j", "ab", "", "continuous"), joint("k", "ac", "", "continuous"))),
    "one wheel": (True, (*TWO, joint("j", "ab", "", "continuous"), joint("k", "bc", "", "continuous"))),
    "legs": (False, LEGS),
    "a gripper that points down": (True, (*TWO, joint("j", "ab", below(0.0)), joint("k", "ac", below(1.0)))),
    "rotors": (
        False,
        (*TWO, *(joint(name, ends, UPRIGHT_AXIS, "continuous") for name, ends in (("j", "ab"), ("k", "ac")))),
    ),
    "one leg": (True, (*TWO, joint("j", "ab", below(0.0)), joint("k", "bc", below(1.0)))),
    "fingers": (True, (*TWO, joint("j", "ab", "", "fixed"), joint("k", "ac"))),
    "shins that turn without end": (
        True,
        (link("a"), link("b", SHIN), link("c", SHIN), joint("j", "ab", "", "continuous"), joint("k", "ac", below(0.0))),
    ),
    "no mass": (True, (link("a", BALL), link("b"), joint("j", "ab", below(0.0)))),
    "the world": (
        True,
        tuple(
            part.replace('"a"', '"world"')
            for part in (*TWO, joint("j", "ab", below(0.0)), joint("k", "ac", below(1.0)))
        ),
    ),
}


@pytest.mark.parametrize("case", BASES)
def test_a_base_is_proposed_to_be_fixed_where_nothing_carries_it(case: str) -> None:
    is_fixed, parts = BASES[case]
    robot = read(*parts)
    assert base_of(robot)[0] is is_fixed, base_of(robot)[1]
    assert f"fixed: {json.dumps(is_fixed)}" in snippet(robot)


def test_a_robot_is_proposed_to_stand_on_the_floor_with_its_wheels_by_speed() -> None:
    _, parts = BASES["wheels"]
    head = joint("head", "ae", UPRIGHT_AXIS, "continuous")
    text = snippet(read(*parts, link("d"), link("e"), joint("arm", "ad"), head))
    assert "z: 100 mm" in text
    assert 'wheels: {kind: joint_velocity, joints: ["j", "k"]}\n' in text
    assert 'joints: {kind: joint_position, joints: ["arm", "head"]}\n' in text
    assert as_json(read(*parts))["fixed"] is False


@pytest.mark.parametrize("arms", [30, 2])
@pytest.mark.parametrize("named", ["arm_%d", "%d_of_arm", "%d"])
def test_a_long_entry_is_on_several_lines_which_select_the_joints(arms: int, named: str) -> None:
    wheels = [joint(f"wheel {number}", "ab", "", "continuous") for number in range(2)]
    wheels[1] = wheels[1].replace('"b"', '"c"')
    names = [named % number for number in range(arms)]
    links = [link("x").replace('"x"', f'"x{number}"') for number in range(arms)]
    joints = [joint(name, "ax").replace('"x"', f'"x{number}"') for number, name in enumerate(names)]
    robot = read(*TWO, *links, *wheels, *joints)
    text = snippet(robot)
    assert max(map(len, text.split("\n"))) <= 100
    tree, problems = read_tree(text, locate_in("page"))
    assert tree is not None and not problems
    actuators = plain(tree)["robots"]["r"]["actuators"]
    body = body_of(robot, "r", ORIGIN, UPRIGHT, fixed=False, surfaces=repeat("default"))
    for actuator, chosen in {"wheels": ["wheel 0", "wheel 1"], "joints": names}.items():
        written = actuators[actuator]["joints"]
        numbers = joint_indices(body, [written] if isinstance(written, str) else written, has_motors=True)
        assert [robot.moving[number] for number in numbers] == chosen
    assert ("*" in text) is (arms > 8 and named != "%d")


def _text(robot: Robot) -> list[str]:
    from foosim.world.bodies.urdf_text import lines

    return [*lines(robot)]
