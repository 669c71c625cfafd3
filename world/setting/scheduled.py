"""The events of a world as edits: a function of deployment and frame, so that every node sets the same."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from foosim.common.errors import BadValue
from foosim.common.finding import Finding
from foosim.common.names import nearest_quoted
from foosim.world.assembly.event_times import events_by_tick, matched
from foosim.world.assembly.world import initial_numbers
from foosim.world.edits import Set, written
from foosim.world.frame import Frame
from foosim.world.layout import build_layout
from foosim.world.setting.settable import set_edits
from foosim.world.spec import WorldSpec


class Schedule:
    """The events of one deployment."""

    def __init__(self, spec: WorldSpec) -> None:
        self._spec = spec
        self.by_tick = events_by_tick(spec)

    def edits(self, frame: Frame) -> list[Set]:
        """Return what the events of a frame's tick set. Raises ComponentError."""
        found: list[Set] = []
        layout = frame.layout
        for name, field, value in self.by_tick.get(frame.tick, ()):
            numbers = written(layout, frame.numbers, found)
            found += set_edits(self._spec, layout, numbers, layout[name], field, value, is_checked=False)
        return found


def event_findings(spec: WorldSpec) -> Iterator[Finding]:
    """Yield what is wrong with events: entities that are not there or too few, fields that are not settable, values."""
    layout = build_layout(spec)
    numbers: Sequence[float] = ()
    for number, event in enumerate(spec.events):
        count, selector = event.chosen
        found = matched(spec, selector)
        key = "entity" if event.choose is None else "choose"
        if len(found) < (count or 1):
            everybody = [*spec.robots, *spec.objects]
            what = f"{len(found)} robots and objects match" if found else "no robot and no object matches"
            nearest = None if found else nearest_quoted(selector, everybody)
            yield Finding(("events", number, key), what, getattr(event, key), nearest)
            continue
        numbers = numbers or initial_numbers(spec, layout)
        for field, value in event.fields.items():
            for name in found:
                try:
                    set_edits(spec, layout, numbers, layout[name], field, value, is_checked=False)
                except BadValue as bad:
                    yield Finding(("events", number, "set", field), bad.problem, bad.value, bad.nearest)
                    break
