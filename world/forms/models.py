"""Models of entities: the slots of each, whether it has a body and an owner, and its usual actuators."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

_BODY: Final = {"position": 3, "orientation": 4, "linear_velocity": 3, "angular_velocity": 3}


@dataclass(frozen=True, slots=True)
class Model:
    """What there is to know of all entities of a model.

    `slots` are what the solver writes, by field, with the count of their numbers. `actuators` are those of a robot that
    says nothing of its actuators, as in a deployment.
    """

    slots: Mapping[str, int]
    has_body: bool = False
    is_robot: bool = False
    is_addable: bool = False
    """Whether a running world can have more of them."""
    actuators: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)


MODELS: Final[Mapping[str, Model]] = {
    "ball": Model(
        {**_BODY, "quarantined": 1, "contacts": 3, "still_ticks": 1, "out_ticks": 1, "wait_ticks": 1},
        has_body=True,
        is_addable=True,
    ),
    "rod": Model(
        {"joint_positions": 2, "joint_velocities": 2, "quarantined": 1, "down": 1, "contacts": 3, "refused": 1},
        has_body=True,
        is_robot=True,
        actuators={"position": {"kind": "joint_position"}},
    ),
    "camera": Model({"down": 1, "refused": 1}, is_robot=True),
    "world": Model({"score": 2, "kickoffs": 1}),
    "rover": Model(
        {
            "position": 3,
            "orientation": 4,
            "heading": 1,
            "wheel_speeds": 2,
            "wheel_travel": 2,
            "blocked": 1,
            "quarantined": 1,
            "down": 1,
            "charge": 1,
            "refused": 1,
        },
        has_body=True,
        is_robot=True,
        actuators={"drive": {"kind": "wheel_speeds"}},
    ),
    "station": Model({"down": 1, "refused": 1}, is_robot=True),
}
"""`contacts` is (count, impulse in N s, last substep or -1) of the tick; `refused` counts packets that the robot
refused; `still_ticks`, `out_ticks` and `wait_ticks` are the memory of the rules about dead balls, balls off the table
and kick-off. `wheel_speeds` are rim speeds (m/s), `wheel_travel` how far the wheels have turned (m), `blocked` whether
an obstacle stopped it in the tick, `charge` its energy in J. Orientations are quaternions x, y, z, w; positions and
velocities are in the world frame, SI units."""
