"""Joints that follow others: how well they do, and what the motor of the leader is felt as."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import cos, exp
from typing import Final

import pytest

from foosim.library.rigid.urdf import starts_of
from foosim.world.components.drives import FREE, Drives, Motor
from foosim.world.scene import ORIGIN, Body, Box, Capsule, Link, Mimic
from tests.solids import Solids, box, shape

COUPLING_MAX: Final = 2e-4
"""The greatest error of a coupling (rad, and m)."""
TICK_S: Final = 0.005
HEIGHT_M: Final = 1.0
GRIP_N: Final = 10.0
FINGER: Final = shape(Box((0.03, 0.03, 0.005)))


def gripper(ratio: float) -> Body:
    """Two fingers above one another, 10 cm apart; the axis of the lower one points up or down, by the ratio."""
    upper, lower = (
        Link(
            f"hand/{name}",
            "prismatic",
            (FINGER,),
            0.2,
            (1e-4, 1e-4, 1e-4),
            axis=(0.0, 0.0, axis),
            limits=(-0.05, 0.05),
            position=(0.0, 0.0, HEIGHT_M + z),
            mimic=mimic,
        )
        for name, z, axis, mimic in (("upper", 0.05, 1.0, None), ("lower", -0.05, -ratio, Mimic(0, ratio)))
    )
    return Body("hand", "hand", ORIGIN, (upper, lower))


def finger(*followers: Mimic) -> Body:
    """Knuckles in a row, of which each is lighter than the last one, and all follow the first."""
    links = [
        Link(
            f"hand/{number}",
            "revolute",
            (shape(Capsule(0.02, 0.1), position=(0.08, 0.0, 0.0)),),
            mass := 0.5 * 0.2**number,
            (2e-3 * mass, 2e-3 * mass, 2e-3 * mass),
            centre_of_mass=(0.08, 0.0, 0.0),
            axis=(0.0, 1.0, 0.0),
            limits=(-2.5, 2.5),
            parent=number - 1,
            position=(0.16, 0.0, 0.0) if number else (0.0, 0.0, HEIGHT_M),
            mimic=mimic,
        )
        for number, mimic in enumerate((None, *followers))
    ]
    return Body("hand", "hand", ORIGIN, tuple(links))


def error(body: Body, at: Sequence[float]) -> float:
    """Return the greatest error of a coupling, where all links have a joint."""
    coupled = [(number, link.mimic) for number, link in enumerate(body.links) if link.mimic is not None]
    return max(abs(at[number] - (mimic.ratio * at[mimic.leader] + mimic.offset)) for number, mimic in coupled)


def drive(made: Solids, speed: float, force: float) -> float:
    """Drive the first joint for a tick; return the error of the coupling after it."""
    body = made.bodies[-1]
    made.drives["hand"] = Drives((Motor(speed, force), *[FREE] * (len(body.joints) - 1)))
    made.run(1)
    return error(body, made.get("hand", "joint_positions"))


@pytest.mark.parametrize("substeps", [2, 4])
def test_knuckles_follow_through_swings_and_against_stops(substeps: int) -> None:
    """With and without the motor, whose force a stop exceeds, in gravity."""
    body = finger(Mimic(0, 1.2), Mimic(0, 0.8, 0.2), Mimic(0, 1.0), Mimic(0, -1.0))
    made = Solids([body], substeps=substeps, tick_s=TICK_S)
    made.set("hand", "joint_positions", *starts_of(body))
    worst, places = 0.0, []
    stop = 2.5 / 1.2  # of the first follower
    for tick in range(1200):
        speed, force = (4.0 * cos(0.045 * tick), 50.0) if tick < 800 else (3.0, 50.0) if tick < 1000 else (0.0, 0.0)
        worst = max(worst, drive(made, speed, force))
        places.append(made.get("hand", "joint_positions")[0])
    print(f"coupling {worst:.1e} rad over {min(places):.2f} to {max(places):.2f} rad")
    assert max(places) == pytest.approx(stop, abs=0.03), "stops give way a little"
    assert worst < COUPLING_MAX


@pytest.mark.parametrize("ratio", [1.0, -1.0])
@pytest.mark.parametrize("substeps", [2, 4])
def test_fingers_hold_a_box_with_the_force_of_one_motor(substeps: int, ratio: float) -> None:
    """Each with half of it: the leader's motor moves both. In the air they stay where they are put."""
    made = Solids([gripper(ratio), box("crate", (0.02, 0.02, 0.03), 0.1)], substeps=substeps, tick_s=TICK_S)
    made.put("crate", (1.0, 0.0, 0.03))
    worst = max(drive(made, 0.05 if tick < 100 else 0.0, GRIP_N) for tick in range(200))
    assert made.get("hand", "joint_positions")[0] == pytest.approx(0.025, abs=1e-4)
    made.put("crate", (0.0, 0.0, HEIGHT_M))
    worst = max(worst, *[drive(made, -0.05, GRIP_N) for _ in range(300)])
    impulse = made.get("crate", "contacts")[1]
    print(f"coupling {worst:.1e} m, force {impulse / TICK_S:.3f} N")
    assert impulse / TICK_S == pytest.approx(GRIP_N, rel=0.01)
    assert made.get("crate", "position")[2] == pytest.approx(HEIGHT_M, abs=1e-3)
    assert worst < COUPLING_MAX


def test_a_motor_whose_force_falls_with_the_speed_moves_followers_too() -> None:
    """m dv/dt = b (v0 - v), m being the mass of both fingers; their weights cancel."""
    body, slope, wanted, ticks = gripper(1.0), 4.0, 0.3, 20
    made = Solids([body], tick_s=TICK_S)
    made.drives["hand"] = Drives((Motor(wanted, 100.0, slope), FREE))
    made.run(ticks)
    speed = wanted * (1.0 - exp(-slope * ticks * TICK_S / 0.4))
    assert made.get("hand", "joint_velocities") == pytest.approx([speed, speed], rel=1e-4)


def test_joints_start_where_followers_are_within_their_limits() -> None:
    """And as near to 0 as that allows; without such a place the leader's own limits hold."""
    ends = [(-1.0, 1.0), (0.4, 1.0), (-1.0, 1.0)]
    links = finger(Mimic(0, 2.0), Mimic(0, -1.0, 0.1)).links
    body = Body("hand", "hand", ORIGIN, tuple(map(with_limits, links, ends)))
    assert starts_of(body) == [0.2, 0.4, -0.1]
    body = Body("hand", "hand", ORIGIN, tuple(map(with_limits, links, [(-1.0, 0.1), *ends[1:]])))
    assert starts_of(body) == [0.1, 0.2, 0.0]


def with_limits(link: Link, ends: tuple[float, float]) -> Link:
    return replace(link, limits=ends)
