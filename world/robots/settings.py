"""What the settings of every robot have, in a deployment."""

from pydantic import Field, SerializeAsAny

from foosim.common.spec_base import Name, SpecBase
from foosim.world.forms.settings import ActuatorSettings, SensorSettings

COMPONENTS_MAX = 16


class RobotSettings(SpecBase):
    """What the settings of every robot have: its model, its sensors and actuators by the names of their channels.

    A robot that says nothing of its actuators has those of its model.
    """

    model: str
    sensors: dict[Name, SerializeAsAny[SensorSettings]] = Field(default={}, max_length=COMPONENTS_MAX)
    actuators: dict[Name, SerializeAsAny[ActuatorSettings]] = Field(default={}, max_length=COMPONENTS_MAX)
