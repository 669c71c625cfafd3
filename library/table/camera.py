"""A standing camera, as that above the football table."""

from __future__ import annotations

from foosim.world.component_types.registry import model
from foosim.world.component_types.settings import RobotSettings
from foosim.world.components.base import Model


class CameraRobot(RobotSettings):
    """A robot without a body: its sensors are at places in the world."""


@model("camera", CameraRobot, slots={"down": 1, "refused": 1}, has_body=False)
class Camera(Model):
    """A camera: sensors without a body, so that radio waves and viewers meet nothing."""
