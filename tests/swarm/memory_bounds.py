"""Memory bounds of cores: a walk over all their containers, which names those that exceed their bound.

No container of a core may grow with the ticks of a run. The default bound is a multiple of the ticks that other
processes can still request; the table has the other bounds. A new container is checked without an entry.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping
from typing import Any, Final

import msgspec

from foosim.common import limits
from foosim.deployment.network.rules import EVENTS_MAX
from foosim.deployment.schema import Deployment
from foosim.supervisor.records import ANSWERS_KEPT
from foosim.vhub.line_of_sight.occlusion import Sight
from foosim.vhub.network.memory import AirState, LinkState, RadioState
from foosim.vhub.radio.propagation import LOSS_MAX_DB
from foosim.vhub.radio.shadowing import CELLS_KEPT
from foosim.world.frame import Frame
from foosim.world.layout import Layout
from foosim.world.moving.solids import Standing

KEPT_MAX: Final = 4 * limits.KEPT_TICKS
BOUNDS: Final[Mapping[str, int]] = {
    "PendingEpochMessages._messages": limits.HELD_MESSAGES_MAX,
    "RunState.answers": ANSWERS_KEPT,
    "RunState.recovered": 64 * limits.RECOVERIES_PER_COMMIT_MAX,  # of the whole run: it is in the result
    "Releases._anchors": 1 << 14,  # a second of commits, at the highest pace
    "Lags.cells": 1 << 13,
    "Propagation._ways": limits.CLIENTS_MAX,  # pairs of sender and receiver
    "Propagation._places": limits.CLIENTS_MAX,
    "Propagation._reaches": LOSS_MAX_DB + 1,  # of fixed length
    "_Lattice._cells": CELLS_KEPT,
    "Fabric.states": limits.CLIENTS_MAX,
    "Fabric._links": limits.CLIENTS_MAX,
    "Fabric.radios": limits.CLIENTS_MAX,
    "HubState._receivers": limits.ENTITIES_MAX,
    "Transit._by_source": limits.ENTITIES_MAX,
    "HubState._flights": 1 << 14,  # arrivals by tick: each of many clients may receive from all others
    "Air._flights": 1 << 14,  # transmissions on air: one for each receiver of a broadcast
    "AirState.on_air": 1 << 14,
    "RadioState.waiting": 1 << 14,  # the capacity of its queue
    "Process.report": limits.CLIENTS_MAX,  # a line a link
    "Fabric.requested": EVENTS_MAX,
    "Timeline._events": 2 * EVENTS_MAX,
    "Timeline.settings": 2 * EVENTS_MAX,
    "Timeline.holds": 2 * EVENTS_MAX,
    "Timeline.cuts": 2 * EVENTS_MAX,
    "Downlinks._by_client": limits.DOWNLINKS_KEPT_MAX,
}
"""By class and attribute: containers that ticks do not bound."""
CONSTANT: Final[tuple[type[Any], ...]] = (Deployment, Layout, Frame, msgspec.Struct, Sight, Standing)
"""Types that do not grow, or belong to one frame."""
SIMPLE: Final = frozenset({bool, bytes, float, int, str, type(None)})
"""Types without contents."""
REMEMBERED: Final[tuple[type[Any], ...]] = (LinkState, RadioState, AirState)
"""Messages do not grow; these structs do."""


def too_large(core: object) -> list[str]:
    """Return the containers of a core that exceed their bound, each as `Class.attribute has n of m`."""
    return [
        f"{where} has {size} of {BOUNDS.get(where, KEPT_MAX)}"
        for where, size in sizes(core)
        if size > BOUNDS.get(where, KEPT_MAX)
    ]


def sizes(core: object) -> list[tuple[str, int]]:
    """Return the size of every container of a core, at any depth, by class and attribute."""
    found: list[tuple[str, int]] = []
    seen: set[int] = set()
    todo: list[tuple[str, Any]] = [("", core)]
    while todo:
        where, value = todo.pop()
        kind = type(value)
        if kind in SIMPLE or id(value) in seen or (isinstance(value, CONSTANT) and not isinstance(value, REMEMBERED)):
            continue
        seen.add(id(value))
        if isinstance(value, (dict, list, set, deque)):
            found.append((where, len(value)))
            inside = value.values() if isinstance(value, dict) else value
            todo += [(where, item) for item in inside if type(item) not in SIMPLE]
        elif kind.__module__.startswith(("foosim.", "tests.swarm.")):
            todo += [(f"{kind.__name__}.{name}", held) for name, held in _attributes(value) if type(held) not in SIMPLE]
    return found


def _attributes(value: object) -> Iterator[tuple[str, Any]]:
    yield from getattr(value, "__dict__", {}).items()
    for name in getattr(value, "__struct_fields__", ()):
        yield name, getattr(value, name)
    for kind in type(value).__mro__:
        for name in (*getattr(kind, "__slots__", ()), *getattr(kind, "__mypyc_attrs__", ())):
            if hasattr(value, name):
                yield name, getattr(value, name)
