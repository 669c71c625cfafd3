"""The events of a world as edits: a function of deployment and frame, so that every node does the same."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from foosim.common.errors import BadValue
from foosim.common.finding import Finding, Location
from foosim.common.names import nearest_quoted
from foosim.world.assembly.event_times import Scheduled, done_to, events_by_tick, matched
from foosim.world.assembly.world import initial_numbers
from foosim.world.edits import Add, Edit, Remove, Set, written
from foosim.world.frame import Frame
from foosim.world.layout import Entity, Layout, build_layout
from foosim.world.setting.settable import add_edit, set_edits
from foosim.world.spec import WorldSpec


class Schedule:
    """The events of one deployment."""

    def __init__(self, spec: WorldSpec) -> None:
        self._spec = spec
        self.by_tick = events_by_tick(spec)

    def edits(self, tick: int, frame: Frame, before: Sequence[Edit] = ()) -> list[Edit]:
        """Return the edits of a tick's events after these edits of a frame. Raises ComponentError."""
        found: list[Edit] = []
        layout = frame.layout
        for one in self.by_tick.get(tick, ()):
            numbers = written(layout, frame.numbers, [*before, *found])
            entity = layout[one.name]
            if entity.is_absent(numbers) is (one.verb == "add"):
                found += _edits(self._spec, layout, numbers, entity, one)
        return found


def _edits(
    spec: WorldSpec, layout: Layout, numbers: Sequence[float], entity: Entity, one: Scheduled
) -> Sequence[Add | Remove | Set]:
    if one.verb == "remove":
        return [Remove(entity.name)]
    if one.verb == "add":
        place = None if one.value is True else one.value
        return [add_edit(spec, layout, numbers, entity, place, is_checked=False)]
    return set_edits(spec, layout, numbers, entity, one.field, one.value, is_checked=False)


def event_findings(spec: WorldSpec) -> Iterator[Finding]:
    """Yield problems of events: unknown or too few entities, fields that cannot be set, invalid values."""
    layout = build_layout(spec)
    numbers: Sequence[float] = ()
    for number, event in enumerate(spec.events):
        count, selector = event.chosen
        found = matched(spec, selector)
        key = "entity" if event.choose is None else "choose"
        if len(found) < (count or 1):
            what = f"{len(found)} entities match" if found else "no entity matches"
            nearest = None if found else nearest_quoted(selector, layout.names)
            yield Finding(("events", number, key), what, getattr(event, key), nearest)
            continue
        numbers = numbers or initial_numbers(spec, layout)
        yield from _findings(spec, layout, numbers, number, [one for name in found for one in done_to(name, event)])


def _findings(
    spec: WorldSpec, layout: Layout, numbers: Sequence[float], number: int, things: Sequence[Scheduled]
) -> Iterator[Finding]:
    """Yield the first problem of each effect of an event on entities."""
    found: set[Location] = set()
    for one in things:
        location: Location = ("events", number, one.verb, *([one.field] if one.field else ()))
        entity = layout[one.name]
        if location in found:
            continue
        try:
            if one.verb != "set" and not entity.can_leave:
                raise BadValue(f"{one.name} has no place of its own: it can neither be added nor removed", one.name)
            _edits(spec, layout, numbers, entity, one)
        except BadValue as bad:
            found.add(location)
            yield Finding(location, bad.problem, bad.value, bad.nearest)
