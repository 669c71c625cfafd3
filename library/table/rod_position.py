"""The rod's position actuator: a proportional loop from set-points of position and angle to motor speeds, limited.

Target speed = gain x error, at most the drive's speed; the motor reaches it with at most the drive's force. The loop is
the one of the original table (`docs/reference/table.md`); its gains and limits are in the deployment.
"""

from __future__ import annotations

from typing import ClassVar, Final

from msgspec import Struct

from foosim.library.table.rod_drives import RodLimits
from foosim.library.table.settings import table_of
from foosim.world.component_types.quantities import Metres, Radians
from foosim.world.component_types.registry import actuator
from foosim.world.component_types.settings import ActuatorSettings
from foosim.world.components.base import SetPointActuator, need, slot
from foosim.world.components.view import Mounting, View, WritableView

ANGLE_RAD_MAX: Final = 1000.0
"""The greatest angle of a rod's set-point."""


class RodPositionSettings(ActuatorSettings):
    """Moves a rod to a slide and a spin; gains and limits are the table's."""


class Command(Struct, frozen=True):
    """The set-point of a rod: `slide` along world +y from its middle, `spin` about +y."""

    slide: Metres
    spin: Radians


@actuator("rod_position", RodPositionSettings, Command, kit="table")
class PositionActuator(SetPointActuator):
    """A proportional loop from a rod's set-point to the speeds of its motors."""

    steady: ClassVar = True
    """Its set-points follow from the state of its rod alone."""
    _set_point, _joints = slot(2), need("joint_positions")

    def __init__(self, settings: RodPositionSettings, at: Mounting) -> None:
        drive, limits = table_of(at.spec).drive, RodLimits(at)
        self._slide_m_max = limits.half_stroke
        self._set_point_at, self._joints_at = self._set_point.at, self._joints.at
        force, torque = limits.forces
        self._slide = (drive.slide.gain, drive.slide.speed, force)
        self._spin = (drive.spin.gain, drive.spin.speed, torque)

    def limits(self) -> dict[str, tuple[float, float]]:
        """Return the least and greatest slide (m) and spin (rad)."""
        return {"slide": (-self._slide_m_max, self._slide_m_max), "spin": (-ANGLE_RAD_MAX, ANGLE_RAD_MAX)}

    def hold(self, view: WritableView) -> None:
        """Make the present position the set-point."""
        view.write(self._set_point, *view.read(self._joints))

    def excite(self, view: WritableView) -> None:
        """Turn, for the run that compares engines."""
        view.write(self._set_point, 0.0, 1.0)

    def command(self, view: View) -> tuple[tuple[float, float], ...]:
        """Return (target speed, greatest force) of slide and spin, in SI units."""
        numbers, set_point, joints = view.numbers, self._set_point_at, self._joints_at
        gain, speed, force = self._slide
        slide = gain * (numbers[set_point] - numbers[joints])
        if not -speed <= slide <= speed:
            slide = speed if slide > speed else -speed
        gain, speed, torque = self._spin
        spin = gain * (numbers[set_point + 1] - numbers[joints + 1])
        if not -speed <= spin <= speed:
            spin = speed if spin > speed else -speed
        return (slide, force), (spin, torque)
