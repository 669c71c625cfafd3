"""Joints by their names, whatever is in these: in settings, commands, readings, columns and messages."""

from __future__ import annotations

import re
from typing import Any, Final

import msgspec
import numpy as np
import pytest

from foosim.capture.columns import Frames
from foosim.capture.mcap.checks import CaptureError
from foosim.capture.mcap.format import Message
from foosim.capture.rows import PacketRow
from foosim.capture.tables import table_of
from foosim.client.commands import CommandEncoder
from foosim.client.vectors import ReadingVector
from foosim.common.errors import BadValue, DeploymentError
from foosim.common.json_text import encode_json
from foosim.console.shown.scene_json import scene_content
from foosim.deployment.loader import check_complete, load_deployment
from foosim.deployment.schema import Deployment
from foosim.simulation.simulation import Simulation
from foosim.world.assembly.body_limits import BodyLimits
from foosim.world.assembly.joint_selection import selections, with_selections
from foosim.world.assembly.world import build_scene
from foosim.world.component_types.settings import RobotSettings
from foosim.world.components.fitted import actuators_of
from foosim.world.components.joint_names import joint_indices
from foosim.world.components.view import IncompatibleComponent
from foosim.world.scene import ORIGIN, Body, Link, Mimic
from tests.kinematic_yard import yard_text

NAME: Final = "hands.yaml"
PART: Final = (
    '<link name="{link}"><inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01"/></inertial>'
    '<collision><geometry><sphere radius="0.02"/></geometry></collision></link>'
    '<joint name="{joint}" type="revolute"><parent link="foot"/><child link="{link}"/><origin xyz="{x} 0 0.2"/>'
    '<axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="100" velocity="5"/>{more}</joint>'
)
JOINTS: Final = ("left/elbow pitch", "left/wrist", "Größe [1]", "finger a", "finger b")
PARTS: Final = "".join(
    PART.format(
        joint=joint, link=f"side/part {x}", x=x, more='<mimic joint="finger a"/>' if joint == "finger b" else ""
    )
    for x, joint in enumerate(JOINTS)
)
FILES: Final = {"hand.urdf": f'<robot name="hand"><link name="foot"/>{PARTS}</robot>'.encode()}
MOVE: Final = {"kind": "joint_position"}
STATE: Final = {"kind": "joint_state", "rate": "100 Hz"}


def hand_text(actuators: dict[str, Any], sensors: dict[str, Any] | None = None) -> str:
    robot = {"model": "urdf", "file": "hand.urdf", "fixed": True, "actuators": actuators, "sensors": sensors or {}}
    return yard_text({"arm": robot}, engine="mujoco", clients={"ann": {}}, physics={"gravity": "0 m/s2"})


def hand(actuators: dict[str, Any], sensors: dict[str, Any] | None = None) -> Deployment:
    text = hand_text(actuators, sensors)
    found = load_deployment(text, NAME).with_assets(FILES)
    check_complete(text, NAME, found)
    return found


def body(*names: str, follower: int | None = None) -> Body:
    """A body with joints of these names, on links 0, 1, ...; one may follow the first."""
    links = [
        Link(
            f"r/{number}", "revolute", (), 1.0, ORIGIN, joint_name=name, mimic=Mimic(0) if number == follower else None
        )
        for number, name in enumerate(names)
    ]
    return Body("r", "test", ORIGIN, tuple(links))


WHEELS: Final = body("wheel_a", "arm/elbow", "wheel_[ab]", "wheel_b", "a b", follower=3)


@pytest.mark.parametrize(
    ("named", "motors", "all_of_them"),
    [
        (None, (0, 1, 2, 4), (0, 1, 2, 3, 4)),
        (["wheel_b", "a b"], None, (3, 4)),
        (["a b", "arm/elbow", "wheel_a"], (4, 1, 0), (4, 1, 0)),
        (["wheel_*"], (0, 2), (0, 2, 3)),
        (["wheel_[ab]"], (2,), (2,)),
        (["*/*", "*"], (1, 0, 2, 4), (1, 0, 2, 3, 4)),
        (["wheel_?"], (0,), (0, 3)),
    ],
)
def test_names_and_patterns_select_joints(
    named: list[str] | None, motors: tuple[int, ...] | None, all_of_them: tuple[int, ...]
) -> None:
    """A name before its meaning as a pattern; names in their order, what a pattern matches in that of the robot; a
    joint that follows another one has no motor."""
    assert joint_indices(WHEELS, named, has_motors=False) == all_of_them
    if motors is not None:
        assert joint_indices(WHEELS, named, has_motors=True) == motors


@pytest.mark.parametrize(
    ("named", "what"),
    [
        (["wheel_a", "wheel_c"], "(1) r has no such joint; there are wheel_a, .*, 'wheel_c', nearest is 'wheel_a'"),
        (["whel_*"], r"(0) r has no joint that matches; there are wheel_a, .*a b, 'whel_\*', nearest is 'wheel_a'"),
        (["0"], "(0) r has no such joint; there are wheel_a, arm/elbow, .*, '0'"),
        (["wheel_*", "wheel_a"], "(1) named twice, 'wheel_a'"),
        (["wheel_b"], "(0) joint wheel_b of r follows joint wheel_a: it has no motor of its own, 'wheel_b'"),
        (["*_b"], r"(0) joint wheel_b of r follows joint wheel_a: it has no motor of its own, '\*_b'"),
    ],
)
def test_what_selects_no_joint_is_refused(named: list[str], what: str) -> None:
    with pytest.raises(IncompatibleComponent) as error:
        joint_indices(WHEELS, named, has_motors=True)
    place, text = re.fullmatch(r"\((\d)\) (.*)", what).groups()  # type: ignore[union-attr]
    assert error.value.path == ("joints", int(place)) and re.fullmatch(text, str(error.value))


def selected(deployment: Deployment) -> dict[str, list[str]]:
    robot: RobotSettings = deployment.robots["arm"]
    parts = {**robot.actuators, **robot.sensors}
    return {name: getattr(one, "joints", []) for name, one in parts.items()}


@pytest.mark.parametrize(("has_motors", "most"), [(True, 128), (False, 256)])
def test_more_joints_than_a_component_has_numbers_for_are_refused(has_motors: bool, most: int) -> None:
    """Of a robot with more the component names those that it needs."""
    names = [f"j{number}" for number in range(most + 1)]
    assert len(joint_indices(body(*names[:most]), None, has_motors=has_motors)) == most
    with pytest.raises(IncompatibleComponent, match=f"more than {most} joints of r"):
        joint_indices(body(*names), None, has_motors=has_motors)


def test_settings_have_names_once_the_files_are_there() -> None:
    """In one deployment and in the one made of it; others of the robot keep what they have. Clients have no files."""
    pose = {"kind": "pose_3d", "rate": "10 Hz", "at": {"link": "side/part 3"}}
    reach = {"kind": "joint_velocity", "joints": ["left/*"]}
    actuators = {"grip": {**MOVE, "joints": "finger*"}, "reach": reach}
    sensors = {"all": STATE, "one": {**STATE, "joints": "Größe [1]"}, "at": pose}
    found = hand(actuators, sensors)
    names = {"grip": ["finger a"], "reach": [*JOINTS[:2]], "all": [*JOINTS], "one": ["Größe [1]"], "at": []}
    assert selected(found) == names and selected(found.with_joint_names()) == names
    without = load_deployment(hand_text(actuators, sensors), NAME)
    assert selected(without) != names and selected(with_selections(without, selections(found))) == names
    assert selected(hand({"motors": {"kind": "joint_torque"}})) == {"motors": [*JOINTS[:4]]}


@pytest.mark.parametrize(
    ("actuators", "what"),
    [
        ({"a": {**MOVE, "joints": "wrist*"}}, "a.joints.*no joint that matches; .*nearest is 'left/wrist'"),
        ({"a": {**MOVE, "joints": "finger b"}}, "a.joints.*finger b of arm follows joint finger a"),
        ({"a": MOVE, "b": {**MOVE, "joints": "left/*"}}, "b.joints: .* that a commands already, 'left/elbow pitch'"),
        ({"a": {"kind": "gripper", "at": {"link": "side/part 9"}}}, "link: arm has no such link; .* 'side/part 0'"),
    ],
)
def test_a_deployment_says_what_is_wrong_with_its_joints(actuators: dict[str, Any], what: str) -> None:
    with pytest.raises(DeploymentError, match=what):
        hand(actuators)


def test_commands_and_readings_are_by_joint() -> None:
    """Without a setting that names them; a reading's numbers are a command."""
    deployment = hand({"motors": {"kind": "joint_position", "joints": ["finger a", "left/*"]}}, {"state": STATE})
    wanted = {"left/wrist": 0.2, "finger a": -0.1, "left/elbow pitch": 0.3}
    with Simulation(deployment, agents=["ann"]) as its:
        sample = its.step({"arm": wanted}, ticks=200)["arm", "state"]
        there = sample.by_joint("positions")
        assert sample.joints == JOINTS == tuple(there)
        assert {name: there[name] for name in wanted} == pytest.approx(wanted, abs=1e-3)
        assert there["finger b"] == pytest.approx(-0.1, abs=1e-2) and there["Größe [1]"] == pytest.approx(0.0, abs=1e-3)
        with pytest.raises(BadValue, match="arm/state has no number for each joint in its field, 'angles'"):
            sample.by_joint("angles")
        layout, bodies = its.frame.layout, its.scene.bodies
        ticks, values = np.array([its.tick]), np.array([its.frame.numbers])
        frames = Frames("run", layout, bodies, ticks, values, ({},))
        assert frames.column("arm", "joint_positions", joint="left/wrist") == [there["left/wrist"]]
        with pytest.raises(
            CaptureError, match="no joint 'left/wist', nearest is left/wrist; it has left/elbow pitch, "
        ):
            frames.column("arm", "joint_positions", joint="left/wist")
        beyond = [*its.frame.numbers]
        beyond[layout["arm"].offsets["joint_positions"] + 1] = 9.0
        text = BodyLimits(deployment, layout).problem(layout["arm"], beyond, its.frame.numbers)
        assert text == "its joint left/wrist is at 9, -2.1 to 2.1 is valid"
        (motors,) = actuators_of(deployment, layout, layout["arm"])
        _, clamped = motors.examine(CommandEncoder(deployment).encode("arm", {**wanted, "left/wrist": 5.0})[0][1])
        assert [(one.name, one.limit) for one in clamped] == [("left/wrist", 2.0)]
    columns = [column.field for column in ReadingVector(deployment, [("arm", "state")]).columns]
    assert columns[:6] == [*(f"positions.{joint}" for joint in JOINTS), "velocities.left/elbow pitch"]


def test_rows_of_a_trajectory_are_by_joint() -> None:
    encoder = CommandEncoder(hand({"go": {"kind": "joint_trajectory", "joints": ["left/*"]}}))
    rows = ({"left/wrist": 0.2, "left/elbow pitch": 0.1}, {"left/elbow pitch": 0.3, "left/wrist": 0.4})
    named = encoder.encode("arm", {"times": (1.0, 2.0), "positions": rows})
    assert named == encoder.encode("arm", {"times": (1.0, 2.0), "positions": ((0.1, 0.2), (0.3, 0.4))})
    with pytest.raises(
        BadValue, match=r"positions \(m or rad\) of left/elbow pitch, left/wrist: no such name, 'wrist'"
    ):
        encoder.encode("arm", {"times": (1.0,), "positions": ({"wrist": 0.1},)})


def test_tables_and_pages_name_joints() -> None:
    deployment = hand({"motors": {"kind": "joint_position", "joints": "left/*"}}, {"state": {**STATE, "joints": "*b"}})
    table = table_of("commands", deployment)
    [(channel, payload)] = CommandEncoder(deployment).encode("arm", {"left/wrist": 0.2, "left/elbow pitch": 0.1})
    packet = PacketRow("ann", 7, 0, "arm", channel, 0, 0, 0, 0, "delivered", "", "", "", "", 0, payload, 0)
    (row,) = table.rows(
        lambda decoder, told: decoder.decode(told.data), Message("/packets", 0, 0, 0, encode_json(packet))
    )
    cells = dict(zip([column.name for column in table.columns], row, strict=True))
    assert msgspec.json.decode(cells["positions"]) == {"left/elbow pitch": 0.1, "left/wrist": 0.2}

    with Simulation(deployment, agents=["ann"]) as its:
        content = scene_content(deployment, its.frame.layout, build_scene(deployment, its.frame.layout))
        offsets = its.frame.layout["arm"].offsets
    fields = {one["name"]: one["index"] for one in content["fields"] if one["field"] == "joint_velocities"}
    assert fields == {joint: offsets["joint_velocities"] + place for place, joint in enumerate(JOINTS)}
    commands = [(one["number"], one["index"] - offsets["motors.set_point"]) for one in content["commands"]]
    assert commands == [("left/elbow pitch", 0), ("left/wrist", 1)]
    (sensor,) = content["sensors"]
    measured = [f"{field}.finger b" for field in ("positions", "velocities", "efforts")]
    assert [name for name, _ in sensor["numbers"]] == measured
