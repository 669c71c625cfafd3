"""The currents of a rod's motors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from msgspec import Struct

from foosim.library.table.rod_drives import ForceConstant, RodVoltageSettings, TorqueConstant
from foosim.world.component_types.quantities import Amperes
from foosim.world.component_types.registry import sensor
from foosim.world.component_types.settings import SensorSettings
from foosim.world.components.base import Sensor, need
from foosim.world.components.rows import Rows
from foosim.world.components.view import IncompatibleComponent, Mounting, View

if TYPE_CHECKING:  # only processes that compute ticks need numpy
    import numpy as np
    from numpy.typing import NDArray


class MotorCurrentSettings(SensorSettings):
    """Measures the currents of the motors along and around a rod.

    `slide` and `spin` are the constants of the motors; where they are left out they are those of the rod's actuator,
    which is a `rod_voltage` then.
    """

    slide: ForceConstant | None = None
    spin: TorqueConstant | None = None


class Currents(Struct, frozen=True):
    """The currents of a rod's motors, as means over the last substep; positive ones push along +y, turn about +y."""

    slide: Amperes
    spin: Amperes


@sensor("motor_current", MotorCurrentSettings, Currents, kit="table")
class MotorCurrent(Sensor):
    """The currents of a rod's motors: force and torque in the last substep over the motors' constants."""

    efforts = need("joint_efforts")

    def __init__(self, settings: MotorCurrentSettings, at: Mounting) -> None:
        self.along, self.around = _constants(settings, at)

    @staticmethod
    def check(settings: MotorCurrentSettings, at: Mounting) -> None:
        """Raise IncompatibleComponent where neither the settings nor an actuator say what the constants of the motors
        are."""
        _constants(settings, at)

    def sample(self, view: View) -> Currents:
        force, torque = view.read(self.efforts)
        return Currents(force / self.along, torque / self.around)

    @staticmethod
    def together(sensors: Sequence[MotorCurrent]) -> MotorCurrents:
        """Return these as one."""
        return MotorCurrents(sensors)


class MotorCurrents(Rows):
    """Several of them."""

    def __init__(self, sensors: Sequence[MotorCurrent]) -> None:
        import numpy as np

        self._places = np.array([(one.efforts.at, one.efforts.at + 1) for one in sensors])
        self._constants = np.array([(one.along, one.around) for one in sensors])

    def sample(self, view: View) -> NDArray[np.float64]:
        """Return the currents (A), of shape (sensors, 2)."""
        currents: NDArray[np.float64] = view.values[self._places] / self._constants
        return currents


def _constants(settings: MotorCurrentSettings, at: Mounting) -> tuple[float, float]:
    """Return newtons and newton metres per ampere. Raises IncompatibleComponent."""
    actuators = at.spec.robots[at.robot.name].actuators
    motors = [its.constants for _, its in sorted(actuators.items()) if isinstance(its, RodVoltageSettings)]
    found = []
    for number, (key, own) in enumerate((("slide", settings.slide), ("spin", settings.spin))):
        if own is None and not motors:
            what = f"the force of a current is unknown: set {key}, or give an actuator rod_voltage"
            raise IncompatibleComponent(("kind",), what, settings.kind)
        found.append(motors[0][number] if own is None else own)
    return found[0], found[1]
