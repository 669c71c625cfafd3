"""Which ball touches which figure of a rod, when, and how hard."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Final

from msgspec import Meta, Struct

from foosim.library.table.rod import RodRobot, figure_ys
from foosim.library.table.settings import table_of
from foosim.world.component_types.descriptions import NO_ENTITY, TOUCHES, TOUCHES_MAX
from foosim.world.component_types.quantities import Count, NewtonSeconds
from foosim.world.component_types.registry import sensor
from foosim.world.component_types.settings import SensorSettings
from foosim.world.components.base import Sensor
from foosim.world.components.view import Mounting, View

TUBE: Final = 0.0
"""The link that has the tube."""
NONE: Final = -1.0
"""In place of a ball where nothing is touched, of a figure where it is the tube."""
Counts = Annotated[tuple[Count, ...], Meta(min_length=TOUCHES_MAX, max_length=TOUCHES_MAX)]
Impulses = Annotated[tuple[NewtonSeconds, ...], Meta(min_length=TOUCHES_MAX, max_length=TOUCHES_MAX)]


class FigureContactSettings(SensorSettings):
    """Reports contacts at its rate, and also at each tick after one in which a contact has begun."""


class FigureTouches(Struct, frozen=True):
    """The contacts of a rod in the last tick, at most two: the `count` of new ones, and of each its ball, its
    figure, the substep in which it began, and the sum of the normal impulses, in the order in which they began.

    Balls are counted from 0 in the order of their names, figures from 0 in that of their y; -1 is no ball, and the
    tube. Substeps are counted from 0; a contact from before the tick has 0.
    """

    count: Count
    balls: Counts
    figures: Counts
    substeps: Counts
    impulses: Impulses


def _touches(settings: FigureContactSettings, counts: Mapping[str, int]) -> int:
    return TOUCHES_MAX


@sensor(
    "figure_contact",
    FigureContactSettings,
    FigureTouches,
    needs=(*TOUCHES,),
    trigger="touches",
    array_length=_touches,
    kit="table",
)
class FigureContact(Sensor):
    """Contacts of balls with the figures and the tube of a rod in the last tick."""

    def __init__(self, settings: FigureContactSettings, at: Mounting) -> None:
        robot = at.spec.robots[at.robot.name]
        assert isinstance(robot, RodRobot), robot
        self._slots = [at.slot(field) for field in TOUCHES]
        self._balls = {float(ball.index): float(number) for number, ball in enumerate(at.layout.of("ball"))}
        self._ys = figure_ys(table_of(at.spec).lines[robot.line])

    def sample(self, view: View) -> FigureTouches:
        count, partners, links, places, starts, _, impulses = (view.read(slot) for slot in self._slots)
        balls, figures, substeps = [NONE] * TOUCHES_MAX, [NONE] * TOUCHES_MAX, [NONE] * TOUCHES_MAX
        for row, partner in enumerate(partners):
            if partner != NO_ENTITY:
                balls[row], substeps[row] = self._balls.get(partner, NONE), starts[row]
                figures[row] = NONE if links[row] == TUBE else self._figure(places[row])
        return FigureTouches(count[0], tuple(balls), tuple(figures), tuple(substeps), tuple(impulses))

    def _figure(self, y: float) -> float:
        """Return the number of the figure that stands nearest to a place along the rod (m)."""
        return float(min(range(len(self._ys)), key=lambda number: abs(self._ys[number] - y)))
