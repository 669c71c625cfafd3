"""The set-points of a rigid body in a tick: those of its motors, and the wrench on its base."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import inf
from typing import Final, NamedTuple, TypeAlias

from foosim.common.exact_math import exp
from foosim.world.scene import Vector, moved


class Motor(NamedTuple):
    """The set-point of a joint's motor: a speed (m/s or rad/s), the greatest force with which it is reached (N or N m),
    and by how much the force falls with the speed (N s/m or N m s/rad).

    The force is slope x (speed - actual speed), at most `force`: that of an electric motor at a voltage. Without a
    slope it is that of an ideal servo: the force that reaches the speed within a substep.
    """

    speed: float
    force: float
    slope: float = inf


@lru_cache(maxsize=256)
def share_of(slope: float, load: float, substep_s: float) -> float:
    """Return the share of the difference from its speed that a motor without another load takes away in a substep.

    `load` is the accelerated mass or inertia (kg, kg m2). The closed form of m dv/dt = b (v0 - v), 1 - exp(-b h / m),
    follows the exponential exactly for any slope.
    """
    return 1.0 if slope == inf else 1.0 - exp(-slope * substep_s / load)


Wrench: TypeAlias = tuple[Vector, Vector]
"""A force (N) at the centre of mass of a free base, and a torque (N m)."""


@dataclass(frozen=True, slots=True)
class Drives:
    """The set-points of a body: those of its motors, in the order of its joints, and the wrench on its base, in the
    principal axes of the base. The motors of a body without any actuator are free."""

    motors: tuple[Motor, ...] = ()
    wrench: Wrench | None = None

    @property
    def is_moving(self) -> bool:
        """Whether a set-point moves the body; one that holds a joint in place does not."""
        return self.wrench is not None or any(motor.speed != 0.0 and motor.force != 0.0 for motor in self.motors)


FREE: Final = Motor(0.0, 0.0)
"""The set-point of a joint without a drive."""
NO_DRIVES: Final = Drives()


def added(one: Wrench | None, other: Wrench) -> Wrench:
    """Return the sum of two wrenches."""
    if one is None:
        return other
    (force, torque), (more, turning) = one, other
    return moved(force, more, 1.0), moved(torque, turning, 1.0)
