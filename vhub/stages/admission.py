"""Admission: drops packets of too many frames for the link, and those of a sender that is out of service.

By radio or by wire: endpoints on board of a body that is out of service have no power. Links are made anew when a body
goes out of service (`Fabric.turn_to`), so that the others need not check.
"""

from __future__ import annotations

from typing import Final

from foosim.vhub.network.link_context import LinkSetup
from foosim.vhub.network.mtu import frame_count, longest_of
from foosim.vhub.network.packet import Flight
from foosim.vhub.stages.explanation import Explanation, Seen
from foosim.vhub.stages.stage import Stage

TOO_BIG: Final = "too_big"
NODE_DOWN: Final = "node_down"
NO_ROUTE: Final = "no_route"


class Admission(Stage):
    """Compares sizes with that of FRAMES_MAX frames, and checks the sender's body in the newest frame."""

    def __init__(self, setup: LinkSetup) -> None:
        self._longest = longest_of(setup.settings)
        self._is_down = setup.world.is_down(setup.source)

    @classmethod
    def for_link(cls, setup: LinkSetup) -> Admission | None:
        if not setup.is_routed:
            return NoRoute(setup)
        return cls(setup) if setup.settings.payload_max is not None or setup.world.is_down(setup.source) else None

    def at_sending(self, flight: Flight) -> str:
        if self._longest is not None and flight.size > self._longest:
            return TOO_BIG
        return NODE_DOWN if self._is_down else ""

    def explain(self, seen: Seen, note: Explanation) -> None:
        row, mtu = seen.row, seen.settings.payload_max
        limit = "any size" if self._longest is None else f"at most {self._longest} B"
        state = seen.out_of_service(row.source) if row.cause == NODE_DOWN else "in service"
        note.add("{size} B of {}, sender {sender}", limit, size=row.size, mtu=mtu, sender=state)
        frames = note.facts["frames"] = frame_count(row.size, mtu)
        if mtu is not None and frames > 1 and row.cause != TOO_BIG:
            note.text += f", {frames} frames of {mtu} B, the last of {row.size - (frames - 1) * mtu} B"


class NoRoute(Admission):
    """The ends have no radio in common, or not that of their rule."""

    def at_sending(self, flight: Flight) -> str:
        return NO_ROUTE

    def explain(self, seen: Seen, note: Explanation) -> None:
        note.add("the ends have no radio in common, or not that of their rule", routed=False)
