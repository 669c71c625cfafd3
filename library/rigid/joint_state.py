"""Positions, velocities and efforts of a robot's joints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, ClassVar, Final

from msgspec import Meta, Struct
from pydantic import Field

from foosim.common.spec_base import Name
from foosim.world.component_types.descriptions import JOINTS
from foosim.world.component_types.registry import sensor
from foosim.world.component_types.settings import SensorSettings
from foosim.world.components.base import Sensor
from foosim.world.components.mounted import joint_indices
from foosim.world.components.view import Mounting, SlotReadings, View

JOINTS_MAX: Final = 256
Several = Annotated[tuple[float, ...], Meta(min_length=1, max_length=JOINTS_MAX)]


class JointStateSettings(SensorSettings):
    """Positions, velocities and efforts of `joints`, by the names of the links that hang on them, in this order.

    Where none is named they are those of all joints that move, in the order of their links.
    """

    joints: list[Name] = Field(default=[], max_length=JOINTS_MAX)


class JointState(Struct, frozen=True):
    """The state of joints, a number for each: `positions` (m or rad), `velocities` (m/s or rad/s), and the `efforts`
    that their motors applied in the last substep (N or N m)."""

    positions: Several
    velocities: Several
    efforts: Several

    groups: ClassVar = {"motion": ("positions", "velocities")}


def joints_of(settings: JointStateSettings, counts: Mapping[str, int]) -> int:
    """Return the count of measured joints; `counts` are the sizes of the robot's fields."""
    return len(settings.joints) or counts["joint_positions"]


@sensor("joint_state", JointStateSettings, JointState, needs=JOINTS, array_length=joints_of)
class JointStates(Sensor):
    """Positions, velocities and efforts of joints."""

    def __init__(self, settings: JointStateSettings, at: Mounting) -> None:
        slots = [at.slot(field) for field in JOINTS]
        chosen = joint_indices(at, settings.joints) if settings.joints else range(slots[0].size)
        self.places = [slot.at + joint for slot in slots for joint in chosen]

    @staticmethod
    def check(settings: JointStateSettings, at: Mounting) -> None:
        """Raise IncompatibleComponent for a joint that the robot does not have, or that is named twice."""
        if settings.joints:
            joint_indices(at, settings.joints)

    def sample(self, view: View) -> JointState:
        numbers = [view.numbers[place] for place in self.places]
        count = len(numbers) // 3
        return JointState(tuple(numbers[:count]), tuple(numbers[count : 2 * count]), tuple(numbers[2 * count :]))

    @staticmethod
    def together(sensors: Sequence[JointStates]) -> SlotReadings:
        """Return these as one; all have as many joints."""
        return SlotReadings([one.places for one in sensors])
