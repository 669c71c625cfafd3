"""Whose turn it is on a channel of 802.11: stations count down while it is idle, and freeze while another one sends.

A station that becomes ready counts down from the slots of backoff that its packet has drawn. What it hears stops the
count, and takes one slot of it, as in Bianchi's chain; at its end the station has its turn. So the station whose
counter ends first wins, and draws anew from the least window: a station may win several times
in a row, and one whose attempts failed waits for long. Turns are found when a packet is sent, from the packets known
by then; the turns of stations that were to come later are put off by one that comes in between, until they begin. A
turn that has begun stays.
"""

from __future__ import annotations

from collections.abc import Callable
from operator import attrgetter
from typing import Final

from foosim.vhub.network.memory import RadioState, Transmission
from foosim.vhub.network.packet import Flight
from foosim.vhub.radio.propagation import Propagation

PutOff = Callable[[Flight, int, dict[int, int]], None]
"""Delays a packet by a time in ns, given the due times of deferred ones before it, by link."""


class Turn:
    """A turn that is still to begin, with its sender's radio and its packets."""

    __slots__ = ("known", "packets", "sender")

    def __init__(self, known: Transmission, sender: RadioState) -> None:
        self.known, self.sender = known, sender
        self.packets: list[tuple[Flight, Propagation, PutOff]] = []

    def put_off(self, by_ns: int, ready_by_ns: int, last_ns: dict[int, int]) -> None:
        """Have it begin so much later, and its packet be the first of its queue so much later.

        `last_ns` are the due times of packets that were put off before it, by link.
        """
        known, sender = self.known, self.sender
        if by_ns:
            old_ns = known.until_ns
            if ready_by_ns:
                known.ready_ns += ready_by_ns
            known.turn_ns += by_ns
            known.start_ns += by_ns
            known.end_ns += by_ns
            new_ns = known.until_ns = old_ns + by_ns
            if sender.free_ns == old_ns:
                sender.free_ns = new_ns
            waiting = sender.waiting
            for place, (until_ns, size) in enumerate(waiting):
                if until_ns == old_ns:
                    waiting[place] = new_ns, size
                    break
        for flight, _, put_off in self.packets:
            if not flight.cause:
                if by_ns:
                    flight.air_start_ns += by_ns
                    flight.air_end_ns += by_ns
                    # What waits for an earlier frame of its own packet is not in a queue.
                    waits_ns = 0 if flight.frames else ready_by_ns
                    flight.access_ns += by_ns - waits_ns
                    if waits_ns:
                        flight.queue_ns += waits_ns
                put_off(flight, by_ns, last_ns)


_ORDER: Final = attrgetter("known.turn_ns", "known.source")


class Contest:
    """The contention that a station meets when it becomes ready: contenders, and turns before its own."""

    def __init__(self, ready_ns: int, contenders: int, free_ns: int, turns: list[Turn], hears: list[str]) -> None:
        self.contenders, self.hears = contenders, hears
        """Contenders with the station itself; and the stations in range whose turn has not begun."""
        self._at_ns = max(ready_ns, free_ns)
        self._turns = turns
        """The turns of these stations."""

    def turn_ns(self, backoff_ns: int, slot_ns: int) -> int:
        """Return when the station's counter expires, which has `backoff_ns` left when it is ready."""
        at_ns, turns = self._at_ns, self._turns
        if len(turns) > 1:
            turns.sort(key=_ORDER)
        for turn in turns:
            known = turn.known
            if known.until_ns <= at_ns:
                continue
            idle_ns = known.turn_ns - at_ns
            if backoff_ns < idle_ns:
                break
            if idle_ns > 0:
                backoff_ns -= idle_ns
            backoff_ns = backoff_ns - slot_ns if backoff_ns > slot_ns else 0
            at_ns = known.until_ns
        return at_ns + backoff_ns

    def put_off(self, turn_ns: int, busy_ns: int, slot_ns: int, of_all: dict[tuple[str, int, int, int], Turn]) -> None:
        """Defer the turns after one of the station that takes `busy_ns`; `of_all` are all turns that are to come.

        They are frozen meanwhile, less the slot of their own countdown that it takes, and less the time for which a
        station was not ready yet. A station that does not hear this one is put off as far as it hears one that is: of
        two turns to come the later one knows whether they hear each other.
        """
        later = [turn for turn in self._turns if turn.known.turn_ns > turn_ns]
        if not later:
            return
        first = later[0].known
        most_ns = busy_ns - min(slot_ns, first.turn_ns - max(first.ready_ns, turn_ns))
        heard = {turn.known.source for turn in later}
        if len(of_all) > len(self._turns):  # `_turns` has all turns of the stations that it hears
            hears = set(self.hears)
            others = [
                turn for turn in of_all.values() if turn.known.turn_ns > turn_ns and turn.known.source not in hears
            ]
            if others:
                later = sorted([*later, *others], key=_ORDER)
        over_ns = turn_ns
        moved: dict[str, tuple[int, int, Transmission]] = {}
        last_ns: dict[int, int] = {}
        for turn in later:
            known = turn.known
            source, until_ns = known.source, known.until_ns
            before = moved.get(source)
            ready_by_ns = before[1] if before is not None and before[0] == known.ready_ns else 0
            if source in heard:
                slack_ns = known.ready_ns - over_ns
                by_ns = most_ns - slack_ns if slack_ns > 0 else most_ns
                over_ns = max(over_ns, until_ns)
            else:
                by_ns = 0
                for _, other_by_ns, other in moved.values():
                    if other_by_ns > by_ns and (other.source in known.hears or source in other.hears):
                        by_ns = other_by_ns
            by_ns = max(by_ns, ready_by_ns)
            moved[source] = until_ns, by_ns, known
            if by_ns or before is not None:
                turn.put_off(by_ns, ready_by_ns, last_ns)
