"""When the events of a world set what: a function of the deployment, so that it is the same for all who compute it."""

from __future__ import annotations

from collections.abc import Iterator
from fnmatch import fnmatchcase
from typing import NamedTuple

from foosim.common.keyed_random import draw_key, draw_words, unit_interval
from foosim.world.events import Value, WorldEvent
from foosim.world.spec import WorldSpec


class Scheduled(NamedTuple):
    """A field of an entity that an event sets."""

    name: str
    field: str
    value: Value

    @property
    def text(self) -> str:
        """What happens, in words."""
        value = str(self.value).lower() if isinstance(self.value, bool) else self.value
        return f"{self.field} of {self.name} is set to {value}"


def events_by_tick(spec: WorldSpec) -> dict[int, list[Scheduled]]:
    """Return what the events of a world set, by the tick at whose start they do, in the order of their list."""
    found: dict[int, list[Scheduled]] = {}
    for number, event in enumerate(spec.events):
        for name, tick in _drawn(spec, number, event):
            found.setdefault(tick, []).extend([Scheduled(name, *item) for item in event.fields.items()])
    return found


def matched(spec: WorldSpec, selector: str) -> list[str]:
    """Return the robots and objects that a selector matches, in name order."""
    return [name for name in sorted((*spec.robots, *spec.objects)) if fnmatchcase(name, selector)]


def _drawn(spec: WorldSpec, number: int, event: WorldEvent) -> Iterator[tuple[str, int]]:
    """Yield the entities of an event, in name order, and the tick of each."""
    count, selector = event.chosen
    words = {name: draw_words(draw_key(spec.seed, "event", str(number), name), 0) for name in matched(spec, selector)}
    first, last = (-(-time_ns // spec.tick_ns) for time_ns in event.span_ns)
    for name in sorted(sorted(words, key=words.__getitem__)[:count]):
        yield name, first + int(unit_interval(words[name][1]) * (last - first + 1))
