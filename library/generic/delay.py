"""Delay: a value is as old as a sensor, a converter or a field bus makes it."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Annotated

from pydantic import Field

from foosim.common import units
from foosim.common.errors import BadValue
from foosim.common.units import Quantity
from foosim.world.component_types.descriptions import Carrier
from foosim.world.component_types.registry import modifier
from foosim.world.component_types.settings import ModifierSettings
from foosim.world.components.base import Modifier, slot
from foosim.world.components.view import ModifierMounting, WritableView

Delay = Annotated[int, Quantity(units.TIME, "0 s", "10 s")]
NUMBERS_MAX = 4096
"""Numbers that one delay may keep in the frame."""
NONE = 0.0
"""In place of a tick, which is counted from 1 here: no value."""


class DelaySettings(ModifierSettings):
    """Gives each time the newest value that is at least `time` old; before there is one, none.

    A command that waits takes effect at the first tick at which it is old enough; of those of one tick the last counts.
    """

    time_ns: Delay = Field(alias="time")


def delay_ns(modifiers: Iterable[ModifierSettings]) -> int:
    """Return by how much later than measured a reading leaves its robot, or than received a command takes effect, as
    these modifiers say (ns). Who knows the deployment knows it, as the player of a real camera knows its latency."""
    return sum(one.time_ns for one in modifiers if isinstance(one, DelaySettings))


def value_count(settings: DelaySettings, carrier: Carrier) -> int:
    """Return the count of values that may be in a delay. Raises BadValue for too many."""
    younger = -(-settings.time_ns // carrier.period_ns)
    if younger * carrier.size > NUMBERS_MAX:
        what = f"{younger} values of {carrier.size} numbers wait in this time, at most {NUMBERS_MAX} numbers may"
        raise BadValue(what, units.format_ns(settings.time_ns))
    return younger + 1


@modifier("delay", DelaySettings)
class DelayLine(Modifier):
    """Keeps values, the oldest first, each with the tick at which it came, until they are old enough."""

    _values = slot(lambda settings, carrier: value_count(settings, carrier) * carrier.size)
    _ticks = slot(value_count)

    def __init__(self, settings: DelaySettings, at: ModifierMounting) -> None:
        self._ticks_old = -(-settings.time_ns // at.tick_ns)
        self._waits = settings.time_ns > 0

    def apply(self, values: list[float], view: WritableView) -> list[float] | None:
        """Take a value; return the newest that is old enough."""
        if not self._waits:
            return values
        waiting = self._waiting(view)
        if waiting and waiting[-1][0] == view.tick:
            waiting.pop()
        waiting.append((view.tick, values))
        return self._newest(waiting, view, keeps=True)

    def accept(self, values: list[float], view: WritableView) -> list[float] | None:
        """Take a command, which waits until `due`."""
        if not self._waits:
            return values
        waiting = self._waiting(view)
        if waiting and waiting[-1][0] == view.tick:
            waiting.pop()
        self._write([*waiting, (view.tick, values)], view)
        return None

    def due(self, view: WritableView) -> list[float] | None:
        """Return the command that takes effect at this tick."""
        return self._newest(self._waiting(view), view, keeps=False) if self._waits else None

    def _newest(self, waiting: list[tuple[int, list[float]]], view: WritableView, *, keeps: bool) -> list[float] | None:
        """Return the newest value that is old enough, and forget older ones; itself, too, unless `keeps`."""
        old = [place for place, (tick, _) in enumerate(waiting) if view.tick - tick >= self._ticks_old]
        newest = waiting[old[-1]][1] if old else None
        if old or keeps:
            self._write(waiting[old[-1] + (not keeps) :] if old else waiting, view)
        return newest

    def _waiting(self, view: WritableView) -> list[tuple[int, list[float]]]:
        ticks, values = view.read(self._ticks), view.read(self._values)
        size = self._values.size // self._ticks.size
        return [
            (int(tick) - 1, list(values[place * size : (place + 1) * size]))
            for place, tick in enumerate(ticks)
            if tick != NONE
        ]

    def _write(self, waiting: list[tuple[int, list[float]]], view: WritableView) -> None:
        missing = self._ticks.size - len(waiting)
        size = self._values.size // self._ticks.size
        view.write(self._ticks, *(tick + 1.0 for tick, _ in waiting), *([NONE] * missing))
        view.write(self._values, *(number for _, values in waiting for number in values), *([0.0] * missing * size))
