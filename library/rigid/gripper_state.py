"""What a gripper holds."""

from __future__ import annotations

from msgspec import Struct

from foosim.common.names import nearest_quoted
from foosim.common.spec_base import Name, default
from foosim.world.component_types.quantities import Kilograms, Share
from foosim.world.component_types.registry import sensor
from foosim.world.component_types.settings import SensorSettings
from foosim.world.components.base import Sensor
from foosim.world.components.grasping import portables_of
from foosim.world.components.view import IncompatibleComponent, Mounting, View


class GripperStateSettings(SensorSettings):
    """Whether a gripper holds something: the actuator `gripper` of the robot."""

    gripper: Name = default("gripper")


class GripperState(Struct, frozen=True):
    """Whether the last command to a gripper was to close, whether it holds something (1 or 0), and the held mass."""

    closed: Share
    holding: Share
    mass: Kilograms


@sensor("gripper_state", GripperStateSettings, GripperState)
class GripperSensor(Sensor):
    """Whether the last command to a gripper was to close, whether it holds something, and the held mass."""

    def __init__(self, settings: GripperStateSettings, at: Mounting) -> None:
        offsets, name = at.robot.offsets, settings.gripper
        if f"{name}.held" not in offsets:
            grippers = [slot.removesuffix(".held") for slot in offsets if slot.endswith(".held")]
            what = f"{at.robot.name} has no such gripper; there are {', '.join(grippers) or 'none'}"
            raise IncompatibleComponent(("gripper",), what, name, nearest_quoted(name, grippers))
        self._closed, self._held = (at.of(at.robot, f"{name}.{slot}") for slot in ("closed", "held"))
        self._masses = {one.entity.index: one.mass_kg for one in portables_of(at.spec, at.layout)}

    @staticmethod
    def check(settings: GripperStateSettings, at: Mounting) -> None:
        """Raise IncompatibleComponent for a gripper that the robot does not have."""
        GripperSensor(settings, at)

    def sample(self, view: View) -> GripperState:
        (closed,), (held,) = view.read(self._closed), view.read(self._held)
        return GripperState(closed, float(held >= 0.0), self._masses.get(int(held), 0.0))
