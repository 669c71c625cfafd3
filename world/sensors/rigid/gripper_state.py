"""What a gripper holds."""

from __future__ import annotations

from msgspec import Struct

from foosim.common.names import nearest_quoted
from foosim.common.spec_base import Name, default
from foosim.world.components.grasping import GraspFailure, portables_of
from foosim.world.components.view import Misfit, Mounting, View
from foosim.world.forms.jobs import CHANGED
from foosim.world.forms.quantities import Count, Kilograms, Share
from foosim.world.forms.registry import sensor
from foosim.world.forms.settings import SensorSettings


class GripperStateSettings(SensorSettings):
    """Whether a gripper holds something: the actuator `gripper` of the robot. It measures besides when a job ends."""

    gripper: Name = default("gripper")


class GripperState(Struct, frozen=True):
    """Whether a gripper was told to close, whether it holds something (1 or 0), and the mass of that (0 of nothing).

    `failure` is why it took nothing when it was last told to close: 0 it did not fail, 1 no object within reach, 2 the
    nearest does not have the tag, 3 is too wide, 4 too heavy, 5 is in quarantine, or the robot is. `why` says it.
    """

    closed: Share
    holding: Share
    mass: Kilograms
    failure: Count

    @property
    def why(self) -> str:
        """Why it took nothing, in a sentence; empty where it did not fail."""
        known = self.failure in frozenset(GraspFailure)
        return GraspFailure(int(self.failure)).text if known else ""


@sensor("gripper_state", GripperStateSettings, GripperState, speaks=lambda settings: f"{settings.gripper}.{CHANGED}")
class GripperSensor:
    """Whether a gripper is told to close, whether it holds something, the mass of that, and why it took nothing."""

    def __init__(self, settings: GripperStateSettings, at: Mounting) -> None:
        offsets, name = at.robot.offsets, settings.gripper
        if f"{name}.held" not in offsets:
            grippers = [slot.removesuffix(".held") for slot in offsets if slot.endswith(".held")]
            what = f"{at.robot.name} has no such gripper; there are {', '.join(grippers) or 'none'}"
            raise Misfit(("gripper",), what, name, nearest_quoted(name, grippers))
        self._wanted, self._held, self._failure = (
            at.of(at.robot, f"{name}.{slot}") for slot in ("wanted", "held", "failure")
        )
        self._masses = {one.entity.index: one.mass_kg for one in portables_of(at.spec, at.layout)}

    @staticmethod
    def check(settings: GripperStateSettings, at: Mounting) -> None:
        """Raise Misfit for a gripper that the robot does not have."""
        GripperSensor(settings, at)

    def sample(self, view: View) -> GripperState:
        (closed,), (held,), (failure,) = map(view.read, (self._wanted, self._held, self._failure))
        return GripperState(closed, float(held >= 0.0), self._masses.get(int(held), 0.0), failure)
