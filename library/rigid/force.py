"""A force and a torque on the base of a free robot, in the frame of its first link or of the world."""

from __future__ import annotations

from typing import Annotated, Literal, TypeAlias

from msgspec import Meta, Struct

from foosim.common import units
from foosim.common.units import Quantity
from foosim.world.component_types.registry import actuator
from foosim.world.component_types.settings import ActuatorSettings
from foosim.world.components.base import Actuator, need, slot
from foosim.world.components.drives import Motor, Wrench
from foosim.world.components.mounted import body_at
from foosim.world.components.view import Mounting, View, WritableView
from foosim.world.scene import conjugate, rotate

Newtons: TypeAlias = Annotated[float, Meta(extra={"unit": "N"})]
NewtonMetres: TypeAlias = Annotated[float, Meta(extra={"unit": "N m"})]
ForceMost = Annotated[float, Quantity(units.FORCE, "0 N", "10000 kN")]
TorqueMost = Annotated[float, Quantity(units.TORQUE, "0 N m", "10000000 N m")]


class ForceSettings(ActuatorSettings):
    """Pushes a free robot: along each axis with at most `force`, about each axis with at most `torque`.

    The axes are those of its first link, or, with `frame: world`, of the world.
    """

    force: ForceMost
    torque: TorqueMost
    frame: Literal["own", "world"] = "own"


class Push(Struct, frozen=True):
    """A force at the centre of mass and a torque, in the frame of the robot's first link, or of the world."""

    force_x: Newtons
    force_y: Newtons
    force_z: Newtons
    torque_x: NewtonMetres
    torque_y: NewtonMetres
    torque_z: NewtonMetres


@actuator("force", ForceSettings, Push, moves=False, needs=("angular_velocity",))
class ForceActuator(Actuator):
    """Applies the force and torque of the last command throughout each tick."""

    _set_point, orientation = slot(6), need()

    def __init__(self, settings: ForceSettings, at: Mounting) -> None:
        self._force, self._torque = settings.force, settings.torque
        self._back = conjugate(body_at(at).links[0].principal)
        self._is_own = settings.frame == "own"

    def limits(self) -> dict[str, tuple[float, float]]:
        """Return the least and the greatest of each number."""
        forces = {f"force_{axis}": (-self._force, self._force) for axis in "xyz"}
        return forces | {f"torque_{axis}": (-self._torque, self._torque) for axis in "xyz"}

    def accept(self, command: Push, view: WritableView) -> bool:
        """Take a force and a torque."""
        force = command.force_x, command.force_y, command.force_z
        view.write(self._set_point, *force, command.torque_x, command.torque_y, command.torque_z)
        return True

    def hold(self, view: WritableView) -> None:
        """Push no more."""
        view.write(self._set_point, *[0.0] * 6)

    def excite(self, view: WritableView) -> None:
        """Push a little, for the run that compares engines."""
        view.write(self._set_point, *[0.1 * self._force] * 3, *[0.1 * self._torque] * 3)

    def command(self, view: View) -> tuple[Motor, ...]:
        """Return nothing: it has no joints."""
        return ()

    def wrench(self, view: View) -> Wrench:
        """Return force (N) and torque (N m) in the principal axes of the base."""
        x, y, z, a, b, c = view.read(self._set_point)
        i, j, k, w = view.read(self.orientation)
        back = self._back if self._is_own else (-i, -j, -k, w)
        return rotate(back, (x, y, z)), rotate(back, (a, b, c))
