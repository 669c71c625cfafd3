"""A motorised rod of the football table with its figures, as a deployment declares it."""

from typing import Literal

from foosim.common.names import LineName, Team
from foosim.world.robots.settings import RobotSettings


class RodRobot(RobotSettings):
    """A motorised rod with its figures. Its usual actuator is `position`, of the kind `joint_position`."""

    model: Literal["rod"]
    team: Team
    line: LineName
