"""What a gripper holds: its weight, its collisions, how it is let go, what is not taken, and what ends a grasp."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product
from math import cos, dist, sin
from typing import Any, Final

import pytest

from foosim.client.jobs import Jobs
from foosim.common.errors import DeploymentError
from foosim.deployment.assets import pin_assets
from foosim.deployment.loader import load_deployment
from foosim.library.rigid.gripper import GraspFailure, Grip
from foosim.library.rigid.gripper_state import GripperState
from foosim.simulation.simulation import Simulation
from foosim.world.assembly.volumes import Volumes
from foosim.world.component_types.jobs import JobState
from foosim.world.components.grasping import grasp_of
from foosim.world.frame import Frame
from foosim.world.kinematics import forward_kinematics
from foosim.world.scene import moved, multiply, rotate
from tests.components.worlds import DEPLOY
from tests.grip_yards import FRONT_M, NAME, SIDE_M, crane, crate, porter, world

GRAVITY: Final = 9.80665
LEFT_M: Final = 1.0 - SIDE_M / 2
"""Where the side of a crate is whose middle is 1 m in front of a crane."""
AT_IT: Final = (0.0, LEFT_M - FRONT_M - 0.01)
"""Joints of a crane whose hand is 1 cm in front of that crate."""
CORNERS: Final = [[x, y, z] for x in ("-10 cm", "10 cm") for y in ("-10 cm", "10 cm") for z in ("-10 cm", "10 cm")]
SLIP_M_MAX: Final = 0.001
SWINGS: Final = ((1.5, 1.3), (0.6, 0.9), (1.0, 1.7), (0.7, 1.1), (1.5, 2.0), (0.8, 1.5), (2.0, 1.6))
"""Amplitude (rad) and angular frequency (rad/s) of each joint of an arm."""


def simulation(robots: Mapping[str, Any], objects: Mapping[str, Any], **more: Any) -> Simulation:
    text, files = pin_assets(world(robots, objects, **more), NAME, DEPLOY)
    return Simulation(load_deployment(text, NAME).with_assets(files))


def at_crate(crates: Mapping[str, Any] | None = None, robots: Mapping[str, Any] | None = None, **gripper: Any) -> Any:
    """A crane in front of a crate, its hand 1 cm from it."""
    made = simulation({"a": crane(0.0, **gripper), **(robots or {})}, crates or {"crate": crate(1.0)})
    made.step({"a": {"joints": AT_IT}}, ticks=150)
    return made


def vector(made: Simulation, name: str, field: str, count: int = 3) -> list[float]:
    return list(made.frame.vector(name, field, count))


def held(made: Simulation, robot: str = "a") -> str:
    """The name of what a robot holds, empty without one."""
    index = int(made.frame.at(robot, "gripper.held"))
    return "" if index < 0 else made.frame.layout.entities[index].name


def slip(made: Simulation, robot: str, name: str, link: str) -> float:
    """How far the farthest corner of a held box is from where it was in the grip (m)."""
    frame, body = made.frame, made.scene.bodies[robot]
    index = [one.name for one in body.links].index(f"{robot}/{link}")
    _, position, orientation = forward_kinematics(body, frame.layout[robot], frame.numbers)[index]
    place, axes = grasp_of(frame.layout[name], frame.numbers, position, orientation)
    x, y, z, a, b, c, d = frame.vector(robot, "gripper.grasp", 7)
    (corners,) = [shape.geometry.half for shape in made.scene.bodies[name].links[0].shapes]  # type: ignore[union-attr]
    ways = []
    for signs in product((-1.0, 1.0), repeat=3):
        u, v, w = (sign * half for sign, half in zip(signs, corners, strict=True))
        now, before = rotate(axes, (u, v, w)), rotate((a, b, c, d), (u, v, w))
        ways.append(dist(moved(place, now, 1.0), moved((x, y, z), before, 1.0)))
    return max(ways)


# --- what is held ----------------------------------------------------------------------------------------------------


def test_it_is_taken_without_a_jump_and_weighs_on_the_crane() -> None:
    with at_crate() as made:
        before, (column, _) = vector(made, "crate", "position"), vector(made, "a", "joint_efforts", 2)
        made.step({"a": {"gripper": (1.0,)}})
        assert held(made) == "crate"
        assert dist(before, vector(made, "crate", "position")) < 1e-4, "the hand still creeps"
        made.step({"a": {"joints": (0.3, AT_IT[1])}}, ticks=200)
        assert vector(made, "crate", "position")[2] == pytest.approx(before[2] + 0.3, abs=1e-3)
        assert vector(made, "a", "joint_efforts", 2)[0] - column == pytest.approx(4.0 * GRAVITY, rel=0.02)
        assert made.readings["a", "grip"].value == GripperState(1.0, 1.0, 4.0)


def arm_with(mass: float, **more: Any) -> Simulation:
    """The arm of the yard with a box above its flange."""
    actuators = {
        "gripper": {"kind": "gripper", "at": {"link": "grip"}, "reach": "10 cm", "mass": f"{mass} kg"},
        "joints": {"kind": "joint_position", "gain": "8 Hz"},
    }
    arm = {"model": "urdf", "file": "arm.urdf", "fixed": True, "actuators": actuators}
    box = {"model": "box", "size": ["12 cm", "10 cm", "16 cm"], "mass": f"{mass} kg", "at": {"z": "1.2 m"}}
    return simulation({"arm": arm}, {"crate": {**box, "speed_limit": "4 m/s"}}, **more)


def test_it_weighs_on_a_shoulder_with_its_lever() -> None:
    efforts = []
    for closed in (0.0, 1.0):
        with arm_with(2.0) as made:
            made.step({"arm": {"gripper": (closed,), "joints": (0.0, 0.9, 0.0, 0.4, 0.0, 0.0, 0.0)}}, ticks=300)
            assert held(made, "arm") == ("crate" if closed else "")
            efforts.append(vector(made, "arm", "joint_efforts", 7)[1])
            lever = vector(made, "crate", "position")[0]
    assert abs(efforts[1] - efforts[0]) == pytest.approx(2.0 * GRAVITY * lever, rel=0.02)


def test_it_slips_by_less_than_a_millimetre_in_half_a_minute_of_motion() -> None:
    """With the greatest mass of the gripper, at the substeps of the yard."""
    with arm_with(5.0, substeps=2) as made:
        made.step({"arm": {"gripper": (1.0,)}})
        worst = fastest = 0.0
        for turn in range(1_500):
            angles = tuple([size * sin(turn * 0.02 * rate) for size, rate in SWINGS])
            made.step({"arm": {"joints": angles}}, ticks=2)
            worst = max(worst, slip(made, "arm", "crate", "grip"))
            fastest = max(fastest, *map(abs, vector(made, "crate", "linear_velocity")))
        print(f"slip {worst * 1e3:.3f} mm at up to {fastest:.2f} m/s")
        assert held(made, "arm") == "crate" and fastest > 1.0
        assert worst < SLIP_M_MAX and not made.quarantined


def test_it_pushes_a_crate_in_its_way() -> None:
    with at_crate({"crate": crate(1.0), "other": crate(1.3, mass=1.0)}) as made:
        made.step({"a": {"gripper": (1.0,)}})
        made.step({"a": {"joints": (0.05, AT_IT[1])}}, ticks=100)
        made.step({"a": {"joints": (0.05, AT_IT[1] + 0.3)}}, ticks=200)
        place, pushed = vector(made, "crate", "position"), vector(made, "other", "position")
        assert place[0] == pytest.approx(1.3, abs=0.01)
        assert pushed[0] >= place[0] + SIDE_M - 0.002


def test_a_load_on_a_held_crate_weighs_too() -> None:
    crates = {"crate": crate(1.0), "on-top": crate(1.0, z=SIDE_M * 1.5, mass=1.0)}
    with at_crate(crates) as made:
        before = vector(made, "a", "joint_efforts", 2)[0]
        made.step({"a": {"gripper": (1.0,)}})
        made.step({"a": {"joints": (0.3, AT_IT[1])}}, ticks=300)
        assert vector(made, "on-top", "position")[2] == pytest.approx(0.3 + SIDE_M * 1.5, abs=0.005)
        assert vector(made, "a", "joint_efforts", 2)[0] - before == pytest.approx(5.0 * GRAVITY, rel=0.02)


# --- letting go ------------------------------------------------------------------------------------------------------


def test_what_is_let_go_falls_from_where_it_is() -> None:
    with at_crate() as made:
        made.step({"a": {"gripper": (1.0,)}})
        made.step({"a": {"joints": (0.8, AT_IT[1])}}, ticks=300)
        x, y, z = vector(made, "crate", "position")
        made.step({"a": {"gripper": (0.0,)}}, ticks=20)
        assert held(made) == ""
        fallen = vector(made, "crate", "position")
        assert fallen[:2] == pytest.approx([x, y], abs=1e-4)
        assert z - fallen[2] == pytest.approx(0.5 * GRAVITY * 0.2**2, rel=0.03)
        made.step({}, ticks=100)
        assert vector(made, "crate", "position")[2] == pytest.approx(SIDE_M / 2, abs=0.002)


def test_what_is_let_go_in_motion_flies_on() -> None:
    with at_crate() as made:
        made.step({"a": {"gripper": (1.0,)}})
        made.step({"a": {"joints": (1.0, 0.0)}}, ticks=300)
        made.step({"a": {"joints": (1.0, 1.2)}}, ticks=60)
        x, _, _ = vector(made, "crate", "position")
        speed, _, _ = vector(made, "crate", "linear_velocity")
        assert speed > 0.9
        made.step({"a": {"gripper": (0.0,)}})
        way = vector(made, "crate", "position")[0] - x
        assert way == pytest.approx(speed * 0.01, rel=0.02), "it goes on where it is"
        made.step({}, ticks=20)
        assert vector(made, "crate", "linear_velocity")[0] == pytest.approx(speed, rel=0.02)


def test_a_crate_that_was_at_rest_in_the_grip_falls() -> None:
    """Its own count of still ticks ends with the grasp."""
    with at_crate() as made:
        made.step({"a": {"gripper": (1.0,)}})
        made.step({"a": {"joints": (0.5, AT_IT[1])}}, ticks=600)
        made.step({"a": {"gripper": (0.0,)}}, ticks=60)
        assert vector(made, "crate", "position")[2] == pytest.approx(SIDE_M / 2, abs=0.002)


def test_two_hold_one_thing_and_either_lets_go() -> None:
    robots = {"b": crane(2.0, yaw_deg=180.0)}
    with at_crate(robots=robots) as made:
        made.step({"b": {"joints": AT_IT}}, ticks=150)
        made.step({"a": {"gripper": (1.0,)}, "b": {"gripper": (1.0,)}})
        assert held(made) == held(made, "b") == "crate"
        made.step({"a": {"joints": (0.4, AT_IT[1])}, "b": {"joints": (0.4, AT_IT[1])}}, ticks=200)
        assert vector(made, "crate", "position")[2] == pytest.approx(0.5, abs=0.005)
        assert slip(made, "a", "crate", "grip") < SLIP_M_MAX and slip(made, "b", "crate", "grip") < SLIP_M_MAX
        made.step({"a": {"gripper": (0.0,)}}, ticks=50)
        made.step({"a": {"joints": (0.4, 0.3)}}, ticks=100)
        assert held(made, "b") == "crate" and vector(made, "crate", "position")[2] == pytest.approx(0.5, abs=0.005)


def test_a_robot_that_is_down_keeps_what_it_holds() -> None:
    with at_crate() as made:
        made.step({"a": {"gripper": (1.0,)}})
        made.step({"a": {"joints": (0.5, AT_IT[1])}}, ticks=200)
        made.set("a", "down", True)
        made.step({"a": {"gripper": (0.0,)}}, ticks=100)
        assert held(made) == "crate" and vector(made, "crate", "position")[2] == pytest.approx(0.6, abs=0.005)


def test_without_power_for_its_drives_a_gripper_does_its_jobs() -> None:
    """What a job is said to have ended as is what the gripper has done."""
    with at_crate(robots={"a": {**crane(0.0), "rules": {"battery": {"kind": "battery", "capacity": "1 J"}}}}) as made:
        made.set("a", "battery.charge", "0 %")
        made.step()
        for job, closed, holding in ((1.0, 1.0, "crate"), (2.0, 0.0, "")):
            made.step({"a": {"gripper": Grip(closed, job)}})
            made.step()
            assert held(made) == holding
            assert made.frame.vector("a", "gripper.jobs_states", 1) == [JobState.DONE]


def test_what_is_put_elsewhere_is_let_go() -> None:
    with at_crate() as made:
        made.step({"a": {"gripper": (1.0,)}})
        made.step({"a": {"joints": (0.5, AT_IT[1])}}, ticks=200)
        made.set("crate", "at", "1,2,0.5")
        made.step()
        assert held(made) == ""
        assert dist(vector(made, "crate", "position"), (1.0, 2.0, 0.5)) < 0.01
        made.step({}, ticks=100)
        assert vector(made, "crate", "position")[2] == pytest.approx(SIDE_M / 2, abs=0.002)


def test_what_leaves_the_world_is_held_no_longer() -> None:
    with at_crate() as made:
        column = vector(made, "a", "joint_efforts", 2)[0]
        made.step({"a": {"gripper": (1.0,)}})
        made.step({"a": {"joints": (0.5, AT_IT[1])}}, ticks=200)
        made.remove("crate")
        made.step({}, ticks=50)
        assert held(made) == "" and made.readings["a", "grip"].value == GripperState(1.0, 0.0, 0.0)
        assert vector(made, "a", "joint_efforts", 2)[0] < column + 1.0


def test_what_a_holder_in_quarantine_held_falls() -> None:
    """It may be in quarantine itself for a second."""
    with at_crate() as made:
        made.step({"a": {"gripper": (1.0,)}})
        made.step({"a": {"joints": (0.5, AT_IT[1])}}, ticks=200)
        frame = made.frame
        numbers = [*frame.numbers]
        numbers[frame.layout["a"].offsets["joint_velocities"]] = 1e5
        made.reset(Frame(frame.tick, frame.layout, None, numbers=numbers))
        made.step({}, ticks=200)
        assert [text for text in made.quarantined if " a is in quarantine" in text]
        assert held(made) == "" and vector(made, "crate", "position")[2] == pytest.approx(SIDE_M / 2, abs=0.002)


# --- what is taken ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("gripper", "why"),
    [
        ({}, ""),
        ({"mass": "3.9 kg"}, "heavier"),
        ({"mass": "4 kg"}, ""),
        ({"opening": "19 cm"}, "wider"),
        ({"opening": "20 cm"}, ""),
        ({"reach": "9 mm"}, "no object within reach"),
        ({"reach": "11 mm"}, ""),
        ({"tag": "cup"}, "the tag"),
        ({"tag": "crate"}, ""),
        ({"at": {"link": "grip", "y": "14 cm"}}, "no object within reach"),
        ({"at": {"link": "grip", "y": "12 cm"}, "reach": "5 cm"}, ""),
    ],
)
def test_an_object_that_fits_is_taken_and_a_failed_job_has_the_reason(gripper: dict[str, Any], why: str) -> None:
    things = {"crate": crate(1.0, tags=["crate"]), "cup": crate(9.0, tags=["cup"])}
    with at_crate(things, **gripper) as made:
        jobs = Jobs(made.declared, "script", "a", "gripper")
        jobs.hear(made.readings)
        job = jobs.call(closed=1.0)
        while not job.state.has_ended:
            jobs.hear(made.step(jobs.commands(made.tick)))
        assert held(made) == ("" if why else "crate") and made.frame.at("a", "gripper.closed") == 1.0
        assert job.state == (JobState.FAILED if why else JobState.DONE)
        assert why in job.why and bool(why) == bool(job.why)


def test_what_fits_is_taken_before_what_is_nearer() -> None:
    with at_crate({"crate": crate(1.005, mass=5.0), "other": crate(1.01, z=0.3)}, reach="11 cm", mass="4 kg") as made:
        made.step({"a": {"gripper": (1.0,)}})
        assert held(made) == "other"


@pytest.mark.parametrize("name", ["a", "crate"])
def test_nothing_is_taken_in_quarantine(name: str) -> None:
    with at_crate() as made:
        frame = made.frame
        numbers = [*frame.numbers]
        numbers[frame.layout[name].offsets["quarantined"]] = 800.0
        made.reset(Frame(frame.tick, frame.layout, None, numbers=numbers))
        made.step({"a": {"gripper": Grip(1.0, 1.0)}}, ticks=2)
        assert held(made) == "" and made.frame.at("a", "gripper.jobs_states") == JobState.FAILED
        assert made.frame.at("a", "gripper.failure") == GraspFailure.QUARANTINED


@pytest.mark.parametrize(
    "shape",
    [
        {"model": "sphere", "radius": "10 cm"},
        {"model": "cylinder", "radius": "10 cm", "length": "20 cm"},
        {"model": "capsule", "radius": "10 cm", "length": "1 mm"},
        {"model": "hull", "corners": CORNERS},
    ],
)
def test_bodies_of_all_shapes_are_taken_by_their_surface(shape: dict[str, Any]) -> None:
    for reach, name in (("9 mm", ""), ("12 mm", "it")):
        thing = {**shape, "mass": "1 kg", "at": {"x": "1 m", "z": "10 cm"}, "speed_limit": "4 m/s"}
        with at_crate({"it": thing}, reach=reach) as made:
            made.step({"a": {"gripper": (1.0,)}})
            assert held(made) == name


def test_the_nearest_is_taken_and_of_equals_the_first_by_name() -> None:
    low = {"size": ["20 cm", "20 cm", "9 cm"]}
    two = {"z": crate(1.0, z=0.046, mass=1.0) | low, "y": crate(1.005, z=0.14, mass=1.0) | low}
    with at_crate(two) as made:
        made.step({"a": {"gripper": (1.0,)}})
        assert held(made) == "z"
    beside = {name: crate(1.0, y=y, mass=1.0) for name, y in (("z", -0.1), ("y", 0.1))}
    with at_crate(beside) as made:
        made.step({"a": {"gripper": (1.0,)}})
        assert held(made) == "y"


@pytest.mark.parametrize(("reach", "is_together"), [("5 cm", False), ("45 cm", True)])
def test_what_is_in_reach_is_in_the_island_of_the_crane_before_it_is_taken(reach: str, is_together: bool) -> None:
    """So one solver writes both in the tick of the grasp: the hand is at its end, and the crate stands beyond."""
    with simulation({"a": crane(0.0, reach=reach)}, {"crate": crate(1.9)}) as made:
        made.step({"a": {"joints": (0.0, 1.2)}}, ticks=300)
        layout = made.frame.layout
        pair = layout["a"].index, layout["crate"].index
        islands = [one.entities for one in Volumes(made.deployment, layout).islands(made.frame.numbers)]
        assert (pair in islands) == is_together
        x, _, _ = vector(made, "crate", "position")
        made.step({"a": {"gripper": (1.0,)}})
        assert (held(made) == "crate") == is_together
        made.step({"a": {"joints": (0.0, 0.9)}}, ticks=200)
        assert vector(made, "crate", "position")[0] == pytest.approx(x - 0.3 * is_together, abs=0.005)


def test_it_takes_nothing_by_itself_and_keeps_what_it_has() -> None:
    """What comes near a closed gripper is not taken; a second command to close changes no grasp."""
    with at_crate({"crate": crate(1.0), "other": crate(1.0, y=1.0)}) as made:
        made.step({"a": {"joints": (0.0, 0.2)}}, ticks=100)
        made.step({"a": {"gripper": (1.0,)}})
        made.step({"a": {"joints": AT_IT}}, ticks=200)
        assert held(made) == ""
        made.step({"a": {"gripper": (1.0,)}})
        assert held(made) == "crate"
        grasp = vector(made, "a", "gripper.grasp", 7)
        made.step({"a": {"joints": (0.3, 0.4)}}, ticks=50)
        made.step({"a": {"gripper": (1.0,)}})
        assert vector(made, "a", "gripper.grasp", 7) == grasp


# --- a free base -----------------------------------------------------------------------------------------------------


def test_a_quadrotor_carries_by_its_only_link() -> None:
    """Its frame is not that of its centre of mass."""
    quad = {
        "model": "quadrotor",
        "at": {"z": "50 cm", "yaw": "30 deg"},
        "actuators": {
            "push": {"kind": "force", "force": "100 N", "torque": "1 N m"},
            "gripper": {"kind": "gripper", "at": {"z": "-5 cm"}, "reach": "10 cm"},
        },
    }
    load = {"model": "box", "size": ["10 cm"] * 3, "mass": "200 g", "at": {"z": "38 cm"}, "speed_limit": "4 m/s"}
    with simulation({"quad": quad}, {"load": load}) as made:
        made.step({"quad": {"gripper": (1.0,)}})
        assert held(made, "quad") == "load"
        grasp = vector(made, "quad", "gripper.grasp", 7)
        made.step({"quad": {"push": (0.0, 0.0, 25.0, 0.01, 0.02, 0.01)}}, ticks=100)
        turned = vector(made, "quad", "orientation", 4)
        body = made.scene.bodies["quad"]
        _, position, orientation = forward_kinematics(body, made.frame.layout["quad"], made.frame.numbers)[0]
        x, y, z, *axes = grasp
        place = moved(position, rotate(orientation, (x, y, z)), 1.0)
        assert dist(place, vector(made, "load", "position")) < SLIP_M_MAX
        a, b, c, d = axes
        held_axes = multiply(orientation, (a, b, c, d))
        assert abs(sum(a * b for a, b in zip(held_axes, vector(made, "load", "orientation", 4), strict=True))) > cos(
            1e-3
        )
        assert abs(turned[3]) < cos(0.3), "it has turned"


def loaded() -> Simulation:
    """A porter that has lifted a crate."""
    made = simulation({"a": porter(0.0, spare=False)}, {"crate": crate(0.43, mass=6.0)})
    made.step({"a": {"gripper": (1.0,)}})
    made.step({"a": {"lift": (0.3,)}}, ticks=200)
    assert vector(made, "crate", "position")[2] == pytest.approx(SIDE_M / 2 + 0.3, abs=0.01)
    return made


def test_a_holder_that_is_put_elsewhere_lets_go() -> None:
    with loaded() as made:
        made.set("a", "at", "3,3")
        made.step({}, ticks=100)
        assert held(made) == ""
        assert vector(made, "crate", "position")[0] == pytest.approx(0.43, abs=0.01)
        assert vector(made, "crate", "position")[2] == pytest.approx(SIDE_M / 2, abs=0.002)


def test_a_holder_that_leaves_the_world_lets_go() -> None:
    with loaded() as made:
        made.remove("a")
        made.step({}, ticks=100)
        assert vector(made, "crate", "position")[2] == pytest.approx(SIDE_M / 2, abs=0.002)
        made.add("a", "-2,0")
        made.step({}, ticks=10)
        assert held(made) == ""


# --- refusals --------------------------------------------------------------------------------------------------------


def problem(robots: Mapping[str, Any], objects: Mapping[str, Any] | None = None, **more: Any) -> str:
    with pytest.raises(DeploymentError) as caught:
        simulation(robots, objects or {}, **more)
    return str(caught.value)


BASE: Final = {"model": "holonomic", "actuators": {"grip": {"kind": "gripper"}}}


@pytest.mark.parametrize(
    ("robots", "more", "expected"),
    [
        (
            {"b": BASE},
            {"engine": "pure"},
            ["robots.b.actuators.grip.kind", "the engine pure has no grasps: valid is mujoco"],
        ),
        (
            {"b": BASE},
            {},
            ["robots.b.actuators.grip.kind", "b is no rigid body", "valid on robots that the engine solves"],
        ),
        ({"a": crane(0.0, at={"link": "gripp"})}, {}, ["robots.a.actuators.gripper.at.link", "no such link", "grip"]),
        (
            {"a": crane(0.0) | {"sensors": {"g": {"kind": "gripper_state", "rate": "1 Hz", "gripper": "griper"}}}},
            {},
            ["robots.a.sensors.g.gripper", "has no such gripper; there are gripper"],
        ),
    ],
)
def test_what_cannot_hold_is_refused(robots: dict[str, Any], more: dict[str, Any], expected: Sequence[str]) -> None:
    found = problem(robots, **more)
    assert all(text in found for text in expected), found
