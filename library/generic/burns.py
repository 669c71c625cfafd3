"""What fire does to a robot that stays in it: it burns, and is out of service from then on.

The rule is of the robot, not of the world: each robot has its own time, and its drives stop as with an empty battery
(`has_power`). A rule of the world could only write `down`, and the actuators would continue.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, ClassVar, Final

from foosim.common import units
from foosim.common.spec_base import default
from foosim.common.units import Quantity
from foosim.world.component_types.descriptions import DOWN
from foosim.world.component_types.registry import rule
from foosim.world.component_types.settings import EntityRuleSettings
from foosim.world.components.base import EntityRule, need, slot
from foosim.world.components.entities import Marked, MarkKind
from foosim.world.components.fires import Fires
from foosim.world.components.mounted import Mounted
from foosim.world.components.view import Mounting, View, WritableView
from foosim.world.placing import FIRST_LINK, MountedAt

if TYPE_CHECKING:
    from foosim.world.frame import Frame

BURNT: Final = "burnt"
After = Annotated[int, Quantity(units.TIME, "0 s", "1 h")]


class BurnsSettings(EntityRuleSettings):
    """A robot burns when it has been in fires for the time `after` without a break; it is in one where `at` is.

    Fires are balls about their places.
    """

    at: MountedAt = FIRST_LINK
    after_ns: After = default("1 s", "after")


@rule("burns", BurnsSettings, writes=(DOWN,))
class Burns(EntityRule):
    """How long a robot has been in fires, and whether it has burnt. Put into service again, it is as new."""

    mark_kinds: ClassVar = {BURNT: MarkKind("lost", "robots that have burnt")}
    inside_ticks, burnt = slot(), slot()
    down = need()

    def __init__(self, settings: BurnsSettings, at: Mounting) -> None:
        self._name, self._field = at.robot.name, f"{at.name}.{BURNT}"
        self._after = max(1, -(-settings.after_ns // at.spec.tick_ns))
        self._mount, self._fires = Mounted(at, settings.at), Fires(at.spec, at.layout)

    @staticmethod
    def check(settings: BurnsSettings, at: Mounting) -> None:
        """Raise IncompatibleComponent for a robot without a body, and for a link that it does not have."""
        Mounted(at, settings.at)

    def has_power(self, view: View) -> bool:
        """Whether it has not burnt, or is in service again."""
        return view.numbers[self.burnt.at] == 0.0 or view.numbers[self.down.at] == 0.0

    def apply(self, view: WritableView) -> None:
        """Count the ticks in fires; with the last one it burns."""
        place, _ = self._mount.pose(view.start)
        is_in = any(square <= radius * radius for radius, square in self._fires.near(place, view.start))
        is_down = view.numbers[self.down.at] != 0.0
        was_burnt = is_down and view.numbers[self.burnt.at] != 0.0
        inside = view.numbers[self.inside_ticks.at] + 1.0 if is_in and not was_burnt else 0.0
        is_burnt = was_burnt or inside >= self._after
        view.write(self.inside_ticks, inside)
        view.write(self.burnt, float(is_burnt))
        if is_burnt and not is_down:
            view.write(self.down, 1.0)

    def marks(self, before: Frame, after: Frame) -> Iterator[Marked]:
        """Yield that it has burnt since."""
        if before.at(self._name, self._field) == 0.0 < after.at(self._name, self._field):
            yield after.tick, BURNT, f"{self._name} has burnt"
