"""Commands of joints for Bullet at each substep: forces of motors that fall with the speed, and hard stops.

Without contacts a motor of Bullet with a gain has the force of such a motor (`drives.share_of`), without a call a
substep. In a contact and at a stop it has another one: the solver applies the force that restores the lost speed, up to
the greatest, while the force of a real motor follows the actual speed.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from typing import Final

from foosim.node.physics.bullet_client import p
from foosim.world.components.drives import Motor, share_of
from foosim.world.scene import MOVING, Body

ADDED_SPEED: Final = 2.0
"""More (m/s, rad/s) than a motor with 100 m/s2 adds to a joint in a tick of 10 ms, or 21 g at 40 m/s do to 1 kg."""


class MotorForces:
    """Motors of a body whose forces are set at each substep: slope x (speed - actual speed), as the mean over it, at
    most the greatest force.

    `efforts` are the forces (N) or torques (N m) of the last substep, in the order of `numbers`, which are those of the
    joints among all of the body.
    """

    __slots__ = ("_body", "_client", "_joints", "_motors", "efforts", "numbers")

    def __init__(
        self,
        client: int,
        body: int,
        joints: Sequence[int],
        motors: Sequence[Motor],
        loads: Sequence[float],
        ends: Sequence[tuple[float, float]],
        substep_s: float,
    ) -> None:
        """`joints` are their indices in Bullet, `loads` those of the motors (`scene.load_of`), `ends` the limits of
        the joints."""
        self._client, self._body = client, body
        self.numbers = [number for number, motor in enumerate(motors) if motor.slope != inf]
        self._joints = [joints[number] for number in self.numbers]
        self._motors = [
            (
                motors[number],
                share_of(motors[number].slope, loads[number], substep_s) * loads[number] / substep_s,
                *ends[number],
            )
            for number in self.numbers
        ]
        self.efforts = [0.0] * len(self.numbers)

    def apply(self) -> None:
        """Set the forces of the next substep; Bullet forgets them after it.

        The mean over a substep is that of an unloaded joint. A joint that is pressed against its stop does not move.
        """
        efforts = []
        states = p.getJointStates(self._body, self._joints, self._client)
        for (motor, factor, low, high), state in zip(self._motors, states, strict=True):
            position, missing, most = state[0], motor.speed - state[1], motor.force
            is_pressed = (position >= high and missing > 0.0) or (position <= low and missing < 0.0)
            efforts.append(min(max((motor.slope if is_pressed else factor) * missing, -most), most))
        self.efforts = efforts
        p.setJointMotorControlArray(
            self._body, self._joints, p.TORQUE_CONTROL, forces=efforts, physicsClientId=self._client
        )


def without_sloping(motors: Sequence[Motor]) -> list[float]:
    """Return the greatest forces of Bullet's own motors: 0 where the force is set at each substep."""
    return [motor.force if motor.slope == inf else 0.0 for motor in motors]


class Stops:
    """Hard stops of a body's joints, applied after each substep.

    Bullet's own limit acts on a joint beyond it, by up to the speed times a substep, and throws it
    back.
    """

    __slots__ = ("_body", "_client", "_ends")

    def __init__(self, client: int, body: int, ends: Sequence[tuple[int, float, float]]) -> None:
        """`ends` are joints by their indices in Bullet, with their least and greatest position."""
        self._client, self._body, self._ends = client, body, ends

    def apply(self) -> None:
        """Put joints that are beyond an end back to it, without the speed that leads farther."""
        for joint, low, high in self._ends:
            position, speed, _, _ = p.getJointState(self._body, joint, self._client)
            if position > high:
                p.resetJointState(self._body, joint, high, min(speed, 0.0), self._client)
            elif position < low:
                p.resetJointState(self._body, joint, low, max(speed, 0.0), self._client)


def ends_of(body: Body) -> list[tuple[float, float]]:
    """Return the least and greatest position of each joint of a body that moves; infinite without a limit."""
    return [
        link.limits if link.joint in ("prismatic", "revolute") else (-inf, inf)
        for link in body.links
        if link.joint in MOVING
    ]


def may_stop(ends: tuple[float, float], position: float, speed: float, tick_s: float) -> bool:
    """Whether a joint may reach an end within a tick: with its speed, and the effect of motors and contacts."""
    reach = (abs(speed) + ADDED_SPEED) * tick_s
    return not ends[0] + reach < position < ends[1] - reach
