"""The queue of closings for the capture: each is recorded once all packets that it released to clients were sent.

Only then its packets have their times of release. Closings are recorded in the order of their ticks, so one that waits
delays all later ones.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

from foosim.protocol.messages import Epoch
from foosim.vhub.network.packet import IN_FLIGHT, flight_of, state_of
from foosim.vhub.state.commits import Commits, Committed
from foosim.vhub.state.hub_state import HubState
from foosim.vhub.state.records import Closing, closing_of


@dataclass(frozen=True, slots=True)
class RecordClosing:
    """Action: record one closing in the capture. It comes after the closing's journal record."""

    closing: Closing


@dataclass(frozen=True, slots=True)
class RecordEpoch:
    """Action: record the beginning of an epoch in the capture."""

    epoch: Epoch


class CaptureQueue:
    """The closings that are still to be recorded, oldest first."""

    def __init__(self) -> None:
        self._closings: deque[Closing] = deque()

    def add(self, closing: Closing) -> None:
        """Append the closing of the next tick."""
        self._closings.append(closing)

    def take(self, waiting_tick: int | None) -> list[RecordClosing]:
        """Remove and return the closings before `waiting_tick`, the oldest tick with unsent packets; None: all."""
        taken = []
        while self._closings and (waiting_tick is None or self._closings[0].frame.tick < waiting_tick):
            taken.append(RecordClosing(self._closings.popleft()))
        return taken


def last_closings(
    state: HubState, commits: Commits, end_tick: int, half_closed: Closing | None, now_ns: int
) -> list[Closing]:
    """Return the last closings of a run: the tick that is half closed, with its fates, and all committed frames after
    it, up to `end_tick`; the last one has the packets in flight.

    Nodes run ahead of closings as far as deliveries allow, so there may be many. Open ticks have no fates.
    """
    closings = [] if half_closed is None else [half_closed]
    for tick in range(state.closed + len(closings) + 1, end_tick + 1):
        committed = commits.get(tick)
        if committed is None:
            break
        closings.append(_unjudged(state, commits, committed, now_ns))
    closed = commits.get(state.closed)
    if not closings and closed is not None:
        closings.append(_unjudged(state, commits, closed, now_ns))
    for closing in closings[-1:]:
        closing.ages = state.ages.unreported(state.closed)
        for flight in state.in_flight():
            left = flight_of(state_of(flight))
            left.cause = IN_FLIGHT
            closing.fates.append(left)
    return closings


def _unjudged(state: HubState, commits: Commits, committed: Committed, now_ns: int) -> Closing:
    _, commit, frame = committed
    return closing_of(frame, commit, commits.chain_at(frame.tick), state, [], [], now_ns)
