"""Robots of the model `urdf`: their state and bodies follow from their files, which travel with the deployment."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Final

import pytest

from foosim.client.commands import CommandEncoder
from foosim.common import limits
from foosim.common.errors import DeploymentError, Malformed
from foosim.console.shown.scene_json import scene_content
from foosim.deployment.assets import pin_assets, read_robot
from foosim.deployment.loader import load_deployment, with_owners
from foosim.deployment.schema import Deployment
from foosim.node.engines_pool import meshes_read
from foosim.node.tick import Stepper
from foosim.protocol.asset_transfer import Fetching
from foosim.world.assembly.body_limits import BodyLimits
from foosim.world.assembly.world import build_scene, initial_numbers
from foosim.world.component_types import registry
from foosim.world.component_types.descriptions import BODY, CONTACTS, JOINTS
from foosim.world.edits import Push, fitting_edits
from foosim.world.kinematics import forward_kinematics
from foosim.world.layout import build_layout
from foosim.world.matter.mesh import AssetError, Mesh, digest_of
from foosim.world.scene import from_rpy, looks_of
from tests.deployed import DEPLOY
from tests.kinematic_yard import yard_text

NAME: Final = "yard.yaml"
TEXT: Final = yard_text({"post": {"model": "differential_drive", "at": {"x": "-9 m"}}}, engine="mujoco", tick="2 ms")
ARM: Final = (DEPLOY / "models" / "arm.urdf").read_bytes()
SHARD: Final = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\n"
MASS: Final = '<inertial><origin xyz="0.1 0 0"/><mass value="1"/><inertia ixx="0.02" ixy="0.01" iyy="0.02" izz="0.03"/>'
CART: Final = f"""<robot name="cart">
  <link name="Hull">{MASS}</inertial>
    <collision><geometry><mesh filename="../meshes/shard.obj" scale="0.1 0.1 0.1"/></geometry></collision></link>
  <link name="wheel">{MASS}</inertial>
    <collision><geometry><sphere radius="0.1"/></geometry></collision></link>
  <joint name="axle" type="continuous"><parent link="Hull"/><child link="wheel"/><origin xyz="0 0.3 0"/></joint>
</robot>
""".encode()
FILES: Final = {"models/arm.urdf": ARM, "models/cart.urdf": CART, "meshes/shard.obj": SHARD}
ROBOTS: Final = (
    "robots.arm={model: urdf, file: models/arm.urdf, at: {x: 3 m, yaw: 90 deg}, fixed: true}",
    "robots.cart={model: urdf, file: models/cart.urdf, at: {x: -3 m, z: 1 m, roll: 30 deg}, fixed: false, "
    "speed_limit: 20 m/s}",
)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for path, content in FILES.items():
        (tmp_path / path).parent.mkdir(exist_ok=True)
        (tmp_path / path).write_bytes(content)
    return tmp_path


def text_with(*sets: str) -> str:
    return with_owners(TEXT, NAME, {"n1": ["*"]}, sets)


@pytest.fixture
def deployment(folder: Path) -> Deployment:
    text, files = pin_assets(text_with(*ROBOTS), NAME, folder)
    return load_deployment(text, NAME).with_assets(files)


# --- files -----------------------------------------------------------------------------------------------------------


def test_the_files_of_robots_and_their_meshes_are_pinned_and_travel(folder: Path) -> None:
    text, files = pin_assets(text_with(*ROBOTS), NAME, folder)
    assert files == FILES
    there = load_deployment(text, NAME)
    assert there.lacks_files and there.files() == {path: digest_of(content) for path, content in FILES.items()}
    fetching = Fetching(there.files(), {digest_of(content): content for content in FILES.values()})
    complete = there.with_assets(fetching.contents())
    assert not complete.lacks_files and complete.asset_files == FILES, "what a capture attaches"
    assert pin_assets(text, NAME, folder) == (text, files), "pinning twice changes nothing"


def test_the_meshes_and_hulls_that_a_node_has_read_are_told_apart(folder: Path) -> None:
    """In the handshake: another version of a library may read other corners from the same file."""
    found = set()
    for content in (SHARD, SHARD.replace(b"v 0 0 1", b"v 0 0 1.0000001"), SHARD):
        (folder / "meshes" / "shard.obj").write_bytes(content)
        text, files = pin_assets(text_with(*ROBOTS), NAME, folder)
        deployment = load_deployment(text, NAME).with_assets(files)
        found.add(meshes_read(Stepper(deployment, build_layout(deployment))))
    assert len(found) == 2 and b"" not in found


def test_links_are_drawn_by_their_visuals_as_far_as_these_are_few(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen = b'<visual><geometry><mesh filename="../meshes/shard.obj"/></geometry></visual>'
    cart = CART.replace(b'<link name="Hull">', b'<link name="Hull">' + seen)
    (folder / "models" / "cart.urdf").write_bytes(cart.replace(b'<link name="wheel">', b'<link name="wheel">' + seen))
    links = read_robot(folder / "models" / "cart.urdf", folder).links
    meshes = [link.visuals for link in links]
    assert all(len(shape.geometry.triangles) == 2 for (shape,) in meshes if isinstance(shape.geometry, Mesh))
    for most, count in ((4, 2), (3, 1), (1, 0)):
        monkeypatch.setattr(limits, "LOOKS_TRIANGLES_MAX", most)
        assert [shapes for _, shapes in looks_of(links)] == [*meshes[:count], *[link.shapes for link in links[count:]]]
    bare = [replace(link, visuals=()) for link in links]
    assert looks_of(bare) == [(link, link.shapes) for link in bare]


def test_a_deployment_without_robots_of_files_names_none(folder: Path) -> None:
    assert pin_assets(text_with(), NAME, folder) == (text_with(), {})
    assert not load_deployment(text_with(), NAME).lacks_files


def test_a_file_that_changed_since_it_was_pinned_is_refused(folder: Path) -> None:
    text, files = pin_assets(text_with(*ROBOTS), NAME, folder)
    for path in FILES:
        with pytest.raises(AssetError, match=rf"^{path}: another file than the digest names"):
            load_deployment(text, NAME).with_assets({**files, path: files[path] + b"\n"})
        with pytest.raises(AssetError, match=rf"^{path}: the file of a robot is missing"):
            load_deployment(text, NAME).with_assets({other: files[other] for other in files if other != path})


def test_another_file_leaves_no_digest_of_the_first(folder: Path) -> None:
    text, _ = pin_assets(text_with(*ROBOTS), NAME, folder)
    again, files = pin_assets(
        with_owners(text, NAME, {"n1": ["*"]}, ["robots.cart.file=models/arm.urdf"]), NAME, folder
    )
    assert [*files] == ["models/arm.urdf"] == [*load_deployment(again, NAME).digests]


@pytest.mark.parametrize(
    ("file", "what"),
    [
        (
            "models/amr.urdf",
            r"^--set:\S*: robots\.arm\.file: no such file in .*, 'models/amr.urdf', nearest is arm.urdf$",
        ),
        ("models/bad.urdf", r"^models/bad\.urdf:1: no XML"),
        ("link.urdf", r"^link\.urdf: a symbolic link"),
    ],
)
def test_a_bad_file_is_refused_at_planning(folder: Path, file: str, what: str) -> None:
    (folder / "models" / "bad.urdf").write_text("no robot")
    (folder / "link.urdf").symlink_to(folder / "models" / "arm.urdf")
    with pytest.raises((AssetError, DeploymentError), match=what):
        pin_assets(text_with(*ROBOTS, f"robots.arm.file={file}"), NAME, folder)


@pytest.mark.parametrize(
    ("change", "what"),
    [
        ("robots.arm.file=../arm.urdf", "a path inside the asset folder has no empty component"),
        ("robots.arm.file=models/arm.sdf", "no URDF file, which ends with .urdf, 'models/arm.sdf'"),
        (
            "robots.arm.file=a/b.urdf.xacro",
            r"a file of xacro, which makes a URDF file .*: xacro b\.urdf\.xacro > b\.urdf",
        ),
        ("robots.arm.fixed=", "robots.arm.fixed: "),
    ],
)
def test_bad_settings_are_refused_before_any_file_is_read(change: str, what: str) -> None:
    with pytest.raises(DeploymentError, match=what):
        text_with(*ROBOTS, change)


def test_what_a_component_needs_is_looked_for_in_the_robots_own_state(folder: Path) -> None:
    """An arm on a fixed base has no position; what state it has is known with the file."""
    arm = ROBOTS[0].replace("fixed: true", "fixed: true, sensors: {where: {kind: pose, rate: 10 Hz}}")
    with pytest.raises(DeploymentError) as refused:
        pin_assets(text_with(arm), NAME, folder)
    (problem,) = refused.value.problems
    assert "robots.arm.sensors.where.kind: sensor that an urdf cannot carry, for lack of position, heading" in problem


BALL: Final = b'<collision><geometry><sphere radius="0.1"/></geometry></collision>'
POST: Final = b'<robot name="post"><link name="Post">' + BALL + b"</link></robot>"


@pytest.mark.parametrize(
    ("change", "what"),
    [
        (
            "robots.cart.surface={Hul: default, wheel: default}",
            "robots.cart.surface.Hul: a surface of no link; there are Hull, wheel, 'Hul', nearest is 'Hull'",
        ),
        (
            "robots.post={model: urdf, file: models/post.urdf, fixed: true, actuators: {a: {kind: joint_velocity}}}",
            "robots.post.actuators.a.kind: actuator of joints on a robot without a joint that moves, 'joint_velocity'",
        ),
    ],
)
def test_what_does_not_fit_the_links_of_the_file_is_refused_at_its_place(folder: Path, change: str, what: str) -> None:
    (folder / "models" / "post.urdf").write_bytes(POST)
    with pytest.raises(DeploymentError) as refused:
        pin_assets(text_with(*ROBOTS, change), NAME, folder)
    (problem,) = refused.value.problems
    assert problem.endswith(what)


def test_a_free_robot_needs_a_mass(folder: Path) -> None:
    light = ARM.replace(b'<mass value="4"/>', b'<mass value="0"/>', 1)
    for moment in (b"0.0129", b"0.0162"):
        light = light.replace(b'="' + moment, b'="0')
    (folder / "models" / "arm.urdf").write_bytes(light)
    with pytest.raises(DeploymentError, match=r"robots\.arm\.model: a free robot whose first link base, .*has no mass"):
        pin_assets(text_with(*ROBOTS, "robots.arm.fixed=false"), NAME, folder)
    pin_assets(text_with(*ROBOTS), NAME, folder)


# --- state -----------------------------------------------------------------------------------------------------------


def test_the_state_follows_from_the_file(deployment: Deployment) -> None:
    layout = build_layout(deployment)
    arm, cart = layout["arm"], layout["cart"]
    own = {"quarantined": 1, "down": 1, **CONTACTS, "refused": 1, "clamped": 1}
    assert arm.fields == {**dict.fromkeys(JOINTS, 7), **own} and not arm.is_free
    assert cart.fields == {**BODY, **dict.fromkeys(JOINTS, 1), **own} and cart.is_free
    assert cart in layout.free and arm not in layout.free
    push = [Push(name, (1.0, 0.0, 0.0)) for name in ("arm", "cart")]
    assert list(fitting_edits(layout, initial_numbers(deployment, layout), push)) == push[1:]
    again = build_layout(deployment)
    assert layout.digest == again.digest
    other = deployment.model_copy(update={"robots": {**deployment.robots, "cart": deployment.robots["arm"]}})
    assert build_layout(other).digest != layout.digest


def test_without_the_file_there_is_no_state(deployment: Deployment) -> None:
    lacking = load_deployment(text_with(*ROBOTS), NAME)
    with pytest.raises(Malformed, match=r"urdf: the content of the robot's file is missing, 'models/\w+\.urdf'"):
        build_layout(lacking)
    encoder = CommandEncoder(lacking)
    assert encoder.actuators("arm") == () and encoder.actuators("post"), "clients command robots without files"


def test_robots_start_where_they_are_placed(deployment: Deployment) -> None:
    layout = build_layout(deployment)
    numbers, scene = initial_numbers(deployment, layout), build_scene(deployment, layout)
    poses = forward_kinematics(scene.bodies["arm"], layout["arm"], numbers)
    assert poses[0][1] == (3.0, 0.0, 0.0) and poses[-1][0] == "arm/grip"
    assert poses[-1][1] == pytest.approx((3.0, 0.0, 1.13))
    name, place, turned = forward_kinematics(scene.bodies["cart"], layout["cart"], numbers)[0]
    assert name == "cart/Hull" and place == pytest.approx((-3.0, 0.0, 1.0))
    assert turned == pytest.approx(from_rpy(0.5235987755982988, 0.0, 0.0))
    shown = scene_content(deployment, layout, scene)
    assert {"arm/flange", "cart/Hull"} <= {link for link in str(shown).split("'") if "/" in link}


def test_a_joint_starts_at_its_limit_where_0_is_none(folder: Path) -> None:
    (folder / "models" / "arm.urdf").write_bytes(ARM.replace(b'lower="-2.9"', b'lower="1.5"', 1))
    text, files = pin_assets(text_with(*ROBOTS), NAME, folder)
    deployment = load_deployment(text, NAME).with_assets(files)
    layout = build_layout(deployment)
    start = layout["arm"].offsets["joint_positions"]
    assert initial_numbers(deployment, layout)[start : start + 7] == [1.5, *[0.0] * 6]


# --- what can be -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("robot", "field", "place", "value", "problem"),
    [
        ("arm", "joint_positions", 0, 2.99, ""),
        ("arm", "joint_positions", 0, 3.01, "its joint shoulder_yaw is at 3.01, -3 to 3 is valid"),
        ("arm", "joint_positions", 3, -2.35, ""),
        ("arm", "joint_velocities", 6, -360.5, ""),
        ("cart", "joint_positions", 0, 500.0, ""),
        ("cart", "linear_velocity", 2, 900.0, ""),
        ("cart", "linear_velocity", 2, 1001.0, "a part of it moves at up to 1001 m/s, at most 1000 m/s are computed"),
        ("cart", "angular_velocity", 1, 30.0, ""),
        ("cart", "angular_velocity", 1, 1e5, "a part of it moves at up to "),
        (
            "cart",
            "position",
            0,
            101_000.0,
            "it is 1.01e+05 m from the origin along an axis, the world ends at",
        ),
    ],
)
def test_a_state_is_within_limits_and_bounds(
    deployment: Deployment, robot: str, field: str, place: int, value: float, problem: str
) -> None:
    layout = build_layout(deployment)
    entity, numbers = layout[robot], initial_numbers(deployment, layout)
    numbers[entity.offsets[field] + place] = value
    found = BodyLimits(deployment, layout).problem(entity, numbers, numbers)
    assert found.startswith(problem) and bool(found) == bool(problem), found


def test_nothing_gets_farther_in_a_tick_than_its_speed_allows(deployment: Deployment) -> None:
    """The tick is 2 ms: at 20 m/s 4 cm, at twice a present speed of 30 m/s 12 cm."""
    assert deployment.tick_ns == 2_000_000
    layout = build_layout(deployment)
    entity, before = layout["cart"], initial_numbers(deployment, layout)
    for speed, way, what in (
        (0.0, 0.03, ""),
        (0.0, 0.05, "at most 0.04 m"),
        (30.0, 0.11, ""),
        (30.0, 0.13, "at most 0.12 m"),
    ):
        before[entity.offsets["linear_velocity"]] = speed
        numbers = before.copy()
        numbers[entity.offsets["position"]] += way
        found = BodyLimits(deployment, layout).problem(entity, numbers, before)
        assert what in found and bool(found) == bool(what), found


def test_it_is_listed_and_has_its_state_by_its_settings() -> None:
    found = registry.find_model("urdf")
    assert found.declared is None and found.can_be_free and found.is_robot and found.is_solved


def test_inspecting_reads_meshes_from_the_asset_folder(folder: Path) -> None:
    robot = read_robot(folder / "models" / "cart.urdf", folder)
    assert robot.file == "models/cart.urdf" and robot.moving == ("axle",)
    assert read_robot(folder / "models" / "cart.urdf", None) == robot, "the nearest folder that has all meshes"
    with pytest.raises(AssetError, match="not in the asset folder"):
        read_robot(folder / "models" / "cart.urdf", folder / "meshes")
    (folder / "meshes" / "shard.obj").unlink()
    with pytest.raises(
        AssetError, match=r"^models/cart\.urdf:3: a mesh that cannot be read: meshes/shard\.obj: No such"
    ):
        read_robot(folder / "models" / "cart.urdf", folder)
