"""Positions, velocities and efforts of a robot's joints."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, ClassVar

from msgspec import Meta, Struct
from pydantic import Field

from foosim.world.component_types.descriptions import JOINTS, JOINTS_READ_MAX
from foosim.world.component_types.registry import sensor
from foosim.world.component_types.settings import SensorSettings
from foosim.world.components.joint_names import JointNames, joint_indices
from foosim.world.components.mounted import body_at
from foosim.world.components.rows import SlotSensor
from foosim.world.components.view import Mounting

Several = Annotated[tuple[float, ...], Meta(min_length=1, max_length=JOINTS_READ_MAX)]


class JointStateSettings(SensorSettings):
    """Positions, velocities and efforts of joints.

    `joints` selects them by names or by patterns of these with `*`, in this order; without it they are all that move.
    """

    joints: Annotated[JointNames, Field(min_length=1, max_length=JOINTS_READ_MAX)] | None = None


class JointState(Struct, frozen=True):
    """The state of joints, a number for each: `positions` (m or rad), `velocities` (m/s or rad/s), and the `efforts`
    that their motors applied in the last substep (N or N m)."""

    positions: Several
    velocities: Several
    efforts: Several

    groups: ClassVar = {"motion": ("positions", "velocities")}


def joints_of(settings: JointStateSettings, counts: Mapping[str, int]) -> int:
    """Return the count of measured joints; `counts` are the sizes of the robot's fields."""
    return len(settings.joints or ()) or counts["joint_positions"]


@sensor("joint_state", JointStateSettings, JointState, needs=JOINTS, array_length=joints_of, joints="joints")
class JointStates(SlotSensor):
    """Positions, velocities and efforts of joints."""

    @staticmethod
    def reading(*numbers: float) -> JointState:
        count = len(numbers) // 3
        return JointState(numbers[:count], numbers[count : 2 * count], numbers[2 * count :])

    def __init__(self, settings: JointStateSettings, at: Mounting) -> None:
        joints = joint_indices(body_at(at), settings.joints, has_motors=False)
        self.places = [at.slot(field).at + joint for field in JOINTS for joint in joints]
