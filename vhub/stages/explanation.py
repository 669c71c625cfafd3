"""A captured packet as the stages of its link explain it: its row, its link as it was then, its draws made again."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

from foosim.capture.rows import PacketRow, Row
from foosim.common.format import EXACT, rate_text, time_text
from foosim.common.keyed_random import UNIT
from foosim.deployment.network.radios import Radio
from foosim.deployment.schema import Deployment
from foosim.vhub.network.link_context import LinkSetup
from foosim.vhub.network.packet import Flight
from foosim.vhub.network.timeline import Timeline
from foosim.world.frame import Frame


@dataclass(frozen=True, slots=True)
class Evidence:
    """The context of a row: a capture, or the recent state of a running system.

    `versions` are the versions of libraries and link models by name, `requested` the requested events of the network:
    ticks and JSON. `frame(tick)` is the newest frame at or before a tick, None where there is none, and `clients()` has
    joins and leaves in their order.
    """

    deployment: Deployment
    versions: Mapping[str, str]
    requested: Sequence[tuple[int, str]]
    frame: Callable[[int], Frame | None]
    clients: Callable[[], Iterable[Row]]


@dataclass(slots=True)
class Explanation:
    """What a stage looked at: a text, and its numbers."""

    text: str = ""
    facts: dict[str, Any] = field(default_factory=dict)

    def add(self, template: str, *texts: str, **facts: Any) -> None:
        """Add facts, and a text: in it `{name}` is a fact with the unit that ends its name, `{}` one of `texts`."""
        self.facts |= facts
        self.text += template.format(*texts, **{name: _shown(name, fact) for name, fact in facts.items()})


def exact(ns: float) -> str:
    """Return a time with every nanosecond."""
    return time_text(ns, EXACT)


_UNITS: Final[Mapping[str, Callable[[float], str]]] = {"ns": exact, "bps": rate_text}


def _shown(name: str, fact: Any) -> str:
    unit = _UNITS.get(name.rpartition("_")[2])
    if unit is not None and fact is not None:
        return unit(fact)
    return f"{fact:g}" if isinstance(fact, float) else str(fact)


def beside(draw: int, threshold: int) -> str:
    """Return a draw beside the threshold that it is compared with."""
    return f"draw {draw / UNIT:g} is {'below' if draw < threshold else 'not below'} {threshold / UNIT:g}"


@dataclass(frozen=True, slots=True)
class Seen:
    """A captured packet; `flight` has what its stages draw and judge by, `timeline` the events up to its arrival."""

    row: PacketRow
    flight: Flight
    setup: LinkSetup
    timeline: Timeline
    evidence: Evidence

    @property
    def settings(self) -> Radio:
        return self.setup.settings

    @property
    def tick(self) -> int:
        return self.row.sent_ns // self.evidence.deployment.tick_ns

    @property
    def is_broadcast(self) -> bool:
        return self.row.published and self.setup.settings.sends_once

    def out_of_service(self, endpoint: str) -> str:
        """Return that an endpoint's body is out of service, and which body where it is another's."""
        body = self.setup.world.body(endpoint)
        return "out of service" + ("" if body == endpoint else f" with {body}, which it is on board of")
