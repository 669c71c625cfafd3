"""The schedule of a world's events: a function of the deployment, so that all nodes compute the same."""

from __future__ import annotations

from collections.abc import Iterator
from fnmatch import fnmatchcase
from typing import Literal, NamedTuple

from foosim.common.keyed_random import draw_key, draw_words, unit_interval
from foosim.world.events import Value, WorldEvent
from foosim.world.layout import WORLD, spares_of
from foosim.world.spec import WorldSpec


class Scheduled(NamedTuple):
    """The effect of an event on an entity: it sets a field, or without a field adds or removes the entity."""

    name: str
    verb: Literal["set", "add", "remove"]
    field: str
    value: Value

    @property
    def text(self) -> str:
        """The effect in words."""
        if self.verb != "set":
            return f"{self.name} is {'added' if self.verb == 'add' else 'removed'}"
        value = str(self.value).lower() if isinstance(self.value, bool) else self.value
        return f"{self.field} of {self.name} is set to {value}"


def events_by_tick(spec: WorldSpec) -> dict[int, list[Scheduled]]:
    """Return the effects of a world's events, by the tick at whose start they happen, in the order of their list."""
    found: dict[int, list[Scheduled]] = {}
    for number, event in enumerate(spec.events):
        for name, tick in _drawn(spec, number, event):
            found.setdefault(tick, []).extend(done_to(name, event))
    return found


def done_to(name: str, event: WorldEvent) -> list[Scheduled]:
    """Return the effects of an event on an entity, in the order of its fields."""
    if event.add is not None:
        return [Scheduled(name, "add", "", event.add)]
    if event.fields is None:
        return [Scheduled(name, "remove", "", True)]
    return [Scheduled(name, "set", *item) for item in event.fields.items()]


def matched(spec: WorldSpec, selector: str) -> list[str]:
    """Return the robots, objects and entities of kits that a selector matches, in name order; `world` is the world."""
    brought = [name for kit in spec.kit_types.values() for name in (*kit.entities, *spares_of(spec, kit))]
    if selector == WORLD and any(one.component_type.settable for one in spec.world_rules.values()):
        return [WORLD]
    return [name for name in sorted((*spec.robots, *spec.objects, *brought)) if fnmatchcase(name, selector)]


def _drawn(spec: WorldSpec, number: int, event: WorldEvent) -> Iterator[tuple[str, int]]:
    """Yield the entities of an event, in name order, and the tick of each."""
    count, selector = event.chosen
    words = {name: draw_words(draw_key(spec.seed, "event", str(number), name), 0) for name in matched(spec, selector)}
    first, last = (-(-time_ns // spec.tick_ns) for time_ns in event.span_ns)
    for name in sorted(sorted(words, key=words.__getitem__)[:count]):
        yield name, first + int(unit_interval(words[name][1]) * (last - first + 1))
