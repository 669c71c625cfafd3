"""What goes to the capture and when: a closing goes once all that it released to clients has left.

Until then its packets do not know when that was. Closings go in the order of their ticks, so one that waits holds up
those behind it. Neighbours: `release` (what waits), `core`, `capture_writer`.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

from foosim.protocol.messages import Epoch
from foosim.vhub.commits import Committed
from foosim.vhub.packet import IN_FLIGHT
from foosim.vhub.records import Closing, closing_of
from foosim.vhub.state import HubState


@dataclass(frozen=True, slots=True)
class Keep:
    """Rows for the capture, behind the journal: what one closing gave."""

    closing: Closing


@dataclass(frozen=True, slots=True)
class KeepEpoch:
    """A row for the capture: an epoch that begins."""

    epoch: Epoch


class Keeping:
    """The closings that the capture does not have yet, oldest first."""

    def __init__(self) -> None:
        self._closings: deque[Closing] = deque()

    def add(self, closing: Closing) -> None:
        """Take the closing of the next tick."""
        self._closings.append(closing)

    def take(self, waiting_tick: int | None) -> list[Keep]:
        """Take the closings before `waiting_tick`, the oldest whose packets still wait; None: none do."""
        taken = []
        while self._closings and (waiting_tick is None or self._closings[0].frame.tick < waiting_tick):
            taken.append(Keep(self._closings.popleft()))
        return taken


def last_closing(state: HubState, committed: Committed, half_closed: Closing | None, now_ns: int) -> Closing:
    """Return what a run ends with: its last frame, the fates of a tick that is half closed, and what is in flight."""
    _, commit, frame = committed
    flights = state.in_flight()
    for flight in flights:
        flight.cause = IN_FLIGHT
    closing = half_closed or closing_of(frame, commit, state, [], [], now_ns)
    closing.fates += flights
    return closing
