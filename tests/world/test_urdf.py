"""Robots from URDF files: trees, masses, shapes as the file says, against Bullet's own reading; and bad files."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import repeat
from math import cos, pi, sin, sqrt
from pathlib import Path
from typing import Any, Final

import numpy as np
import pybullet
import pytest

from foosim.world.bodies.inertia import MassOf, combined, turned
from foosim.world.bodies.urdf import Robot, body_of, meshes_of, read_urdf, start_of
from foosim.world.bodies.xml_tree import BYTES_MAX, DEPTH_MAX, ELEMENTS_MAX
from foosim.world.component_types.descriptions import BODY, Model
from foosim.world.component_types.settings import RobotSettings
from foosim.world.kinematics import forward_kinematics
from foosim.world.layout import Entity
from foosim.world.matter.mesh import AssetError
from foosim.world.scene import (
    MOVING,
    ORIGIN,
    UPRIGHT,
    Body,
    Box,
    Capsule,
    Cylinder,
    Hull,
    Link,
    Sphere,
    Vector,
    from_rpy,
    rotate,
)

ARM: Final = Path(__file__).parents[2] / "deploy" / "models" / "arm.urdf"
MASS: Final = '<inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01"/></inertial>'
BALL: Final = '<collision><geometry><sphere radius="0.1"/></geometry></collision>'
LIMIT: Final = '<limit lower="-1" upper="1" effort="5" velocity="2"/>'
SHARD: Final = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\n"

# An inertia that is neither diagonal nor about the link's origin, in a frame that is turned; joints of each kind, with
# axes and origins askew; a link of two shapes, one of a capsule, a mesh of two scales, a frame without a mass.
ASKEW: Final = f"""<?xml version="1.0"?>
<robot name="askew">
  <material name="red"><color rgba="1 0 0 0.5"/></material>
  <link name="base">{MASS}{BALL}</link>
  <link name="Turret_1">
    <inertial>
      <origin xyz="0.3 -0.2 0.1" rpy="0.4 -0.7 1.1"/>
      <mass value="2.5"/>
      <inertia ixx="0.05" ixy="0.01" ixz="-0.008" iyy="0.06" iyz="0.004" izz="0.045"/>
    </inertial>
    <visual><geometry><mesh filename="looks.dae"/></geometry><material name="red"/></visual>
    <collision><origin xyz="0.1 0 0" rpy="0 0.5 0"/><geometry><box size="0.2 0.4 0.6"/></geometry></collision>
    <collision><geometry><cylinder radius="0.1" length="0.5"/></geometry></collision>
  </link>
  <link name="slide">
    {MASS}<collision><geometry><capsule radius="0.05" length="0.3"/></geometry></collision>
  </link>
  <link name="wheel">{MASS}
    <collision><geometry><mesh filename="../meshes/shard.obj" scale="0.1 0.2 -0.1"/></geometry></collision>
  </link>
  <link name="camera.frame"/>
  <joint name="swing" type="revolute">
    <parent link="base"/><child link="Turret_1"/><origin xyz="0.1 0.2 0.3" rpy="0.3 0.2 -0.5"/>
    <axis xyz="1 2 -2"/><limit lower="-0.5" upper="1.5" effort="12" velocity="3"/><dynamics damping="0.7"/>
  </joint>
  <joint name="reach" type="prismatic">
    <parent link="Turret_1"/><child link="slide"/><origin xyz="0 0 0.5" rpy="1 0 0"/>
    <axis xyz="0 0.6 0.8"/><limit lower="0" upper="0.4" effort="80" velocity="0.5"/>
  </joint>
  <joint name="roll" type="continuous">
    <parent link="Turret_1"/><child link="wheel"/><origin xyz="-0.2 0.1 0"/>
  </joint>
  <joint name="mount" type="fixed">
    <parent link="slide"/><child link="camera.frame"/><origin xyz="0 0 0.1" rpy="0 1.5 0"/>
  </joint>
</robot>
"""
FILES: Final = {"robots/askew.urdf": ASKEW.encode(), "meshes/shard.obj": SHARD}


def askew() -> Robot:
    return read_urdf("robots/askew.urdf", FILES)


def arm() -> Robot:
    return read_urdf("models/arm.urdf", {"models/arm.urdf": ARM.read_bytes()})


def entity_of(body: Body) -> tuple[Entity, list[float]]:
    """A body's place in a frame of its own, and the numbers of it, at rest."""
    slots = {
        **(BODY if body.is_free else {}),
        "joint_positions": len(body.joints),
        "joint_velocities": len(body.joints),
    }
    offsets, size = {}, 0
    for slot, count in slots.items():
        offsets[slot], size = size, size + count
    model = Model(type_name="model", name="urdf", factory=object, settings=RobotSettings, slots=slots)
    return Entity(0, body.name, model, 0, size, size, offsets, slots, slots), [0.0] * size


# --- what a file says ------------------------------------------------------------------------------------------------


def test_the_tree_has_links_joints_and_limits_as_the_file_says() -> None:
    robot = askew()
    assert [link.name for link in robot.links] == ["base", "Turret_1", "slide", "camera.frame", "wheel"]
    assert robot.joints == ("", "swing", "reach", "mount", "roll") and robot.moving == ("swing", "reach", "roll")
    _, turret, slide, camera, wheel = robot.links
    assert [link.parent for link in robot.links] == [-1, 0, 1, 2, 1]
    assert [link.joint for link in robot.links] == ["fixed", "revolute", "prismatic", "fixed", "continuous"]
    assert turret.axis == pytest.approx((1 / 3, 2 / 3, -2 / 3)) and turret.limits == (-0.5, 1.5)
    assert (turret.effort, turret.speed, turret.damping) == (12.0, 3.0, 0.7)
    assert turret.position == (0.1, 0.2, 0.3) and turret.orientation == from_rpy(0.3, 0.2, -0.5)
    assert slide.axis == pytest.approx((0.0, 0.6, 0.8)) and slide.limits == (0.0, 0.4)
    assert wheel.axis == (1.0, 0.0, 0.0) and wheel.effort == wheel.speed == float("inf")
    assert (camera.mass, camera.inertia, camera.shapes) == (0.0, ORIGIN, ())
    assert robot.mass == pytest.approx(5.5)


def test_rpy_turns_about_fixed_axes_as_urdf_defines_it() -> None:
    roll, pitch, yaw = 0.4, -0.7, 1.1
    x = rotate(from_rpy(roll, pitch, yaw), (1.0, 0.0, 0.0))
    assert x == pytest.approx((cos(yaw) * cos(pitch), sin(yaw) * cos(pitch), -sin(pitch)))


def test_shapes_have_sizes_poses_and_the_colour_of_the_first_visual() -> None:
    _, turret, slide, _, wheel = askew().links
    box, cylinder = turret.shapes
    assert box.geometry == Box((0.1, 0.2, 0.3)) and box.position == (0.1, 0.0, 0.0)
    assert box.orientation == from_rpy(0.0, 0.5, 0.0) and cylinder.geometry == Cylinder(0.1, 0.5)
    assert box.colour == cylinder.colour == (1.0, 0.0, 0.0, 0.5)
    assert slide.shapes[0].geometry == Capsule(0.05, 0.3)
    hull = wheel.shapes[0].geometry
    assert isinstance(hull, Hull)
    corners = np.array([(0.0, 0.0, -0.1), (0.0, 0.0, 0.0), (0.0, 0.2, 0.0), (0.1, 0.0, 0.0)])
    assert np.allclose(hull.mesh.vertices[np.lexsort(hull.mesh.vertices.T[::-1])], corners, atol=1e-7)
    assert isinstance(askew().links[0].shapes[0].geometry, Sphere)


def test_an_inertia_is_that_of_its_file_in_the_links_frame() -> None:
    turret = askew().links[1]
    x, y, z = turret.inertia
    assert turned((x, 0.0, 0.0, y, 0.0, z), turret.principal) == pytest.approx(
        turned((0.05, 0.01, -0.008, 0.06, 0.004, 0.045), from_rpy(0.4, -0.7, 1.1)), abs=1e-15
    )
    assert turret.centre_of_mass == (0.3, -0.2, 0.1)


def test_meshes_are_named_by_paths_inside_the_asset_folder() -> None:
    drawn = "robots/looks.dae.visual"
    assert meshes_of("robots/askew.urdf", ASKEW.encode()) == ("meshes/shard.obj", drawn)
    packaged = ASKEW.replace("../meshes/", "package://pack/meshes/").encode()
    assert meshes_of("robots/askew.urdf", packaged) == ("pack/meshes/shard.obj", drawn)


# --- against Bullet --------------------------------------------------------------------------------------------------


@pytest.fixture
def client() -> Iterator[int]:
    client = pybullet.connect(pybullet.DIRECT)
    yield client
    pybullet.disconnect(client)


def loaded(client: int, tmp_path: Path, robot: Robot, text: bytes, **about: Any) -> tuple[int, dict[str, int]]:
    """Bullet's own robot of a file, and the number of each link in it."""
    folder = tmp_path / "robots"
    folder.mkdir()
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes" / "shard.obj").write_bytes(SHARD)
    seen = re.sub(rb"<visual>.*?</visual>", b"", text, flags=re.DOTALL)  # a file that Bullet would look for
    (folder / "robot.urdf").write_bytes(seen)
    flags = pybullet.URDF_USE_INERTIA_FROM_FILE
    body = pybullet.loadURDF(str(folder / "robot.urdf"), flags=flags, physicsClientId=client, **about)
    numbers = {robot.links[0].name: -1}
    for joint in range(pybullet.getNumJoints(body, physicsClientId=client)):
        numbers[pybullet.getJointInfo(body, joint, physicsClientId=client)[12].decode()] = joint
    assert {*numbers} == {link.name for link in robot.links}
    return body, numbers


ROBOTS: Final = {"arm": (arm, ARM.read_bytes()), "askew": (askew, ASKEW.encode())}


def tensor_of(link: Link) -> tuple[float, ...]:
    x, y, z = link.inertia
    return turned((x, 0.0, 0.0, y, 0.0, z), link.principal)


@pytest.mark.parametrize("name", ROBOTS)
def test_masses_and_inertias_are_those_that_bullet_reads(name: str, client: int, tmp_path: Path) -> None:
    make, text = ROBOTS[name]
    robot = make()
    body, numbers = loaded(client, tmp_path, robot, text, useFixedBase=False)
    compared = 0
    for link in robot.links:
        if link.mass == 0.0:
            continue  # Bullet takes a link without an inertial for one of 1 kg
        about_it = pybullet.getDynamicsInfo(body, numbers[link.name], physicsClientId=client)
        (x, y, z), axes = about_it[2], about_it[4]
        assert about_it[0] == pytest.approx(link.mass, rel=1e-12)
        assert about_it[3] == pytest.approx(link.centre_of_mass, abs=1e-12)
        assert turned((x, 0.0, 0.0, y, 0.0, z), axes) == pytest.approx(tensor_of(link), abs=1e-8 * max(link.inertia))
        compared += 1
    assert compared == {"arm": 8, "askew": 4}[name]


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("fixed", [True, False])
def test_links_are_where_bullet_has_them_at_drawn_joints(name: str, fixed: bool, client: int, tmp_path: Path) -> None:
    make, text = ROBOTS[name]
    robot = make()
    random = np.random.default_rng(3)
    position: Vector = (0.4, -1.2, 0.9)
    orientation = from_rpy(0.2, 0.5, -2.0)
    about_it = {"useFixedBase": fixed, "basePosition": position, "baseOrientation": orientation}
    bullet, numbers = loaded(client, tmp_path, robot, text, **about_it)
    body = body_of(robot, "arm-1", position, orientation, fixed=fixed, surfaces=repeat("grip"), speed_limit=5.0)
    entity, state = entity_of(body)
    if not fixed:
        at, turn = start_of(body, position, orientation)
        state[:7] = [*at, *turn]
    for _ in range(20):
        values = []
        for link, joint in zip(robot.links, robot.joints, strict=True):
            if joint in robot.moving:
                low, high = link.limits if link.joint != "continuous" else (-pi, pi)
                values.append(float(random.uniform(low, high)))
                pybullet.resetJointState(bullet, numbers[link.name], values[-1], physicsClientId=client)
        start = entity.offsets["joint_positions"]
        state[start : start + len(values)] = values
        poses = forward_kinematics(body, entity, state)
        for link, (full, place, turned_by) in zip(robot.links[1:], poses[1:], strict=True):
            assert full == f"arm-1/{link.name}"
            seen = pybullet.getLinkState(
                bullet, numbers[link.name], computeForwardKinematics=True, physicsClientId=client
            )
            assert seen[4] == pytest.approx(place, abs=1e-6)
            same = abs(sum(one * other for one, other in zip(seen[5], turned_by, strict=True)))
            assert same == pytest.approx(1.0, abs=1e-6)


# --- bodies ----------------------------------------------------------------------------------------------------------


def test_a_free_robot_stands_where_it_is_placed_by_its_first_links_frame() -> None:
    robot = askew()
    body = body_of(robot, "r", ORIGIN, UPRIGHT, fixed=False, surfaces=repeat("grip"), speed_limit=5.0)
    assert (
        body.is_free
        and body.speed_limit == 5.0
        and {shape.surface for link in body.links for shape in link.shapes} == {"grip"}
    )
    entity, state = entity_of(body)
    position, orientation = start_of(body, (1.0, 2.0, 3.0), from_rpy(0.1, 0.2, 0.3))
    state[:7] = [*position, *orientation]
    _, place, turned_by = forward_kinematics(body, entity, state)[0]
    assert place == pytest.approx((1.0, 2.0, 3.0)) and turned_by == pytest.approx(from_rpy(0.1, 0.2, 0.3))


FOOTPRINT: Final = f"""<robot name="cart">
  <link name="footprint"/>
  <link name="hull"><inertial><origin xyz="0.1 0 0"/><mass value="4"/><inertia ixx="1" iyy="2" izz="2.5"/></inertial>
    {BALL}</link>
  <link name="mast">{MASS}</link>
  <joint name="up" type="fixed"><parent link="footprint"/><child link="hull"/><origin xyz="0 0 0.2"/></joint>
  <joint name="on" type="fixed">
    <parent link="hull"/><child link="mast"/><origin xyz="0 0 1" rpy="0 0 1.5707963267948966"/>
  </joint>
</robot>"""


def test_a_free_first_link_without_a_mass_has_that_of_what_is_fixed_to_it() -> None:
    robot = read_urdf("cart.urdf", {"cart.urdf": FOOTPRINT.encode()})
    body = body_of(robot, "cart", ORIGIN, UPRIGHT, fixed=False, surfaces=repeat("s"), speed_limit=1.0)
    parts = [
        MassOf(4.0, (0.1, 0.0, 0.2), (1.0, 0.0, 0.0, 2.0, 0.0, 2.5)),
        MassOf(1.0, (0.0, 0.0, 1.2), (0.01, 0.0, 0.0, 0.01, 0.0, 0.01)),
    ]
    whole = combined(parts)
    first, hull, mast = body.links
    assert (first.mass, hull.mass, mast.mass) == (5.0, 0.0, 0.0)
    assert first.centre_of_mass == pytest.approx(whole.centre) and tensor_of(first) == pytest.approx(whole.tensor)
    assert hull.shapes and hull.joint == mast.joint == "fixed", "shapes and names stay where they are"
    fixed = body_of(robot, "cart", ORIGIN, UPRIGHT, fixed=True, surfaces=repeat("s"))
    assert [link.mass for link in fixed.links] == [0.0, 4.0, 1.0]


def test_the_arm_has_seven_joints_and_a_frame_to_grip_with() -> None:
    robot = arm()
    assert len(robot.moving) == 7 and robot.links[-1].name == "grip" and robot.links[-1].mass == 0.0
    assert all(link.joint == "revolute" for link in robot.links if link.joint in MOVING)
    assert all(link.effort > 0 and link.speed > 0 and link.limits[0] < 0 < link.limits[1] for link in robot.links[1:8])
    assert robot.mass == pytest.approx(14.9)
    body = body_of(robot, "arm", ORIGIN, UPRIGHT, fixed=True, surfaces=repeat("arm"))
    entity, state = entity_of(body)
    assert forward_kinematics(body, entity, state)[-1][1] == pytest.approx((0.0, 0.0, 1.13))
    # Each shoulder can hold the arm stretched out: torque of all that is beyond, against effort.
    state[entity.offsets["joint_positions"] + 1] = pi / 2
    poses = forward_kinematics(body, entity, state)
    for number, link in enumerate(robot.links):
        if link.joint in MOVING:
            axis, torque = rotate(poses[number][2], link.axis), 0.0
            for beyond in range(number, len(robot.links)):
                x, y, _ = rotate(poses[beyond][2], robot.links[beyond].centre_of_mass)
                place = poses[beyond][1]
                dx, dy = place[0] + x - poses[number][1][0], place[1] + y - poses[number][1][1]
                torque += 9.81 * robot.links[beyond].mass * (dx * axis[1] - dy * axis[0])
            assert abs(torque) < 0.6 * link.effort, link.name


def test_the_arms_masses_are_spread_as_its_shapes_are() -> None:
    for link in arm().links[:8]:
        radii = [sqrt(moment / link.mass) for moment in link.inertia]
        assert min(radii) > 0.01 and max(radii) < 0.1, link.name


# --- bad files -------------------------------------------------------------------------------------------------------


def robot_text(links: str = "", joint: str = "", more: str = "", kind: str = "revolute") -> bytes:
    """A robot of two links a, b and a joint j between them; `joint` is what is in that, beside its ends."""
    ends = '<parent link="a"/><child link="b"/>'
    return (
        f'<robot name="r">\n<link name="a">{MASS}{BALL}</link><link name="b">{MASS}{BALL}</link>{links}{more}\n'
        f'<joint name="j" type="{kind}">{ends}{joint or LIMIT}</joint>\n</robot>'
    ).encode()


def inertial(mass: str = "1", **moments: str) -> bytes:
    words = " ".join(f'{key}="{value}"' for key, value in moments.items())
    link = f'<link name="c"><inertial>\n<mass value="{mass}"/>\n<inertia {words}/></inertial></link>'
    return robot_text(link + '<joint name="k" type="fixed"><parent link="a"/><child link="c"/></joint>')


def collision(shape: str) -> bytes:
    link = f'<link name="c">\n<collision><geometry>\n{shape}</geometry></collision></link>'
    return robot_text(link + '<joint name="k" type="fixed"><parent link="a"/><child link="c"/></joint>')


def joined(*pairs: str, names: str = "abc") -> bytes:
    """Links of one letter, and a fixed joint for each pair of them, on a line of its own."""
    links = "".join(f'<link name="{name}">{MASS}{BALL}</link>' for name in names)
    joints = "".join(
        f'\n<joint name="{pair}" type="fixed"><parent link="{pair[0]}"/><child link="{pair[1]}"/></joint>'
        for pair in pairs
    )
    return f'<robot name="r">\n{links}{joints}</robot>'.encode()


BOMB: Final = b"""<?xml version="1.0"?>
<!DOCTYPE robot [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;">]>
<robot name="&b;"/>"""
OUTSIDE: Final = b"""<!DOCTYPE robot [<!ENTITY secret SYSTEM "file:///etc/passwd">]>
<robot name="r">&secret;</robot>"""
UNIT: Final = {"ixx": "0.01", "iyy": "0.01", "izz": "0.01"}

BAD: Final[dict[str, tuple[bytes, str]]] = {
    "empty": (b"", "1: an empty file"),
    "blank": (b" \n\n", "1: an empty file"),
    "text": (b"hello", "1: no XML, syntax error"),
    "cut": (robot_text()[:60], "2: the file ends here, in the unclosed inertial of line 2"),
    "cut in a tag": (robot_text()[:40], "2: the file ends here, in the unclosed link of line 2"),
    "only a head": (b"<?xml version='1.0'?>\n<!-- -->\n", "3: the file ends here, without an element"),
    "zero byte": (b"<robot>\0</robot>", "1: no XML, not well-formed"),
    "not UTF-8": (b'<robot name="\xff"/>', "1: no XML, not well-formed"),
    "no encoding": (b'<?xml version="1.0" encoding="utf-99"?><robot/>', "1: no XML, (unknown|an unsupported) encoding"),
    "wide encoding": (b'<?xml version="1.0" encoding="gbk"?><robot/>', "1: no XML, an unsupported encoding"),
    "two robots": (b"<robot/>\n<robot/>", "2: no XML, junk after document element"),
    "bomb": (BOMB, "2: a document type: it may define entities"),
    "external entity": (OUTSIDE, "1: a document type"),
    "unknown entity": (b"<robot>\n&lol;</robot>", "2: no XML, undefined entity"),
    "deep": (b"<robot>" + b"<link>" * 99 + b"</link>" * 99 + b"</robot>", f"1: elements more than {DEPTH_MAX} deep"),
    "many": (b"<robot>" + b"<a/>\n" * (ELEMENTS_MAX + 1) + b"</robot>", f": more than {ELEMENTS_MAX} elements"),
    "huge": (b"<robot>" + b" " * BYTES_MAX + b"</robot>", f"bytes, at most {BYTES_MAX} are allowed"),
    "long value": (b'<robot name="' + b"x" * 5000 + b'"/>', "1: more than 1000 characters"),
    "many attributes": (b"<robot " + b" ".join(b'a%d="1"' % i for i in range(99)) + b"/>", "1: more than 32 attri"),
    "sdf": (b"<sdf version='1.7'/>", "1: no URDF: the outermost element is robot, 'sdf'"),
    "xacro": (
        b'<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="r">\n<xacro:include filename="a"/></robot>',
        "2: a file of xacro, 'xacro:include', which makes a URDF file of it: xacro r.urdf > robot.urdf",
    ),
    "no links": (b"<robot/>", "1: a robot without links"),
    "no shapes": (b'<robot><link name="a"/></robot>', "1: a robot without a collision shape"),
    "no name": (robot_text("\n<link/>"), "3: link without name"),
    "empty name": (robot_text('\n<link name=" "/>'), "3: link with an empty name"),
    "bad name": (robot_text('\n<link name="a&#133;b"/>'), "3: a name has at most 256 characters, none of control"),
    "long name": (robot_text(f'\n<link name="{"a" * 257}"/>'), "3: a name has at most 256 characters"),
    "same links": (robot_text('\n<link name="a"/>'), "3: a link with the name of that of line 2, 'a'"),
    "same joints": (
        robot_text(more='\n<joint name="j" type="fixed"><parent link="a"/><child link="b"/></joint>'),
        "4: a jo",
    ),
    "two roots": (joined("ab"), r"2: 2 links that hang on none, there is one root: a \(line 2\), c \(line 2\)"),
    "two parents": (joined("ab", "ac", "bc"), r"5: a loop: c has two parents, by the joints ac \(line 4\) and bc"),
    "ring": (joined("ab", "bc", "ca"), "3: a loop: each link hangs on another one"),
    "ring beside": (joined("ab", "cd", "dc", names="abcd"), "2: a loop: a link that does not hang on the root, 'c'"),
    "itself": (joined("ab", "cc"), "4: a joint from a link to itself, 'c'"),
    "no such link": (
        robot_text(joint=f'\n<parent link="arm"/>{LIMIT}').replace(b'<parent link="a"/>', b"", 1),
        "4: no link of this name, 'arm'",
    ),
    "no child": (robot_text().replace(b'<child link="b"/>', b""), "3: a joint without child, 'j'"),
    "floating": (
        robot_text(kind="floating"),
        "3: an unknown type of joint, valid are fixed, .*a free joint is the base's alone.*'floating'",
    ),
    "planar": (robot_text(kind="planar"), "3: .*two prismatic joints and a revolute one do the same, 'planar'"),
    "kind": (
        robot_text(kind="hinge"),
        "3: an unknown type of joint, valid are fixed, revolute, continuous, prismatic, 'hinge'",
    ),
    "zero axis": (robot_text(joint=LIMIT + '\n<axis xyz="0 0 0"/>'), "4: an axis without a direction, '0 0 0'"),
    "two axes": (
        robot_text(joint=LIMIT + '<axis xyz="1 0 0"/>\n<axis xyz="0 1 0"/>'),
        "4: a second axis in the joint of line 3, different from the first",
    ),
    "short axis": (robot_text(joint=LIMIT + '<axis xyz="1 0"/>'), "3: xyz of axis has 2 numbers, it has 3, '1 0'"),
    "no limit": (robot_text(joint="<axis xyz='0 0 1'/>"), "3: a revolute joint without limit, 'j'"),
    "reversed": (
        robot_text(joint='<limit lower="1" upper="-1" effort="1" velocity="1"/>'),
        "3: reversed limits: lower is 1, upper -1",
    ),
    "negative effort": (
        robot_text(joint='<limit lower="0" upper="1" effort="-1" velocity="1"/>'),
        "3: effort of limit is not within 0 to inf",
    ),
    "nan": (
        robot_text(joint='<limit lower="nan" upper="1" effort="1" velocity="1"/>'),
        "3: lower of limit is not a finite number, 'nan'",
    ),
    "inf": (
        robot_text(joint='<limit lower="0" upper="inf" effort="1" velocity="1"/>'),
        "3: upper of limit is not a finite number",
    ),
    "underscore": (
        robot_text(joint='<limit lower="0" upper="1_0" effort="1" velocity="1"/>'),
        "3: upper of limit is not a fi",
    ),
    "overflow": (
        robot_text(joint='<limit lower="0" upper="1e999" effort="1" velocity="1"/>'),
        "3: upper of limit is not a finite number",
    ),
    "far": (robot_text(joint=LIMIT + '<origin xyz="0 0 1e4"/>'), "3: xyz of origin is not within -1000 to 1000"),
    "damping": (robot_text(joint=LIMIT + '<dynamics damping="-1"/>'), "3: damping of dynamics is not within 0"),
    "negative mass": (inertial("-1", **UNIT), "3: a mass of -1 kg, valid are 0 to"),
    "absurd mass": (inertial("1e8", **UNIT), r"3: a mass of 1e\+08 kg, valid are"),
    "no moment": (inertial(ixx="1", iyy="1"), "4: inertia without izz"),
    "no shape": (collision(""), r"4: a geometry with 0 shapes: it has one|3: a geometry with 0"),
    "cone": (
        collision('<cone radius="1"/>'),
        "4: an unknown shape, there are box, sphere, cylinder, capsule, mesh, 'cone'",
    ),
    "flat box": (collision('<box size="1 1 0"/>'), "4: size of box is not within 0.0001 to 1000, '1 1 0'"),
    "negative radius": (collision('<sphere radius="-1"/>'), "4: radius of sphere is not within"),
    "no radius": (collision('<cylinder length="1"/>'), "4: cylinder without radius"),
    "missing mesh": (collision('<mesh filename="a.stl"/>'), "4: the file of a mesh is missing, 'a.stl'"),
    "out of folder": (
        collision('<mesh filename="../a.stl"/>'),
        "4: a path inside the asset folder has no empty component",
    ),
    "out of package": (collision('<mesh filename="package://p/../../a.stl"/>'), "4: a path inside the asset folder"),
    "absolute": (collision('<mesh filename="/etc/a.stl"/>'), "4: a path inside the asset folder is relative"),
    "scheme": (
        collision('<mesh filename="file:///a.stl"/>'),
        "4: a mesh is a path relative to this file, or package://PACKAGE/PATH",
    ),
    "no scale": (collision('<mesh filename="shard.obj" scale="1 0 1"/>'), "4: scale of mesh is below 1e-06"),
    "flat mesh": (
        collision('<mesh filename="flat.obj"/>'),
        "4: a mesh without a convex hull: 3 different corners.*'flat.obj'",
    ),
    "bad mesh": (collision('<mesh filename="bad.obj"/>'), "4: an invalid mesh: bad.obj:1: "),
    "loop joint": (
        robot_text(more='\n<loop_joint name="l"/>'),
        "3: not a part of URDF that makes a tree of links, 'loop_joint'",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_a_bad_file_is_refused_with_its_line_and_what_is_valid(name: str) -> None:
    content, what = BAD[name]
    files = {"r.urdf": content, "shard.obj": SHARD, "flat.obj": SHARD[:24] + b"f 1 2 3\n", "bad.obj": b"v 1\n"}
    with pytest.raises(AssetError, match=rf"^r\.urdf:.*{what}" if not what[0].isdigit() else rf"^r\.urdf:{what}"):
        read_urdf("r.urdf", files)


def test_whatever_is_changed_in_a_good_file_is_read_or_refused() -> None:
    """A thousand files with a few bytes changed, doubled or cut: none fails in another way."""
    random = np.random.default_rng(17)
    refused = 0
    for text in (ASKEW.encode(), ARM.read_bytes()):
        for _ in range(500):
            content = bytearray(text)
            for _ in range(int(random.integers(1, 4))):
                at = int(random.integers(len(content)))
                match int(random.integers(3)):
                    case 0:
                        content[at] = int(random.integers(256))
                    case 1:
                        content[at : at + 40] = content[at + 20 : at + 100]
                    case _:
                        del content[at : at + int(random.integers(1, 30))]
            try:
                robot = read_urdf("robots/r.urdf", {"robots/r.urdf": bytes(content), "meshes/shard.obj": SHARD})
            except AssetError as error:
                assert str(error).startswith("robots/r.urdf:")
                refused += 1
            else:
                body_of(robot, "r", ORIGIN, UPRIGHT, fixed=True, surfaces=repeat(""))
    assert 500 < refused < 1000
