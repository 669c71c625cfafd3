"""The camera above the football table, as a deployment declares it."""

from typing import Literal

from foosim.world.robots.settings import RobotSettings


class CameraRobot(RobotSettings):
    """A robot without a body that sees the ball."""

    model: Literal["camera"]
