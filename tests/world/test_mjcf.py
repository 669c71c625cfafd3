"""Robots from MJCF files: what MuJoCo makes of a file itself is what a body of foosim has."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any, Final

import mujoco
import numpy as np
import pytest

from foosim.deployment.assets import pin_assets, read_robot
from foosim.deployment.loader import load_deployment, with_owners
from foosim.node.physics.mujoco_model import ModelBuilder, warnings
from foosim.simulation.simulation import Simulation
from foosim.world.bodies.urdf import body_of, read_urdf
from foosim.world.bodies.visual_meshes import drawn_content, drawn_path
from foosim.world.matter.mesh import AssetError, Mesh
from foosim.world.scene import ORIGIN, UPRIGHT, Mimic
from tests.kinematic_yard import yard_text
from tests.solids import physics

FACES: Final = ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))
CORNERS: Final = ((0.0, 0.0, 0.0), (0.3, 0.0, 0.0), (0.0, 0.2, 0.0), (0.0, 0.0, 0.1))
STL: Final = (
    bytes(80)
    + struct.pack("<I", len(FACES))
    + b"".join(struct.pack("<12fH", 0, 0, 0, *(x for corner in face for x in CORNERS[corner]), 0) for face in FACES)
)
ARM: Final = b"""<mujoco model="reacher">
  <compiler angle="degree" meshdir="assets" autolimits="true" eulerseq="zyx"/>
  <option integrator="implicitfast"/>
  <default>
    <default class="reacher">
      <default class="visual"><geom type="mesh" contype="0" conaffinity="0" group="2" mass="0"/></default>
      <default class="collision"><geom group="3"/></default>
      <default class="finger"><joint type="slide" range="0 0.04" armature="0.1" actuatorfrcrange="-20 20"/></default>
    </default>
  </default>
  <asset>
    <texture type="2d" name="wood" file="/etc/hostname"/>
    <material name="blue" rgba="0 0 1 1" texture="wood"/>
    <mesh file="shard.STL" scale="1 -1 1"/>
    <mesh name="cover" file="shard.STL" scale="0.5 0.5 0.5"/>
  </asset>
  <worldbody>
    <light pos="0 0 3"/>
    <geom name="floor" type="plane" size="1 1 0.1"/>
    <body name="foot" childclass="reacher" pos="0 0 7">
      <geom class="collision" type="cylinder" size="0.1 0.05" mass="3"/>
      <body name="turret" pos="0 0 0.1" euler="90 90 0">
        <joint name="shoulder/pan" axis="0 0 1" range="-120 90" pos="0.02 0.03 -0.1" damping="0.3"/>
        <geom type="sphere" size="0.05" mass="0.4"/>
      <body name="upper arm" euler="30 0 20">
        <inertial pos="0.1 0.01 0" mass="1.2" fullinertia="0.01 0.02 0.025 0.001 0.002 -0.001"/>
        <joint name="shoulder/lift" axis="0 1 1" range="-60 60" pos="0.05 0 0.02" ref="10"/>
        <geom class="visual" mesh="cover" material="blue"/>
        <geom class="visual" type="ellipsoid" size="0.02 0.03 0.04"/>
        <geom class="collision" type="mesh" mesh="shard" euler="0 0 40"/>
        <site name="here" material="blue"/>
        <body name="fore" pos="0.3 0 0.05" quat="0.9 0.1 0.2 -0.1">
          <joint name="roll" type="hinge" axis="1 0 0" pos="-0.1 0.02 0"/>
          <geom class="collision" type="capsule" fromto="0 0 0 0.2 0.05 0.1" size="0.03" mass="0.6"/>
          <body name="left" pos="0.2 0.03 0.1">
            <joint class="finger" name="left" axis="0 1 0"/>
            <geom class="collision" type="box" size="0.02 0.005 0.03" mass="0.05"/>
          </body>
          <body name="right" pos="0.2 -0.03 0.1" euler="180 0 0">
            <joint class="finger" name="right" axis="0 1 0"/>
            <geom type="box" size="0.02 0.005 0.03" mass="0.05" rgba="1 0 0 1"/>
          </body>
        </body>
      </body>
      </body>
    </body>
  </worldbody>
  <equality><joint joint1="right" joint2="left" polycoef="0.01 -0.5 0 0 0"/></equality>
  <actuator>
    <position name="pan" joint="shoulder/pan" kp="100" forcerange="-87 87"/>
    <motor name="lift" joint="shoulder/lift" gear="50" ctrlrange="-1 1"/>
    <position joint="left" kp="10"/>
    <adhesion body="fore" ctrlrange="0 1"/>
  </actuator>
  <keyframe><key name="home" qpos="0 0 0 0 0"/></keyframe>
</mujoco>"""
SHARD: Final = "m/assets/shard.STL"
FILES: Final = {"m/arm.xml": ARM, SHARD: STL, drawn_path(SHARD): drawn_content(SHARD, STL)}
WALKER: Final = b"""<mujoco><worldbody><body name="torso" pos="0 0 1">
  <freejoint/><geom type="capsule" size="0.1" fromto="0 -0.1 0 0 0.1 0" mass="5"/>
  <body name="leg" pos="0 0.1 -0.2">
    <joint name="x" axis="1 0 0" pos="0 0 0.1"/><joint name="z" axis="0 0 1" pos="0 0.05 0.1"/>
    <joint name="y" axis="0 1 0" pos="0 0 0.12"/><geom type="capsule" size="0.04" fromto="0 0 0 0.1 0 -0.3" mass="2"/>
  </body></body></worldbody></mujoco>"""


def test_an_arm_as_menagerie_has_them_is_read() -> None:
    robot = read_urdf("m/arm.xml", FILES)
    assert robot.name == "reacher" and robot.file == "m/arm.xml"
    assert robot.moving == ("shoulder/pan", "shoulder/lift", "roll", "left", "right")
    foot, turret, arm, fore, left, right = robot.links
    assert [link.name for link in robot.links] == ["foot", "turret", "upper arm", "fore", "left", "right"]
    assert [link.joint for link in robot.links] == ["fixed", "revolute", "revolute", "continuous", *["prismatic"] * 2]
    assert arm.limits == pytest.approx(np.radians([-70.0, 50.0])), "from `ref` on"
    assert [link.effort for link in robot.links[1:]] == [87.0, 50.0, float("inf"), 20.0, 20.0]
    assert turret.damping == 0.3 and (arm.mass, fore.mass) == (1.2, 0.6)
    assert right.mimic == Mimic(4, -0.5, 0.01) and left.mimic is None
    (cover,), (finger,) = arm.visuals, right.visuals
    assert isinstance(cover.geometry, Mesh) and cover.geometry.box[1] == pytest.approx((0.15, 0.1, 0.05))
    assert cover.colour == (0.0, 0.0, 1.0, 1.0) and finger.colour == (1.0, 0.0, 0.0, 1.0)
    assert not foot.visuals, "a viewer hides its group"
    noted = {note.removeprefix("passed over: ").split()[0] for note in robot.notes}
    passed_over = {"actuator", "armature", "geom", "keyframe", "light", "option", "site"}
    assert noted == passed_over | {"a", "no"}, "an ellipsoid that is not drawn, no greatest velocity"


def compiled(path: str, files: dict[str, bytes]) -> tuple[Any, Any, list[str], list[int]]:
    """MuJoCo's own model of a file, that of foosim's body, the joints, and their numbers in the latter."""
    robot = read_urdf(path, files)
    joints = [link.joint_name for link in robot.links if link.joint_name]
    body = body_of(robot, "robot", ORIGIN, UPRIGHT, fixed=True, surfaces=["default"] * len(robot.links))
    built = ModelBuilder(physics(), 0.002, (), [body], ())
    plain = files[path].replace(b'file="/etc/hostname"', b'builtin="flat" width="1" height="1"')
    for base in (b"<freejoint/>", b'pos="0 0 1"', b'pos="0 0 7"'):
        plain = plain.replace(base, b"")
    assets = {"shard.STL": STL}
    spec = mujoco.MjSpec.from_string(plain.decode(), assets=assets)
    return spec.compile(), built, joints, built.placed[0].vs


@pytest.mark.parametrize(
    ("path", "files", "share"), [("m/arm.xml", FILES, 1e-6), ("walker.xml", {"walker.xml": WALKER}, 3e-3)]
)
def test_masses_and_places_are_those_of_mujoco(path: str, files: dict[str, bytes], share: float) -> None:
    """The matrix of inertia, which all masses, axes and places of joints are in, and gravity's moments, in any pose.

    Of three joints at one body two have links with a thousandth of its mass each.
    """
    wanted, built, joints, places = compiled(path, files)
    theirs = [wanted.joint(name) for name in joints]
    random = np.random.default_rng(1)
    for _ in range(10):
        angles = random.uniform(-0.5, 0.5, len(joints))
        own, found = mujoco.MjData(wanted), built.d
        for joint, angle in zip(theirs, angles, strict=True):
            own.qpos[joint.qposadr] = wanted.qpos0[joint.qposadr] + angle
        found.qpos[built.placed[0].qs] = angles
        matrices, moments = [], []
        for m, d, at in ((wanted, own, [int(one.dofadr[0]) for one in theirs]), (built.m, found, places)):
            mujoco.mj_forward(m, d)
            whole = np.zeros((m.nv, m.nv))
            mujoco.mj_fullM(m, d, whole)
            matrices.append((whole - np.diag(m.dof_armature))[np.ix_(at, at)])
            moments.append(d.qfrc_bias[at])
        for own_one, found_one in (matrices, moments):
            assert found_one == pytest.approx(own_one, abs=share * float(np.abs(own_one).max()))
        theirs_are = points(wanted, own, (wanted.geom_contype > 0) & (wanted.geom_bodyid > 0))
        assert points(built.m, found, built.m.geom_bodyid > 0) == pytest.approx(theirs_are, abs=1e-6)


def points(m: Any, d: Any, which: Any) -> Any:
    """The middles of shapes, in the world, and the corners of those that are meshes, sorted."""
    found = []
    for geom in np.flatnonzero(which):
        if m.geom_type[geom] == mujoco.mjtGeom.mjGEOM_MESH:
            first = m.mesh_vertadr[m.geom_dataid[geom]]
            corners = m.mesh_vert[first : first + m.mesh_vertnum[m.geom_dataid[geom]]]
        else:
            corners = np.zeros((1, 3))
        found += (corners @ d.geom_xmat[geom].reshape(3, 3).T + d.geom_xpos[geom]).tolist()
    return np.array(sorted(found, key=lambda at: [round(x, 4) for x in at]))


def test_it_runs_and_its_finger_follows(tmp_path: Path) -> None:
    for path, content in FILES.items():
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_bytes(content)
    arm = "robots.arm={model: mjcf, file: m/arm.xml, at: {x: 3 m, z: 2 m}, fixed: true, actuators: {}}"
    text = with_owners(yard_text({}, engine="mujoco", tick="5 ms", substeps=2), "yard.yaml", {"n1": ["*"]}, [arm])
    text, files = pin_assets(text, "yard.yaml", tmp_path)
    assert files == FILES, "of a mesh that is only seen, the drawn form"
    with Simulation(load_deployment(text, "yard.yaml").with_assets(files)) as made:
        for _ in range(100):
            made.step({})
            *_, left, right = made.frame.vector("arm", "joint_positions", 5)
            assert right == pytest.approx(0.01 - 0.5 * left, abs=2e-4)
    assert read_robot(tmp_path / "m" / "arm.xml", tmp_path).moving == read_urdf("m/arm.xml", FILES).moving


BALL: Final = (
    b'<mujoco><worldbody><body name="b"><joint name="j" type="ball"/><geom size="0.1"/></body></worldbody></mujoco>'
)
TENDON: Final = b'<tendon><fixed name="t"><joint joint="left" coef="1"/></fixed></tendon><keyframe>'
BAD: Final = {
    "other": (b"<robot/>", [":1: no MJCF: the outermost element is mujoco, 'robot'"]),
    "ball": (BALL, [":1: an unknown type of joint", "three revolute joints do the same, 'spherical'"]),
    "slides": (BALL.replace(b"ball", b"slide"), [":1: a prismatic joint without limit, 'j'"]),
    "two trees": (
        BALL.replace(b"</worldbody>", b"<body><geom size='1'/></body></worldbody>"),
        [":1: 2 links that hang"],
    ),
    "loop and soft": (
        ARM.replace(b"<equality>", b'<equality><connect body1="left"/>').replace(b"<site", b"<composite"),
        [":31: a soft body", ":48: a loop: the bodies of a robot are a tree, 'connect'"],
    ),
    "curve": (ARM.replace(b"-0.5 0 0 0", b"-0.5 1 0 0"), [":48: an unsupported equality", "right"]),
    "tendon": (
        ARM.replace(b"<equality>", b'<equality><tendon tendon1="t"/>').replace(b"<keyframe>", TENDON),
        [":48: an unsupported equality", "'t'"],
    ),
    "mass of meshes": (
        ARM.replace(b'"box" size="0.02 0.005 0.03" mass="0.05"', b'"mesh" mesh="shard"'),
        [":35: a body without inertial, whose mass is that of a mesh", ":39: a body"],
    ),
    "shapes and files": (
        ARM.replace(b'"0.02 0.03 0.04"', b'"1 1 1" contype="1"').replace(
            b'file="shard.STL" scale="1 ', b'name="shard" file="../../../h.stl" scale="1 '
        ),
        [":29: an unknown shape, there are box, sphere, cylinder, capsule, mesh, 'ellipsoid'", ":30: "],
    ),
    "parts": (ARM.replace(b"<option", b'<include file="/etc/hosts"/><option'), [":3: a part of another file"]),
    "parts in capitals": (
        ARM.replace(b"<option", b'<Include file="/etc/hosts"/><option'),
        [":3: a part of another file"],
    ),
    "copies": (
        ARM.replace(b"<worldbody>", b'<worldbody><replicate count="1000000000"/>', 1),
        ["a count of copies, without a bound: read the file", "'replicate'"],
    ),
    "MuJoCo": (ARM.replace(b'childclass="reacher"', b'childclass="x"'), [":20: MuJoCo refuses it: ", "default"]),
}


@pytest.mark.parametrize("name", BAD)
def test_what_would_be_another_robot_is_refused(name: str) -> None:
    content, errors = BAD[name]
    with pytest.raises(AssetError) as refused:
        read_urdf("m/arm.xml", {**FILES, "m/arm.xml": content})
    for error in errors:
        assert (f"m/arm.xml{error}" if error.startswith(":") else error) in str(refused.value)


def test_sizes_of_memory_in_a_file_are_passed_over(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """And what MuJoCo warns of is written to no file, and fails no engine."""
    monkeypatch.chdir(tmp_path)
    greedy = b"""<size memory="1000G" nuserdata="2000000000" nkey="2000000000" nuser_body="1000000000"/>
    <sensor><user dim="1000000000"/></sensor><keyframe><key qpos="nan"/></keyframe>"""
    content = ARM.replace(b"<worldbody>", greedy.replace(b"\n", b"") + b"<worldbody>", 1)
    found = read_urdf("m/arm.xml", {**FILES, "m/arm.xml": content})
    assert found.links == read_urdf("m/arm.xml", {**FILES, "m/arm.xml": ARM}).links
    assert not warnings and not [*tmp_path.iterdir()]
