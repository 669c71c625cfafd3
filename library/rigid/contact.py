"""What a rigid body has touched in the last tick."""

from __future__ import annotations

from typing import ClassVar

from msgspec import Struct

from foosim.world.component_types.quantities import Count, NewtonSeconds
from foosim.world.component_types.registry import sensor
from foosim.world.component_types.settings import SensorSettings
from foosim.world.components.base import need
from foosim.world.components.rows import SlotSensor


class ContactSettings(SensorSettings):
    """Measures touches at its rate, and also at each tick after one in which a touch has begun."""


class Touches(Struct, frozen=True):
    """The touches of a robot in the last tick: the `count` of new ones, the sum of the normal impulses, and the last
    substep with a touch, counted from 0; -1 for none."""

    count: Count
    impulse: NewtonSeconds
    substep: Count


@sensor("contact", ContactSettings, Touches, trigger="contacts")
class ContactSensor(SlotSensor):
    """Touches of a robot in the last tick: how many began, their impulse, the last substep with one."""

    contacts = need()
    reading: ClassVar = Touches
