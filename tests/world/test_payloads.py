"""Typed values to and from payloads: exact bytes, exact refusals."""

from __future__ import annotations

from collections.abc import Callable
from decimal import Decimal
from fractions import Fraction
from math import inf, nan
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import Struct, structs

from foosim.client.commands import CommandEncoder
from foosim.common.errors import BadValue, Malformed, UnknownName
from foosim.deployment.channel_kinds import channel_codec
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.library.generic.gps import GlobalPosition
from foosim.library.generic.imu import Inertial
from foosim.library.generic.laser_scanner import Scan
from foosim.library.generic.pose import Pose
from foosim.library.generic.pose_3d import Pose3d
from foosim.library.generic.proximity import Ranges
from foosim.library.generic.range import Distance
from foosim.library.generic.thermometer import Temperature
from foosim.library.generic.velocity import Velocity
from foosim.library.mobile.battery import Battery
from foosim.library.mobile.go_to import Place
from foosim.library.mobile.odometry import WheelTravel
from foosim.library.mobile.rotor_speeds import RotorSpeeds
from foosim.library.mobile.v_w import Motion
from foosim.library.mobile.waypoint import Waypoint
from foosim.library.mobile.wheel_speeds import Drive
from foosim.library.mobile.x_y_w import Velocity as Base
from foosim.library.rigid.contact import Touches
from foosim.library.rigid.force import Push
from foosim.library.rigid.gripper import Grip
from foosim.library.rigid.gripper_state import GripperState
from foosim.library.rigid.joint_position import JointPositions
from foosim.library.rigid.joint_state import JointState
from foosim.library.rigid.joint_torque import JointEfforts
from foosim.library.rigid.joint_trajectory import Trajectory
from foosim.library.rigid.joint_velocity import JointVelocities
from foosim.library.rigid.look_at import Sight
from foosim.library.rigid.pan_tilt import PanTiltAngles
from foosim.library.table.ball import BallPosition
from foosim.library.table.ball_state import BallState
from foosim.library.table.encoder import RodPosition
from foosim.library.table.figure_contact import FigureTouches
from foosim.library.table.motor_current import Currents
from foosim.library.table.rod_force import RodForce
from foosim.library.table.rod_position import Command
from foosim.library.table.rod_velocity import RodVelocity
from foosim.library.table.rod_voltage import RodVoltages
from foosim.world.component_types.payloads import PayloadCodec, field_at
from foosim.world.component_types.per_field import codec_of
from foosim.world.component_types.registry import find_component, names
from foosim.world.components.job_reading import Jobs

TABLE = Path(__file__).parents[2] / "deploy" / "table.yaml"
DEPLOYMENT = load_deployment(TABLE.read_text(), TABLE.name)
ENCODER = CommandEncoder(DEPLOYMENT)
FINITE = st.floats(allow_nan=False, allow_infinity=False)
VALUES: dict[str, tuple[Struct, list[float], list[str]]] = {
    "encoder": (RodPosition(0.1, -2.5), [0.1, -2.5], ["m", "rad"]),
    "ball": (BallPosition(1 / 3, -0.0, 1e-300), [1 / 3, -0.0, 1e-300], ["m", "m", "m"]),
    "rod_position": (Command(-0.12, 1.5), [-0.12, 1.5], ["m", "rad"]),
    "rod_force": (RodForce(-12.0, 1 / 3), [-12.0, 1 / 3], ["N", "N m"]),
    "rod_velocity": (RodVelocity(-1.5, 1 / 3), [-1.5, 1 / 3], ["m/s", "rad/s"]),
    "rod_voltage": (RodVoltages(-48.0, 1 / 3), [-48.0, 1 / 3], ["V", "V"]),
    "ball_state": (
        BallState(*(value / 3 for value in range(9))),
        [value / 3 for value in range(9)],
        [*["m"] * 3, *["m/s"] * 3, *["rad/s"] * 3],
    ),
    "motor_current": (Currents(0.5, -1 / 3), [0.5, -1 / 3], ["A", "A"]),
    "figure_contact": (
        FigureTouches(1.0, (0.0, -1.0), (4.0, -1.0), (3.0, -1.0), (0.25, 0.0)),
        [1.0, 0.0, -1.0, 4.0, -1.0, 3.0, -1.0, 0.25, 0.0],
        ["", "", "", "", "N s"],
    ),
    "pose": (Pose(1 / 3, -7.5, 3.1), [1 / 3, -7.5, 3.1], ["m", "m", "rad"]),
    "odometry": (WheelTravel(12.5, -0.25), [12.5, -0.25], ["m", "m"]),
    "battery": (Battery(0.5, 24.6), [0.5, 24.6], ["", "V"]),
    "laser_scanner": (Scan((0.5, 30.0)), [0.5, 30.0], ["m"]),
    "range": (Distance(1.25), [1.25], ["m"]),
    "proximity": (Ranges((4.0, 0.0, 1 / 3)), [4.0, 0.0, 1 / 3], ["m"]),
    "v_w": (Motion(0.5, -1.2), [0.5, -1.2], ["m/s", "rad/s"]),
    "x_y_w": (Base(0.5, -1.2, 0.1), [0.5, -1.2, 0.1], ["m/s", "m/s", "rad/s"]),
    "waypoint": (Waypoint(0.5, -1.2, 9.0, 1 / 3, 7.0), [0.5, -1.2, 9.0, 1 / 3, 7.0], ["m", "m", "m", "rad", ""]),
    "gripper": (Grip(1.0, 3.0), [1.0, 3.0], ["", ""]),
    "gripper_state": (GripperState(1.0, 1.0, 2.5), [1.0, 1.0, 2.5], ["", "", "kg"]),
    "go_to": (Place(0.5, -1.2, -7.0), [0.5, -1.2, -7.0], ["m", "m", ""]),
    "look_at": (Sight(0.5, -1.2, 1 / 3, -7.0), [0.5, -1.2, 1 / 3, -7.0], ["m", "m", "m", ""]),
    "pan_tilt": (PanTiltAngles(0.5, 1 / 3, 7.0), [0.5, 1 / 3, 7.0], ["rad", "rad", ""]),
    "joint_trajectory": (Trajectory((0.5, 1.0), ((0.1, 1 / 3), (0.0, -1.0)), 7.0), [], ["s", "m or rad", ""]),
    "job": (Jobs(1.0, 4.0, (3.0, 0.0), (2.0, 0.0)), [1.0, 4.0, 3.0, 0.0, 2.0, 0.0], [""] * 4),
    "velocity": (
        Velocity(0.5, -1.2, 9.0, 1 / 3, 0.0, -1.0),
        [0.5, -1.2, 9.0, 1 / 3, 0.0, -1.0],
        ["m/s", "m/s", "m/s", "rad/s", "rad/s", "rad/s"],
    ),
    "wheel_speeds": (Drive(-0.5, 1.2), [-0.5, 1.2], ["m/s", "m/s"]),
    "contact": (Touches(2.0, 0.125, -1.0), [2.0, 0.125, -1.0], ["", "N s", ""]),
    "thermometer": (Temperature(26.5), [26.5], ["degC"]),
    "gps": (GlobalPosition(52.5, -13.25, 1 / 3), [52.5, -13.25, 1 / 3], ["deg", "deg", "m"]),
    "imu": (Inertial(0.1, -0.2, 9.81, 1.0, 2.0, 1 / 3), [0.1, -0.2, 9.81, 1.0, 2.0, 1 / 3],
            ["m/s2"] * 3 + ["rad/s"] * 3),
    "joint_state": (JointState((0.1, 1.5), (-0.5, 2.0), (40.0, 1 / 3)), [0.1, 1.5, -0.5, 2.0, 40.0, 1 / 3], [""] * 3),
    "pose_3d": (Pose3d(1.0, -2.0, 0.5, 0.0, 0.6, 0.0, 0.8), [1.0, -2.0, 0.5, 0.0, 0.6, 0.0, 0.8],
                ["m"] * 3 + [""] * 4),
    "force": (Push(1.0, 2.0, 3.0, 0.1, 0.2, 1 / 3), [1.0, 2.0, 3.0, 0.1, 0.2, 1 / 3], ["N"] * 3 + ["N m"] * 3),
    "joint_position": (JointPositions((0.1, 1 / 3)), [0.1, 1 / 3], ["m or rad"]),
    "joint_torque": (JointEfforts((0.1, 1 / 3)), [0.1, 1 / 3], ["N or N m"]),
    "joint_velocity": (JointVelocities((0.1, 1 / 3)), [0.1, 1 / 3], ["m/s or rad/s"]),
    "rotor_speeds": (RotorSpeeds((1.0, 2.0, 3.0, 1 / 3)), [1.0, 2.0, 3.0, 1 / 3], ["rad/s"]),
}  # fmt: skip
"""A value of each kind, its numbers, and the units of its fields."""
SIZES = {"encoder": 16, "ball": 24, "rod_position": 16, "pose": 24, "odometry": 16, "battery": 16, "wheel_speeds": 16}
SIZES |= {"rod_force": 16, "rod_velocity": 16, "rod_voltage": 16, "ball_state": 72, "motor_current": 16}
SIZES |= {"contact": 24, "gps": 24, "imu": 48, "pose_3d": 56, "range": 8, "thermometer": 8}
SIZES |= {
    "gripper": 8,
    "gripper_state": 24,
    "force": 48,
    "v_w": 16,
    "x_y_w": 24,
    "waypoint": 32,
    "go_to": 16,
    "look_at": 24,
    "pan_tilt": 16,
    "velocity": 48,
}
"""In bytes, of the kinds that have as many numbers always."""
SEVERAL = {
    "figure_contact",
    "job",
    "joint_position",
    "joint_state",
    "joint_torque",
    "joint_velocity",
    "laser_scanner",
    "proximity",
    "rotor_speeds",
}
PLAIN = {"joint_trajectory"}
"""Kinds that are MessagePack."""
SINGLE = {"figure_contact": 1, "job": 2}
"""Fields of one number before those of several."""


def codec(kind: str) -> PayloadCodec:
    return codec_of(find_component("sensor" if kind in names("sensor") else "actuator", kind))


def test_every_kind_is_tested() -> None:
    assert sorted(VALUES) == sorted([*names("sensor"), *names("actuator")])
    assert {*SIZES, *SEVERAL, *PLAIN} == {*VALUES}


@pytest.mark.parametrize("kind", VALUES)
def test_a_value_comes_back_as_it_was(kind: str) -> None:
    value, _, _ = VALUES[kind]
    again = codec(kind).decode(codec(kind).encode(value))
    assert (again, type(again)) == (value, type(value))


@pytest.mark.parametrize("kind", sorted({*VALUES} - PLAIN))
def test_numbers_are_little_endian_float64_in_order(kind: str) -> None:
    value, numbers, _ = VALUES[kind]
    assert np.frombuffer(codec(kind).encode(value), "<f8").tolist() == numbers == codec(kind).numbers(value)


@pytest.mark.parametrize("kind", VALUES)
def test_each_field_has_its_name_and_its_unit(kind: str) -> None:
    value, _, units = VALUES[kind]
    fields = codec(kind).fields
    assert [field.name for field in fields] == list(structs.asdict(value))
    assert [field.unit for field in fields] == units
    single = SINGLE.get(kind, 0 if kind in SEVERAL else len(fields))
    if kind not in PLAIN:
        assert [field.is_number for field in fields] == [place < single for place in range(len(fields))]
        assert [field.is_several for field in fields] == [place >= single for place in range(len(fields))]


@given(st.sampled_from(sorted(SIZES)), st.binary(max_size=64))
def test_random_bytes_are_a_value_or_malformed(kind: str, payload: bytes) -> None:
    plain = codec(kind).has_job and payload[SIZES[kind] :] == bytes(8)
    if (
        len(payload) in (SIZES[kind], SIZES[kind] + 8 * codec(kind).has_job)
        and not plain
        and np.isfinite(np.frombuffer(payload, "<f8")).all()
    ):
        assert codec(kind).encode(codec(kind).decode(payload)) == payload
    else:
        with pytest.raises(Malformed):
            codec(kind).decode(payload)


def test_a_plain_command_has_no_number_of_a_job() -> None:
    """It has the bytes that it had before there were jobs; with the number 0 it is read as well."""
    assert codec("go_to").encode(Place(0.5, -1.2)) == np.array([0.5, -1.2]).tobytes()
    assert codec("go_to").decode(np.array([0.5, -1.2]).tobytes()) == Place(0.5, -1.2)
    assert codec("go_to").decode(np.array([0.5, -1.2, 0.0]).tobytes()) == Place(0.5, -1.2)


@pytest.mark.parametrize("payload", [b"", bytes(12), bytes(8 * 129), np.array([1.0, nan]).tobytes()])
def test_rays_are_one_to_128_finite_numbers(payload: bytes) -> None:
    with pytest.raises(Malformed, match="proximity"):
        codec("proximity").decode(payload)


@pytest.mark.parametrize("payload", [b"", bytes(8), bytes(16), bytes(32), bytes(8 * 3 * 257), bytes(25)])
def test_joints_have_a_position_a_velocity_and_an_effort_each(payload: bytes) -> None:
    with pytest.raises(Malformed, match="joint_state has 0 and 24 for each of 1 to 256 numbers"):
        codec("joint_state").decode(payload)


@given(st.integers(1, 256))
def test_several_numbers_of_several_fields_come_back(count: int) -> None:
    numbers = tuple(float(place) for place in range(3 * count))
    value = JointState(numbers[:count], numbers[count : 2 * count], numbers[2 * count :])
    assert codec("joint_state").decode(codec("joint_state").encode(value)) == value
    assert codec("joint_state").from_numbers(numbers) == value
    names = [field_at(codec("joint_state").fields, 3 * count, place).name for place in range(3 * count)]
    assert names == ["positions"] * count + ["velocities"] * count + ["efforts"] * count


def test_fields_of_several_numbers_are_of_one_length() -> None:
    with pytest.raises(BadValue, match=r"joint_state\.efforts is not as many numbers as positions, 2, 1"):
        codec("joint_state").encode(JointState((0.0, 1.0), (0.0, 1.0), (0.0,)))
    with pytest.raises(BadValue, match=r"joint_state\.efforts is not finite"):
        codec("joint_state").encode(JointState((0.0, 1.0), (0.0, 1.0), (0.0, inf)))


def test_one_ray_and_128_are_rays() -> None:
    for count in (1, 128):
        ways = tuple(float(ray) for ray in range(count))
        assert codec("proximity").decode(np.array(ways).tobytes()) == Ranges(ways)


@pytest.mark.parametrize(
    ("payload", "text"),
    [
        (b"", "0 bytes, encoder has 16"),
        (bytes(24), "24 bytes, encoder has 16"),
        (np.array([0.0, nan]).tobytes(), "encoder with non-finite numbers"),
        (np.array([inf, -inf]).tobytes(), "encoder with non-finite numbers"),
    ],
)
def test_what_does_not_fit_says_why(payload: bytes, text: str) -> None:
    with pytest.raises(Malformed) as error:
        codec("encoder").decode(payload)
    assert str(error.value) == text


def test_the_codec_of_each_channel() -> None:
    for robot, channel, kind, value in (
        ("red.goal", "encoder", "encoder", RodPosition),
        ("red.goal", "position", "rod_position", Command),
        ("camera", "ball", "ball", BallPosition),
    ):
        found = channel_codec(DEPLOYMENT, robot, channel)
        assert found is not None and (found.name, found.kind) == (kind, value)
    assert channel_codec(DEPLOYMENT, "camera", "echo") is None
    assert channel_codec(DEPLOYMENT, "player-red", "anything") is None


@pytest.mark.parametrize(
    ("robot", "channel", "text"),
    [
        ("red.goal", "bal", "red.goal has no such channel (there are: echo, encoder, position), 'bal'"),
        ("camera", "position", "camera has no such channel (there are: ball, echo), 'position'"),
        ("camera", "bal", "camera has no such channel (there are: ball, echo), 'bal', nearest is 'ball'"),
    ],
)
def test_an_unknown_channel_names_those_that_exist(robot: str, channel: str, text: str) -> None:
    with pytest.raises(UnknownName) as error:
        channel_codec(DEPLOYMENT, robot, channel)
    assert str(error.value) == text


def test_an_unknown_robot_names_the_nearest() -> None:
    with pytest.raises(UnknownName, match=r"unknown robot .*'red\.gol', nearest is 'red\.goal'"):
        channel_codec(DEPLOYMENT, "red.gol", "encoder")


TAKES = "red.goal/position takes slide (m), spin (rad)"


@pytest.mark.parametrize(
    ("slide", "spin", "text"),
    [
        (nan, 0.0, "slide is not finite, nan"),
        (0.0, -inf, "spin is not finite, -inf"),
        (10**400, 0.0, f"slide is not finite, 1{'0' * 43}...0"),
        ("left", 0.0, "slide is not a number, 'left'"),
        (0.0, None, "spin is not a number, null"),
    ],
)
def test_a_command_that_no_node_could_clamp_is_an_error_of_its_sender(slide: Any, spin: Any, text: str) -> None:
    for command in (Command(slide, spin), {"spin": spin, "slide": slide}, (slide, spin)):
        with pytest.raises(BadValue) as error:
            ENCODER.encode("red.goal", command)
        assert str(error.value) == f"{TAKES}: {text}"


@pytest.mark.parametrize("number", [np.float32(0.5), np.float64(0.5), np.array(0.5), Fraction(1, 2), Decimal("0.5")])
def test_a_number_is_whatever_becomes_a_float(number: Any) -> None:
    assert ENCODER.encode("red.goal", Command(number, 0))[0][1] == np.array([0.5, 0.0]).tobytes()
    assert PayloadCodec(JointPositions, "arm").encode(JointPositions(np.array([0.5, 1.0], dtype=np.float32))) == (  # type: ignore[arg-type]
        np.array([0.5, 1.0]).tobytes()
    )


@given(slide=FINITE, spin=FINITE)
def test_a_command_goes_to_the_node_as_it_is_however_it_is_written(slide: float, spin: float) -> None:
    """Also beyond the limits, which the node applies."""
    numbers: list[Any] = [Command(slide, spin), {"spin": spin, "slide": slide}, (slide, spin), np.array([slide, spin])]
    for command in numbers:
        for written in (command, {"position": command}):
            assert ENCODER.encode("red.goal", written) == [("position", np.array([slide, spin]).tobytes())]


@pytest.mark.parametrize(
    ("command", "text"),
    [
        ({}, "slide, spin are missing"),
        ([], "0 numbers given"),
        ((0.1,), "1 number given"),
        ((0.1, 0.2, 0.3), "3 numbers given"),
        ({"slide": 0.1}, "spin is missing"),
        ({"slide": 0.1, "spni": 0.2}, "no such name, 'spni', nearest is 'spin'"),
        ({"slide": 0.1, "spin": 0.2, "turn": 0.3}, "no such name, 'turn'"),
        ({"positon": {"slide": 0.1, "spin": 0.2}}, "no such name, 'positon'"),
        ({"position": Drive(0.0, 0.0)}, "a Drive is not one of these"),
        ("up", "not numbers by name or in their order, 'up'"),
        (0.1, "not numbers by name or in their order, 0.1"),
        (None, "not numbers by name or in their order, null"),
    ],
)
def test_names_and_numbers_that_are_none_of_a_command_name_its_fields(command: Any, text: str) -> None:
    with pytest.raises(BadValue) as error:
        ENCODER.encode("red.goal", command)
    assert str(error.value) == f"{TAKES}: {text}"


REACH = "arm/reach takes positions (m or rad) of shoulder, elbow"
TURN = "arm/turn takes velocities (m/s or rad/s) of wrist"


def yard(*sets: str) -> CommandEncoder:
    """Commands of robots that move by kinematics, and of an arm with joints."""
    path = TABLE.with_name("yard.yaml")
    return CommandEncoder(load_deployment(apply_sets(path.read_text(), path.name, sets), path.name))


@pytest.fixture(scope="module")
def arm() -> CommandEncoder:
    """An arm with two actuators, whose joints the deployment names."""
    reach = "{kind: joint_position, gain: 8 Hz, joints: [shoulder, elbow]}"
    return yard(f"robots.arm.actuators={{reach: {reach}, turn: {{kind: joint_velocity, joints: [wrist]}}}}")


@given(reach=st.tuples(FINITE, FINITE), turn=FINITE)
def test_joints_are_commanded_by_name_or_in_their_order(
    arm: CommandEncoder, reach: tuple[float, float], turn: float
) -> None:
    named = dict(zip(("shoulder", "elbow"), reach, strict=True))
    sent = [("reach", np.array(reach).tobytes()), ("turn", np.array([turn]).tobytes())]
    forms: list[Any] = [reach, named, {"positions": reach}, (reach,), JointPositions(reach), np.array(reach)]
    for command in forms:
        assert arm.encode("arm", {"turn": {"wrist": turn}, "reach": command}) == sent
        assert arm.encode("arm", {"reach": command}) == sent[:1]
    assert arm.encode("arm", {"turn": [turn], "reach": JointPositions(reach)}) == sent
    assert arm.encode("arm", JointPositions(reach)) == sent[:1]


@given(numbers=st.lists(FINITE, min_size=1, max_size=7))
def test_joints_that_the_deployment_does_not_name_are_commanded_in_their_order(numbers: list[float]) -> None:
    for command in (numbers, tuple(numbers), {"positions": numbers}, {"joints": numbers}):
        assert YARD.encode("arm", command) == [("joints", np.array(numbers).tobytes())]


@pytest.mark.parametrize(
    ("command", "text"),
    [
        ((0.1, 0.2), f"{REACH}; {TURN}: a command of arm is commands by actuator, a list of 2"),
        ({"reech": (0.1, 0.2)}, f"{REACH}; {TURN}: arm has no such actuator (there are: reach, turn), 'reech',"
         " nearest is 'reach'"),
        ({"reach": (0.1,)}, f"{REACH}: 1 number given"),
        ({"reach": {"positions": (0.1, 0.2, 0.3)}}, f"{REACH}: 3 numbers given"),
        ({"reach": JointPositions((0.1,))}, f"{REACH}: 1 number given"),
        (JointPositions((0.1,)), f"{REACH}: 1 number given"),
        ({"reach": {"elbow": 0.1}}, f"{REACH}: shoulder is missing"),
        ({"reach": {"shoulder": 0.0, "elbwo": 0.1}}, f"{REACH}: no such name, 'elbwo', nearest is 'elbow'"),
        ({"reach": {"position": (0.1, 0.2)}}, f"{REACH}: no such name, 'position'"),
        ({"reach": (0.1, "far")}, f"{REACH}: positions is not a number, 'far'"),
        ({"turn": ()}, f"{TURN}: 0 numbers given"),
    ],
)  # fmt: skip
def test_a_wrong_command_of_an_arm_names_actuators_and_joints(arm: CommandEncoder, command: Any, text: str) -> None:
    with pytest.raises(BadValue) as error:
        arm.encode("arm", command)
    assert str(error.value) == text


YARD = yard()


@pytest.fixture(scope="module")
def planned() -> CommandEncoder:
    """An arm that takes positions at times."""
    return yard("robots.arm.actuators={go: {kind: joint_trajectory}}")


@given(st.integers(1, 16), st.integers(1, 7), st.integers(-9, 9))
def test_positions_at_times_come_back_however_they_are_written(
    planned: CommandEncoder, points: int, joints: int, job: int
) -> None:
    """Their number of a job, that of a cancellation, and a cancellation by whoever does not know the points, too."""
    times, rows = np.arange(1, points + 1) / 3.0, np.arange(points * joints).reshape(points, joints)
    value = Trajectory(tuple(times.tolist()), tuple(map(tuple, (rows / 1.0).tolist())), float(job))
    its = codec("joint_trajectory")
    for one in (value, Trajectory(times, rows, job)):  # type: ignore[arg-type]
        assert its.decode_finite(its.encode_checked(one)) == value
    assert its.decode_finite(its.encode_checked(its.nothing())) == its.nothing() == Trajectory((), ())
    plain = structs.replace(value, job=0.0)
    written: list[Any] = [{"times": times, "positions": rows}, (times, rows.tolist()), plain]
    for command in written:
        ((channel, payload),) = planned.encode("arm", {"go": command})
        assert (channel, its.decode(payload)) == ("go", plain)


@pytest.mark.parametrize(
    ("command", "text"),
    [
        ({"times": [1.0]}, "positions is missing"),
        ({"times": [1.0], "position": [[0.0]]}, "no such name, 'position', nearest is 'positions'"),
        ({"times": [0.0], "positions": [[0.0]]}, "Expected `float` > 0.0 - at `$.times[0]`"),
        ({"times": [1.0], "positions": [0.0]}, "Expected `array`, got `float` - at `$.positions[0]`"),
        ({"times": [1.0], "positions": [[]]}, "Expected `array` of length >= 1 - at `$.positions[0]`"),
        ({"times": [1.0], "positions": [["up"]]}, "Expected `float`, got `str` - at `$.positions[0][0]`"),
        ({"times": [1.0], "positions": [[nan]]}, "joint_trajectory with non-finite numbers"),
        ({"times": 1.0, "positions": [[0.0]]}, "Expected `array`, got `float` - at `$.times`"),
        (([1.0],), "1 number given"),
    ],
)
def test_what_are_no_positions_at_times_says_why(planned: CommandEncoder, command: Any, text: str) -> None:
    with pytest.raises(BadValue) as error:
        planned.encode("arm", {"go": command})
    assert str(error.value).startswith(f"arm/go takes times (s), positions (m or rad): {text}")


@pytest.mark.parametrize("robot", ["camera", "ball", "red.gaol"])
def test_what_has_no_such_actuator_takes_no_command(robot: str) -> None:
    with pytest.raises(
        UnknownName, match=r"no robot that takes a Command \(there are: blue\.attack, .*red\.midfield\)"
    ):
        ENCODER.encode(robot, Command(0.0, 0.0))


def test_a_rod_takes_no_drive_and_a_rover_no_command(fleet_text: Callable[..., str]) -> None:
    with pytest.raises(UnknownName, match=r"no robot that takes a Drive \(there are: none\), 'red\.goal'"):
        ENCODER.encode("red.goal", Drive(0.0, 0.0))
    hall = CommandEncoder(load_deployment(fleet_text(2), "hall.yaml"))
    with pytest.raises(UnknownName, match=r"no robot that takes a Command \(there are: none\), 'rover01'"):
        hall.encode("rover01", Command(0.0, 0.0))
    with pytest.raises(UnknownName, match=r"no robot that takes a Drive \(there are: rover01, rover02\), 'base'"):
        hall.encode("base", Drive(0.0, 0.0))
    assert hall.encode("rover01", Drive(1.2, -1.2)) == [("drive", np.array([1.2, -1.2]).tobytes())]
