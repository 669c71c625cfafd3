"""An air: a channel that radios share, with its transmissions, which station receives which, and their interference.

A transmission is registered when it is judged, with the times at which it is on air. It adds its power to the packets
that overlap with it at their receivers, also to earlier ones that are still on air; each packet's sum is
of whole numbers, so no order matters. A sending station hears nothing. Stations that hear one another
take turns, so they overlap only where they do not. A turn of 802.11 is put off, until it begins, by stations that come
in between; what it spoils, and what spoils it, is found when it has begun.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Final

from foosim.vhub.network.memory import AirState, RadioState, Transmission
from foosim.vhub.network.packet import Flight
from foosim.vhub.network.turns import Contest, PutOff, Turn
from foosim.vhub.radio.errors import LORA_FACTORS
from foosim.vhub.radio.noise import NEGLIGIBLE_CDB, units_of
from foosim.vhub.radio.propagation import Propagation

DEAF: Final = 2**62
"""In units of 1e-21 W: the interference of a station with itself. That of others stays below: it is cut there, since
sums of cut numbers do not depend on their order either, and a state has 64 bits for them."""
NOTHING_CDBM: Final = -(10**6)
NEVER_NS: Final = 2**62
Key = tuple[str, int, int, int]
"""Source, sequence, copy and frame of a packet: of a broadcast one for all its receivers."""


class _Heard:
    """A transmission at its receivers: its packets, and the transmissions that overlap it."""

    __slots__ = ("beside", "end_ns", "flights", "of", "source", "start_ns")

    def __init__(self, flight: Flight, of: Propagation, on_air: Iterable[Transmission]) -> None:
        self.source, self.of = flight.source, of
        self.start_ns, self.end_ns = flight.air_start_ns, flight.air_end_ns
        self.flights: list[Flight] = []
        self.beside = [known for known in on_air if self.overlaps(known)]

    def has(self, flight: Flight, of: Propagation) -> bool:
        """Whether a packet belongs to it."""
        times_ns = self.start_ns, self.end_ns
        return self.of is of and self.source == flight.source and times_ns == (flight.air_start_ns, flight.air_end_ns)

    def overlaps(self, known: Transmission) -> bool:
        """Whether another transmission overlaps it; one without a duration never does."""
        if known.start_ns == known.end_ns or known.source == self.source:
            return False
        return known.start_ns < self.end_ns and known.end_ns > self.start_ns


class Air:
    """One air in one world: its state, and its packets, each with the propagation of its radio's signals."""

    def __init__(self, state: AirState, senders: Mapping[tuple[str, str], RadioState]) -> None:
        """`senders` has the radios of all endpoints, by endpoint and radio."""
        self.state = state
        self._senders = senders
        self._heard: list[_Heard] = []
        self._advanced_ns = -1
        self._open: dict[Key, Turn] = {}
        """The turns that are still to begin."""
        self._next_ns = NEVER_NS
        """No turn begins before this time."""
        for known in state.on_air:
            if known.turn_ns >= 0:
                self._add_open(known)

    def restore(self, flight: Flight, of: Propagation) -> None:
        """Add a packet in flight of a restored state."""
        if flight.air_end_ns > flight.sent_ns and not flight.is_settled and self._turn_of(flight) is None:
            self._group(flight, of).flights.append(flight)

    def advance(self, now_ns: int) -> None:
        """Drop transmissions that have ended."""
        if now_ns == self._advanced_ns:
            return
        self._advanced_ns = now_ns
        self.settle(now_ns)
        self.state.on_air[:] = [known for known in self.state.on_air if known.until_ns > now_ns]
        self._heard = [heard for heard in self._heard if heard.end_ns > now_ns]

    def turn(self, source: str, ready_ns: int, of: Propagation) -> tuple[int, int]:
        """Return when the turn of a station that is ready to send begins, and the number of contenders with it.

        It waits for all stations that it hears; stations with a packet queued or on air when it is ready contend.
        """
        place = of.place(source)
        start_ns = ready_ns
        heard: set[str] = set()
        for known in self.state.on_air:
            until_ns, other = known.until_ns, known.source
            if until_ns <= ready_ns or other == source:
                continue
            if other not in heard:
                if not of.hears(of.place_at(other, known.position), place, known.power_cdbm):
                    continue
                heard.add(other)
            start_ns = max(start_ns, until_ns)
        return start_ns, 1 + len(heard)

    def contest(self, source: str, ready_ns: int, of: Propagation) -> Contest:
        """Return the contention that a station of 802.11 meets when it is ready to send.

        Stations with a packet queued or on air then contend; where packets of the station itself wait before this one,
        stations with at least three quarters as many by now: all get the same number of turns in the long run.
        """
        place, now_ns, free_ns, waiting = of.place(source), self._advanced_ns, ready_ns, 1
        hears: dict[str, bool] = {}
        contending: set[str] = set()
        turns: list[Turn] = []
        open_turns = self._open
        for known in self.state.on_air:
            other, until_ns, is_open = known.source, known.until_ns, known.turn_ns >= 0
            if other == source:
                if known.end_ns > now_ns:
                    waiting += 1
                continue
            if until_ns <= ready_ns and not is_open:
                continue
            is_heard = hears.get(other)
            if is_heard is None:
                is_heard = of.hears(of.place_at(other, known.position), place, known.power_cdbm)
                hears[other] = is_heard
            if not is_heard:
                continue
            if until_ns > ready_ns:
                contending.add(other)
            if is_open:
                turns.append(open_turns[other, known.sequence, known.copy, known.frame])
            elif until_ns > free_ns:
                free_ns = until_ns
        if waiting > 1:
            counts = Counter([known.source for known in self.state.on_air])
            contending |= {other for other, is_heard in hears.items() if is_heard and 4 * counts[other] >= 3 * waiting}
        return Contest(ready_ns, 1 + len(contending), free_ns, turns, [turn.known.source for turn in turns])

    def take_turn(self, contest: Contest, turn_ns: int, busy_ns: int, slot_ns: int) -> None:
        """Defer the turns after one of this duration."""
        contest.put_off(turn_ns, busy_ns, slot_ns, self._open)

    def plan(self, flight: Flight, of: Propagation, put_off: PutOff) -> None:
        """Add a packet in flight; if its turn has not begun, a deferral of the turn delays the packet."""
        turn = self._turn_of(flight)
        if turn is not None:
            turn.packets.append((flight, of, put_off))

    def settle(self, until_ns: int) -> None:
        """Begin the turns up to a time, before which nothing is sent any more, with their interference."""
        if self._next_ns > until_ns:
            return
        self._next_ns = NEVER_NS
        begun = []
        for turn in self._open.values():
            turn_ns = turn.known.turn_ns
            if turn_ns <= until_ns:
                begun.append(turn)
            elif turn_ns < self._next_ns:
                self._next_ns = turn_ns
        for turn in begun:
            known = turn.known
            del self._open[known.source, known.sequence, known.copy, known.frame]
            known.turn_ns, known.radio, known.hears = -1, "", []
            self._spoil_others(known)
            for flight, of, _ in turn.packets:
                if not flight.cause and not flight.is_settled:
                    self.listen(flight, of)

    def register(self, known: Transmission) -> None:
        """Add a transmission. One without a duration has ended at once."""
        if known.until_ns > self._advanced_ns:
            self.state.on_air.append(known)
        if known.turn_ns < 0:
            self._spoil_others(known)
        else:
            self._add_open(known)

    def _turn_of(self, flight: Flight) -> Turn | None:
        """Return a packet's turn, of its last frame, if it has not begun."""
        return self._open.get((flight.source, flight.sequence, flight.copy, max(0, flight.frames - 1)))

    def _add_open(self, known: Transmission) -> None:
        """Add a transmission that is still to begin."""
        self._open[known.source, known.sequence, known.copy, known.frame] = Turn(
            known, self._senders[known.source, known.radio]
        )
        self._next_ns = min(self._next_ns, known.turn_ns)

    def _spoil_others(self, known: Transmission) -> None:
        """Apply a transmission's interference to the overlapping ones."""
        for heard in self._heard:
            if heard.overlaps(known):
                heard.beside.append(known)
                for flight in heard.flights:
                    if not flight.cause:  # the inputs of a final fate do not change
                        _spoil(flight, known, heard.of)

    def listen(self, flight: Flight, of: Propagation) -> None:
        """Add a packet on air, with the interference of overlapping transmissions, unless its turn has not begun."""
        if self._turn_of(flight) is not None:
            return
        heard = self._group(flight, of)
        for known in heard.beside:
            _spoil(flight, known, of)
        heard.flights.append(flight)

    def _group(self, flight: Flight, of: Propagation) -> _Heard:
        """Return the transmission of a packet: the newest one, where it exists for other receivers already."""
        if not self._heard or not self._heard[-1].has(flight, of):
            self._heard.append(_Heard(flight, of, [known for known in self.state.on_air if known.turn_ns < 0]))
        return self._heard[-1]


def _power_cdbm(known: Transmission, at: str, of: Propagation) -> int:
    """Return the power of a transmission at an endpoint."""
    path = of.path(of.place_at(known.source, known.position), of.place(at))
    return NOTHING_CDBM if path.cause else known.power_cdbm + of.gain_cdb - path.loss_cdb


def _spoil(flight: Flight, known: Transmission, of: Propagation) -> None:
    """Add an overlapping transmission to a packet's interference."""
    if known.source == flight.destination:
        flight.interference = DEAF
        return
    power_cdbm = _power_cdbm(known, flight.destination, of)
    if power_cdbm <= of.noise_cdbm - NEGLIGIBLE_CDB:
        return
    if flight.interference < DEAF:
        flight.interference = min(DEAF - 1, flight.interference + units_of(power_cdbm))
    if of.settings.medium == "lora":
        powers = list(flight.by_factor or (0,) * len(LORA_FACTORS))
        place = known.spreading_factor - LORA_FACTORS[0]
        powers[place] = min(DEAF - 1, powers[place] + units_of(power_cdbm))
        flight.by_factor = tuple(powers)
