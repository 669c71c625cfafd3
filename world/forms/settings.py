"""What the settings of all components of robots have, in a deployment."""

from typing import Final

from pydantic import Field, SerializeAsAny

from foosim.common.spec_base import Offset, Rate, SpecBase, default

MODIFIERS_MAX: Final = 8


class ComponentSettings(SpecBase):
    """What the settings of each component have: its kind, a registered name or `module:Class`."""

    kind: str


class ModifierSettings(ComponentSettings):
    """What the settings of each modifier have."""


class SensorSettings(ComponentSettings):
    """What the settings of each sensor have: how often it measures, and what is done to its readings, in order."""

    rate_hz: Rate = Field(alias="rate")
    offset_ns: Offset = default("0 s", "offset")
    modifiers: list[SerializeAsAny[ModifierSettings]] = Field(default=[], max_length=MODIFIERS_MAX)


class ActuatorSettings(ComponentSettings):
    """What the settings of each actuator have: what is done to its commands, in order."""

    modifiers: list[SerializeAsAny[ModifierSettings]] = Field(default=[], max_length=MODIFIERS_MAX)
