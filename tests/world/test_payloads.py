"""Typed values to and from payloads: exact bytes, exact refusals."""

from __future__ import annotations

from collections.abc import Callable
from decimal import Decimal
from fractions import Fraction
from math import inf, nan
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import structs

from foosim.client.commands import CommandEncoder
from foosim.common.errors import BadValue, Malformed, UnknownName
from foosim.deployment.channel_kinds import channel_codec
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.library.mobile.go_to import Place
from foosim.library.mobile.wheel_speeds import Drive
from foosim.library.rigid.joint_position import JointPositions
from foosim.library.rigid.joint_state import JointState
from foosim.library.rigid.joint_trajectory import Trajectory
from foosim.library.table.ball import BallPosition
from foosim.library.table.encoder import RodPosition
from foosim.library.table.rod_position import Command
from foosim.world.component_types.payloads import PayloadCodec, field_at
from foosim.world.component_types.per_field import codec_of
from foosim.world.component_types.registry import find_component, names
from tests.deployed import DEPLOYMENT, TABLE

ENCODER = CommandEncoder(DEPLOYMENT)
FINITE = st.floats(allow_nan=False, allow_infinity=False)
CODECS = {
    name: codec_of(find_component(type_name, name)) for type_name in ("sensor", "actuator") for name in names(type_name)
}
"""Of each registered kind."""
PLAIN = {"collision", "joint_trajectory", "nearby", "semantic_camera"}
"""Kinds that are MessagePack."""
SIZED = sorted(kind for kind, its in CODECS.items() if all(field.is_number for field in its.fields))


def codec(kind: str) -> PayloadCodec:
    return CODECS[kind]


def test_kinds_are_packed_unless_they_have_tuples_of_tuples() -> None:
    assert {kind for kind, its in CODECS.items() if not its.is_packed} == PLAIN


@pytest.mark.parametrize("kind", sorted({*CODECS} - PLAIN))
def test_a_value_is_the_float64_of_its_fields_in_their_order_and_comes_back(kind: str) -> None:
    """Little-endian; single numbers come before several."""
    its = codec(kind)
    single = sum(field.is_number for field in its.fields)
    assert [field.is_several for field in its.fields] == [place >= single for place in range(len(its.fields))]
    tuples = len(its.fields) - single
    each = 4 if its.size is None or not tuples else (its.size // 8 - single) // tuples
    numbers = [number / 3.0 for number in range(1, single + each * tuples + 1)]
    several = [tuple(numbers[start : start + each]) for start in range(single, len(numbers), each)]
    value = its.kind(*numbers[:single], *several)
    payload = its.encode(value)
    assert np.frombuffer(payload, "<f8").tolist() == numbers == its.numbers(value)
    assert its.decode(payload) == its.from_numbers(numbers) == value and type(its.decode(payload)) is its.kind
    assert [field.name for field in its.fields] == list(structs.asdict(value))


@given(st.sampled_from(SIZED), st.binary(max_size=64))
def test_random_bytes_are_a_value_or_malformed(kind: str, payload: bytes) -> None:
    size = 8 * (len(codec(kind).fields) - codec(kind).has_job)
    plain = codec(kind).has_job and payload[size:] == bytes(8)
    if (
        len(payload) in (size, size + 8 * codec(kind).has_job)
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


@pytest.mark.parametrize(
    ("payload", "text"),
    [
        (b"", "0 bytes, encoder has 16"),
        (bytes(24), "24 bytes, encoder has 16"),
        (np.array([0.0, nan]).tobytes(), "encoder with non-finite numbers"),
        (np.array([inf, -inf]).tobytes(), "encoder with non-finite numbers"),
    ],
)
def test_a_payload_of_another_size_or_kind_is_malformed(payload: bytes, text: str) -> None:
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
def test_an_unknown_channel_is_refused_with_the_channels(robot: str, channel: str, text: str) -> None:
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
def test_wrong_names_and_counts_of_a_command_are_refused_with_its_fields(command: Any, text: str) -> None:
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
    commands: list[Any] = [reach, named, {"positions": reach}, (reach,), JointPositions(reach), np.array(reach)]
    for command in commands:
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
def test_invalid_positions_at_times_are_refused(planned: CommandEncoder, command: Any, text: str) -> None:
    with pytest.raises(BadValue) as error:
        planned.encode("arm", {"go": command})
    assert str(error.value).startswith(f"arm/go takes times (s), positions (m or rad): {text}")


@pytest.mark.parametrize("robot", ["camera", "ball", "red.gaol"])
def test_an_entity_without_the_actuator_takes_no_command(robot: str) -> None:
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
