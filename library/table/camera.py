"""A standing camera, as that above the football table."""

from __future__ import annotations

from collections.abc import Sequence

from foosim.world.component_types.registry import model
from foosim.world.component_types.settings import RobotSettings
from foosim.world.components.base import Model
from foosim.world.components.view import Mounting, WritableView


class CameraRobot(RobotSettings):
    """A robot without a body: its sensors are at places in the world."""


@model("camera", CameraRobot, slots={"down": 1, "refused": 1}, has_body=False)
class Camera(Model):
    """A camera: sensors without a body."""

    def __init__(self, settings: CameraRobot, at: Mounting) -> None:
        pass

    def body(self) -> None:
        """Nothing that radio waves or viewers would meet."""

    def place(self, view: WritableView) -> None:
        """It has no state of its own."""

    def is_plausible(self, numbers: Sequence[float], before: Sequence[float]) -> bool:
        """Nothing moves it."""
        return True
