"""Explains the drops of a watched link of a running system, from the vHub's report."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import msgspec

from foosim.analysis.explain import Explained, explain_row
from foosim.capture.rows import ClientRow, PacketRow
from foosim.deployment.schema import Deployment
from foosim.vhub.network.custom_models import model_versions
from foosim.world.frame import Frame


@dataclass(frozen=True)
class Reported:
    """The context of a row: the deployment, what the vHub reported under `watched`, and frames that were shown.

    `shown(tick)` gives the newest of them at or before a tick, None where none is kept: then what took how much of a
    signal in between is not told.
    """

    deployment: Deployment
    watched: Mapping[str, Any]
    shown: Callable[[int], Frame | None] = lambda tick: None

    @property
    def versions(self) -> Mapping[str, str]:
        """Of the link models as they are installed here."""
        return model_versions(self.deployment.network)

    def asked(self, until: int) -> Iterable[tuple[int, str]]:
        """Return the events that were asked of the network up to a tick."""
        return [(tick, event) for tick, event in self.watched["asked"] if tick <= until]

    def frame(self, tick: int) -> Frame | None:
        """Return the newest frame that is kept at or before a tick."""
        return self.shown(tick)

    def clients(self) -> Iterable[ClientRow]:
        """Return those who are here."""
        return [ClientRow(0, name, "joins", 0, []) for name in self.watched["here"]]


def explain_drops(evidence: Reported, source: str, destination: str) -> list[tuple[PacketRow, Explained]]:
    """Return the last packets that were dropped on a link that is looked at, oldest first, each with what became of it;
    none for any other link.
    """
    rows = msgspec.convert(evidence.watched["drops"].get(f"{source}>{destination}", []), list[PacketRow])
    return [(row, explain_row(evidence, row)) for row in rows]
