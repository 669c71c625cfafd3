"""The medium: access time, airtime and outcome of a transmission, by kind of medium.

A wire serialises. On Wi-Fi a station freezes its backoff while stations that it hears send, contends with them, and
repeats unacknowledged frames: others appear as delay to unicasts, and as loss to broadcasts, which are sent once.
IEEE 802.15.4 looks before it sends. LoRa sends at once. Frames that are out of range are on air all the same.

A packet longer than the mtu is sent in frames. Where frames are acknowledged and stations contend, each has a turn and
retries of its own, and the packet ends with the first frame that is given up. Elsewhere its frames follow one another
in one turn, and it is lost with any of them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import groupby
from typing import Final

from foosim.common.keyed_random import UNIT, Slot, chance_threshold, draw_words
from foosim.deployment.network.radios import Radio
from foosim.vhub.network.air import Air
from foosim.vhub.network.link_budget import Budget
from foosim.vhub.network.link_context import BLOCK_SHIFT, LinkSetup
from foosim.vhub.network.memory import RadioState, Sending, Transmission
from foosim.vhub.network.mtu import frame_count, frames_of
from foosim.vhub.network.packet import Flight
from foosim.vhub.network.turns import Contest
from foosim.vhub.radio import errors
from foosim.vhub.radio.airtime import (
    LRWPAN_OVERHEAD_BYTES,
    WIFI_OVERHEAD_BYTES,
    lora_airtime_ns,
    lrwpan_airtime_ns,
    serialisation_ns,
)
from foosim.vhub.radio.contention import Access, Outcome, Words, csma_access, sensing, wifi_access, wifi_contention
from foosim.vhub.radio.frames import WifiFrames
from foosim.vhub.radio.propagation import BLOCKED, OUT_OF_RANGE
from foosim.vhub.radio.timings import (
    CATEGORIES,
    DOT11P,
    DOT11P_CATEGORIES,
    LRWPAN,
    WIFI_2_4,
    WIFI_5,
    WifiTiming,
    with_category,
)
from foosim.vhub.stages.duty import note_sent
from foosim.vhub.stages.explanation import Explanation, Seen
from foosim.vhub.stages.stage import Stage

COLLISION: Final = "collision"
SNR: Final = "snr"
LRWPAN_MODE: Final = "oqpsk_250"
ACCESS_BLOCK: Final = 16
"""The first block of a packet's draws for its attempts."""
FRAME_BLOCKS: Final = 1 << 20
"""From the blocks of one frame to those of the next of a packet."""
BASE_STATION_DBM: Final = 30.0
"""A sender with at least this power over LTE is a base station: its packets are downlinks."""
OPPORTUNITY_BYTES: Final = 1500
"""Bytes that one line of a capacity trace lets through."""


class Wire(Stage):
    """Serialises at a rate, or at the opportunities of a trace."""

    def __init__(self, setup: LinkSetup) -> None:
        settings = setup.settings
        self._sender: RadioState = setup.sender
        self._rate_bps, self._overhead, self._mtu = settings.rate_bps, settings.overhead_bytes, settings.payload_max
        self._trace, self._loops = setup.opportunities_ms, settings.trace is not None and settings.trace.loop

    def at_sending(self, flight: Flight) -> str:
        sender = self._sender
        start_ns = max(flight.sent_ns, sender.free_ns)
        size = flight.size + self._overhead * frame_count(flight.size, self._mtu)
        if self._trace:
            end_ns = self._opportunity_ns(start_ns, size)
        else:
            assert self._rate_bps is not None
            end_ns = start_ns + serialisation_ns(size, self._rate_bps)
            flight.rate_bps = self._rate_bps
        flight.airtime_ns = end_ns - start_ns
        sender.free_ns = end_ns
        sender.waiting.append((end_ns, size))
        return ""

    def explain(self, seen: Seen, note: Explanation) -> None:
        _explain_airtime(seen, note, "wire")

    def _opportunity_ns(self, ready_ns: int, size: int) -> int:
        """Return when the last byte leaves; the next packet uses the rest of the opportunity."""
        sender, _trace = self._sender, self._trace
        left = sender.opportunity_bytes
        at_ns = max(ready_ns, self._time_ns(sender.opportunity - 1) if left else 0)
        if left and self._time_ns(sender.opportunity - 1) < ready_ns:
            left = 0
        while left < size:
            size -= left
            while self._time_ns(sender.opportunity) < ready_ns:
                sender.opportunity += self._skip(ready_ns)
            at_ns = self._time_ns(sender.opportunity)
            sender.opportunity += 1
            left = OPPORTUNITY_BYTES
        sender.opportunity_bytes = left - size
        return at_ns

    def _skip(self, ready_ns: int) -> int:
        """Return how many opportunities are skipped at once: whole rounds of the trace, or one."""
        rounds = (ready_ns - self._time_ns(self._sender.opportunity)) // (self._trace[-1] * 1_000_000)
        return max(1, rounds * len(self._trace)) if self._loops and rounds > 1 else 1

    def _time_ns(self, number: int) -> int:
        rounds, place = divmod(number, len(self._trace))
        if rounds and not self._loops:
            return 2**62
        return (rounds * self._trace[-1] + self._trace[place]) * 1_000_000


class OnAir(Stage):
    """Common part of radios: a broadcast is sent once for all receivers; the air has the transmissions."""

    def __init__(self, setup: LinkSetup) -> None:
        assert setup.budget is not None and setup.air is not None
        self._setup, self._settings, self._shared = setup, setup.settings, setup.shared
        self._sender: RadioState = setup.sender
        self._budget: Budget = setup.budget
        self._air: Air = setup.air
        self._once, self._factor = setup.settings.sends_once, setup.settings.spreading_factor
        self._window_ns = setup.settings.duty_window_ns if setup.settings.duty_cycle < 1.0 else 0

    def at_sending(self, flight: Flight) -> str:
        cause = self._budget.measure(flight)
        if flight.published and self._once:
            shared = self._sender.sending(flight.sequence, flight.copy)
            assert shared is not None, "the queue remembers what it lets through"
            if not shared.is_ready:
                self._transmit(flight, True, cause)
                self._note(flight, shared)
            else:
                self._share(flight, shared)
        else:
            self._transmit(flight, False, cause)
        if cause:
            flight.outcome = cause
        return COLLISION if flight.outcome == COLLISION else ""

    def explain(self, seen: Seen, note: Explanation) -> None:
        row = seen.row
        others = "no other station" if row.contenders <= 1 else f"{row.contenders} stations contend"
        note.add("{how}: {}", others, how="broadcast, once" if seen.is_broadcast else "unicast")
        note.add(", access {access_ns}, {retries} retries, ", access_ns=row.access_ns, retries=row.retries)
        note.facts["contenders"] = row.contenders
        _explain_airtime(seen, note, "air")
        sizes = frames_of(row.size, (self._shared if seen.is_broadcast else self._settings).payload_max)
        note.facts["frames"] = len(sizes)
        if len(sizes) > 1:
            lost = row.decided_by.frame
            note.text += f", all attempts of {len(sizes)} frames" + (
                f", of which number {lost} was lost" if lost else ""
            )
            note.facts["lost_frame"] = lost
            return
        odds = self.odds(max(1, row.contenders), row.size, seen.is_broadcast)
        if odds is None:
            return
        chance = odds[0] / UNIT
        note.facts |= {"collision_chance": chance, "attempts": (attempts := [*self._attempts(seen, *odds)])}
        runs = [(what, len([*equal])) for what, equal in groupby(attempts)]
        note.text += "; " + ", ".join(what if count == 1 else f"{count} x {what}" for what, count in runs)
        note.text += f" (an attempt collides with {chance:g})" if chance else ""

    def _attempts(self, seen: Seen, threshold: int, access_threshold: int) -> Iterator[str]:
        """Yield the result of each attempt of a captured packet: an attempt has four of eight words of a block."""
        row, words = seen.row, self._words(seen.flight, seen.is_broadcast)
        is_lost = row.decided_by.collision == "contention" or row.cause in (SNR, OUT_OF_RANGE, BLOCKED)
        for attempt in range(row.retries + 1):
            block, at = words(attempt >> 1), (attempt & 1) << 2
            if block[at + 3] < access_threshold:
                yield "the channel was never free"
            elif block[at + 1] < threshold:
                yield "collision"
            else:
                yield "error" if attempt < row.retries or (is_lost and not seen.is_broadcast) else "got across"

    def odds(self, contenders: int, size: int, broadcast: bool) -> tuple[int, int] | None:
        """Return below which words an attempt collides, and finds no free channel; None without contention."""
        return None

    def _note(self, flight: Flight, shared: Sending) -> None:
        """Store the result of a broadcast's first receiver for the others."""
        shared.access_ns, shared.airtime_ns = flight.access_ns, flight.airtime_ns
        shared.start_ns, shared.end_ns = flight.air_start_ns, flight.air_end_ns
        shared.contenders, shared.rate_bps, shared.outcome = flight.contenders, flight.rate_bps, flight.outcome
        shared.is_ready = True

    def _share(self, flight: Flight, shared: Sending) -> None:
        """Copy a broadcast's times from its first receiver."""
        flight.access_ns, flight.airtime_ns = shared.access_ns, shared.airtime_ns
        flight.air_start_ns, flight.air_end_ns = shared.start_ns, shared.end_ns
        flight.contenders, flight.rate_bps, flight.outcome = shared.contenders, shared.rate_bps, shared.outcome

    def _transmit(self, flight: Flight, broadcast: bool, cause: str) -> None:
        settings = self._shared if broadcast else self._settings
        sender, lost = self._sender, UNIT if cause else None
        self._air.advance(flight.sent_ns)
        ready_ns = flight.sent_ns + flight.phase_ns
        ready_ns = max(ready_ns, sender.free_ns)
        sizes = frames_of(flight.size, settings.payload_max)
        if len(sizes) == 1 or broadcast or not self.takes_turns:
            self._take_turn(flight, broadcast, ready_ns, sizes, lost)
        else:
            self._take_turns(flight, ready_ns, sizes, lost)
        sender.waiting.append((sender.free_ns, flight.size + settings.overhead_bytes * len(sizes)))

    def _take_turns(self, flight: Flight, ready_ns: int, sizes: Sequence[int], lost: int | None) -> None:
        """Send frames one after the other, each in a turn of its own, until one of them is given up."""
        airtime_ns = retries = contenders = begun_ns = 0
        for number, size in enumerate(sizes):
            flight.frames = number + 1
            self._take_turn(flight, False, self._sender.free_ns if number else ready_ns, (size,), lost)
            begun_ns = begun_ns or flight.air_start_ns
            airtime_ns, retries = airtime_ns + flight.airtime_ns, retries + flight.retries
            contenders = max(contenders, flight.contenders)
            if flight.outcome:
                flight.decided_by = (number + 1,)
                break
        flight.airtime_ns, flight.retries, flight.contenders = airtime_ns, retries, contenders
        flight.air_start_ns = begun_ns
        flight.access_ns = flight.air_end_ns - ready_ns - airtime_ns

    def _take_turn(
        self, flight: Flight, broadcast: bool, ready_ns: int, sizes: Sequence[int], lost: int | None
    ) -> None:
        """Send frames in one turn of a sender that is ready."""
        sender, air, source = self._sender, self._air, flight.source
        start_ns, flight.contenders = self.turn(ready_ns)
        access, air_ns = self.access(flight, broadcast, sizes, lost)
        delay_ns, outcome = access.delay_ns, access.outcome
        start_ns = self.after_backoff(start_ns, access)
        end_ns, until_ns = start_ns + delay_ns, start_ns + access.occupancy_ns
        flight.airtime_ns = airtime_ns = air_ns if air_ns < delay_ns else delay_ns  # never on air before its turn
        flight.air_start_ns, flight.air_end_ns = end_ns - airtime_ns, end_ns
        flight.access_ns = end_ns - ready_ns - airtime_ns
        flight.retries = access.retries
        if outcome == "ok":
            flight.is_settled = self.is_acknowledged and not broadcast
        else:
            flight.outcome = COLLISION if outcome in ("collision", "busy") else SNR
        sender.free_ns = until_ns
        if self._window_ns:
            note_sent(sender, end_ns - airtime_ns, end_ns, self._window_ns)
        of = self._budget.propagation
        what = source, flight.sequence, flight.copy, end_ns - airtime_ns, end_ns, until_ns
        known = Transmission(*what, of.place(source).at, of.power_cdbm, self._factor)
        known.frame = max(0, flight.frames - 1)
        if start_ns > flight.sent_ns:
            self.expect(known, ready_ns, start_ns)
        air.register(known)

    # --- by kind of medium -------------------------------------------------------------------------------------------

    is_acknowledged = False
    takes_turns = False
    """Whether stations contend for each acknowledged frame."""

    def after_backoff(self, start_ns: int, access: Access) -> int:
        """Return when the sender's turn begins, given the time at which it would begin without back-off."""
        return start_ns

    def expect(self, known: Transmission, ready_ns: int, turn_ns: int) -> None:
        """Record what a later transmission needs to defer a turn that is still to begin."""

    def turn(self, ready_ns: int) -> tuple[int, int]:
        """Return when the sender's turn begins, and the number of contenders, itself included."""
        return ready_ns, 1

    def access(self, flight: Flight, broadcast: bool, sizes: Sequence[int], lost: int | None) -> tuple[Access, int]:
        """Return the outcome of frames on the medium and the airtime of an attempt of each; set the bit rate.

        `lost` is the threshold for errors of a packet that cannot get through; None where the signal decides.
        """
        settings = self._shared if broadcast else self._settings
        rate_bps = flight.rate_bps = settings.rate_bps or 0
        airtime_ns = (
            sum([serialisation_ns(size + settings.overhead_bytes, rate_bps) for size in sizes]) if rate_bps else 0
        )
        return Access(airtime_ns, airtime_ns, 0, airtime_ns, "ok"), airtime_ns

    def _words(self, flight: Flight, broadcast: bool, frame: int = 0) -> Words:
        """Return the draws of a frame's attempts, by block: those of a broadcast are the same for all receivers."""
        draws = self._setup.sending if broadcast else self._setup.draws
        key, number, copy = draws.of(flight.channel), flight.draw, flight.copy
        first = ACCESS_BLOCK + frame * FRAME_BLOCKS
        return lambda block: draw_words(key, number, copy | (first + block) << BLOCK_SHIFT)


def _explain_airtime(seen: Seen, note: Explanation, where: str) -> None:
    row = seen.row
    note.add("{airtime_ns} on the {}", where, airtime_ns=row.airtime_ns)
    note.add(" at {rate_bps}" if row.rate_bps else "", rate_bps=row.rate_bps)


def wifi_modes(settings: Radio) -> tuple[str, ...]:
    """Return the modulations of a Wi-Fi radio, in order of rising rate."""
    if settings.standard == "802.11n":
        return errors.DOT11N_MODES
    return errors.DOT11P_MODES if settings.bandwidth_hz < 15e6 else errors.WIFI_MODES


@lru_cache(maxsize=64)
def _wifi_timing(bandwidth_hz: float, frequency_hz: float, access: str, retries: int) -> WifiTiming:
    if bandwidth_hz < 15e6:
        timing = with_category(DOT11P, DOT11P_CATEGORIES[access])
    else:
        timing = with_category(WIFI_2_4 if frequency_hz < 3e9 else WIFI_5, CATEGORIES[access])
    return replace(timing, retries=retries)


def wifi_timing(settings: Radio) -> WifiTiming:
    """Return the timing of a Wi-Fi radio and its access category."""
    return _wifi_timing(settings.bandwidth_hz, settings.frequency_hz, settings.access, settings.retries)


@lru_cache(maxsize=256)
def mode_of(modes: tuple[str, ...], rate_bps: int) -> str:
    """Return the modulation whose rate is the nearest."""
    return min(modes, key=lambda mode: (abs(errors.MODES[mode].rate_bps - rate_bps), mode))


Curve = Callable[[Flight, int], int]
"""Gives the packet error rate of a packet at a ratio (0.01 dB), in units of 2^-64."""


def error_curve(settings: Radio) -> Curve | None:
    """Return the curve of a radio's errors; None on media without errors."""
    mtu = settings.payload_max
    if settings.medium in ("wifi", "ieee802154"):
        is_wifi = settings.medium == "wifi"
        overhead = WIFI_OVERHEAD_BYTES if is_wifi else LRWPAN_OVERHEAD_BYTES
        modes = {errors.MODES[mode].rate_bps: mode for mode in (wifi_modes(settings) if is_wifi else (LRWPAN_MODE,))}
        return lambda flight, snr_cdb: any_threshold(
            lambda size: errors.per_threshold(modes[flight.rate_bps], snr_cdb, size + overhead),
            frames_of(flight.size, mtu),
        )
    if settings.medium == "lte":
        return lambda flight, snr_cdb: UNIT if snr_cdb < errors.LTE_FLOOR_CENTI_DB else 0
    return None


def any_threshold(of_frame: Callable[[int], int], sizes: Sequence[int]) -> int:
    """Return the probability that any of some frames is lost, of which all but the last have one size (2^-64)."""
    last = of_frame(sizes[-1])
    if len(sizes) == 1:
        return last
    received, each = 1.0 - last / UNIT, 1.0 - of_frame(sizes[0]) / UNIT
    for _ in sizes[1:]:
        received *= each
    return chance_threshold(1.0 - received)


def in_a_row(accesses: Sequence[Access]) -> Access:
    """Return the access of frames in a row, of which each is received before the next is sent."""
    if len(accesses) == 1:
        return accesses[0]
    outcome = next((one.outcome for one in accesses if one.outcome != "ok"), accesses[0].outcome)
    occupancy_ns = sum([one.occupancy_ns for one in accesses])
    return Access(
        occupancy_ns - accesses[-1].occupancy_ns + accesses[-1].delay_ns,
        occupancy_ns,
        sum([one.retries for one in accesses]),
        sum([one.airtime_ns for one in accesses]),
        outcome,
        sum([one.backoff_ns for one in accesses]),
    )


@lru_cache(maxsize=64)
def _wifi_frames(modes: tuple[str, ...], timing: WifiTiming, fixed: str | None) -> WifiFrames:
    """Links of one kind of radio share what is known of its frames."""
    return WifiFrames(modes, timing, fixed)


class Contending(OnAir):
    """Common part of media whose stations contend for each acknowledged frame."""

    is_acknowledged = True
    takes_turns = True

    def access(self, flight: Flight, broadcast: bool, sizes: Sequence[int], lost: int | None) -> tuple[Access, int]:
        if len(sizes) == 1:
            return self._access(flight, broadcast, sizes[0], max(0, flight.frames - 1), lost)
        found = [self._access(flight, broadcast, size, frame, lost) for frame, size in enumerate(sizes)]
        return in_a_row([access for access, _ in found]), sum([airtime_ns for _, airtime_ns in found])

    def _access(self, flight: Flight, broadcast: bool, size: int, number: int, lost: int | None) -> tuple[Access, int]:
        """Return access and airtime of one frame of a packet."""
        return super().access(flight, broadcast, (size,), lost)


class WiFi(Contending):
    """IEEE 802.11 with the distributed coordination function and rate control."""

    def __init__(self, setup: LinkSetup) -> None:
        super().__init__(setup)
        self._contest: Contest | None = None
        modes, self._timing = wifi_modes(setup.settings), wifi_timing(setup.settings)
        fixed = mode_of(modes, setup.settings.fixed_rate_bps) if setup.settings.rates == "fixed" else None
        self._frames = _wifi_frames(modes, self._timing, fixed)

    def turn(self, ready_ns: int) -> tuple[int, int]:
        contest = self._contest = self._air.contest(self._setup.source, ready_ns, self._budget.propagation)
        return ready_ns, contest.contenders

    def after_backoff(self, start_ns: int, access: Access) -> int:
        contest, slot_ns = self._contest, self._timing.slot_ns
        assert contest is not None, "who becomes ready meets others first"
        turn_ns = contest.turn_ns(access.backoff_ns, slot_ns)
        self._air.take_turn(contest, turn_ns, access.occupancy_ns, slot_ns)
        return turn_ns

    def expect(self, known: Transmission, ready_ns: int, turn_ns: int) -> None:
        assert self._contest is not None
        known.ready_ns, known.turn_ns = ready_ns, turn_ns
        known.radio, known.hears = self._setup.radio, self._contest.hears

    def _access(self, flight: Flight, broadcast: bool, size: int, number: int, lost: int | None) -> tuple[Access, int]:
        """The fixed rate if set; else the lowest for a broadcast, the highest with few errors for a unicast."""
        ack_ns, threshold = 0, 0
        if broadcast:
            frame = self._frames.broadcast(size)
        else:
            frame = self._frames.unicast(size, flight.snr_cdb)
            ack_ns = frame.ack_ns
            threshold = errors.per_threshold(frame.mode, flight.snr_cdb, frame.size_bytes) if lost is None else lost
            if lost is None:
                flight.error_threshold = threshold
        flight.rate_bps = frame.rate_bps
        words, airtime_ns = self._words(flight, broadcast, number), frame.airtime_ns
        return wifi_access(words, flight.contenders, threshold, airtime_ns, ack_ns, self._timing), airtime_ns

    def odds(self, contenders: int, size: int, broadcast: bool) -> tuple[int, int]:
        return wifi_contention(contenders, self._timing, unicast=not broadcast).threshold, 0


class LrWpan(Contending):
    """IEEE 802.15.4 at 2.4 GHz without beacons."""

    def __init__(self, setup: LinkSetup) -> None:
        super().__init__(setup)
        self._timing = replace(LRWPAN, retries=setup.settings.retries)

    def turn(self, ready_ns: int) -> tuple[int, int]:
        return self._air.turn(self._setup.source, ready_ns, self._budget.propagation)

    def _access(self, flight: Flight, broadcast: bool, size: int, number: int, lost: int | None) -> tuple[Access, int]:
        flight.rate_bps = errors.MODES[LRWPAN_MODE].rate_bps
        airtime_ns = lrwpan_airtime_ns(size, self._timing)
        threshold = 0 if broadcast else lost
        if threshold is None:
            threshold = errors.per_threshold(LRWPAN_MODE, flight.snr_cdb, size + LRWPAN_OVERHEAD_BYTES)
            flight.error_threshold = threshold
        words = self._words(flight, broadcast, number)
        return csma_access(words, flight.contenders, threshold, airtime_ns, not broadcast, self._timing), airtime_ns

    def odds(self, contenders: int, size: int, broadcast: bool) -> tuple[int, int]:
        point = sensing(contenders, lrwpan_airtime_ns(size, self._timing), not broadcast, self._timing)
        return point.threshold, point.access_threshold


class LoRa(OnAir):
    """LoRa: pure ALOHA."""

    def access(self, flight: Flight, broadcast: bool, sizes: Sequence[int], lost: int | None) -> tuple[Access, int]:
        settings = self._settings
        chips = settings.spreading_factor * 4 * int(settings.bandwidth_hz)
        flight.rate_bps = chips // ((4 + settings.coding_rate) << settings.spreading_factor)
        what = int(settings.bandwidth_hz), settings.coding_rate
        airtime_ns = sum([lora_airtime_ns(settings.spreading_factor, size, *what) for size in sizes])
        return Access(airtime_ns, airtime_ns, 0, airtime_ns, "ok"), airtime_ns


class Lte(OnAir):
    """A link to or from a base station: a rate by the signal, repetitions that cost time."""

    is_acknowledged = True

    def access(self, flight: Flight, broadcast: bool, sizes: Sequence[int], lost: int | None) -> tuple[Access, int]:
        """Frames are repeated beside one another: the last one is there when the latest of them is."""
        settings = self._settings
        direction = "down" if settings.tx_power_dbm >= BASE_STATION_DBM else "up"
        rate_bps = flight.rate_bps = errors.lte_rate_bps(flight.snr_cdb, int(settings.bandwidth_hz), direction)
        if rate_bps == 0:
            return Access(0, 0, 0, 0, "error"), 0
        airtime_ns = delay_ns = all_retries = 0
        outcome: Outcome = "ok" if lost is None else "error"
        for frame, size in enumerate(sizes):
            airtime_ns += serialisation_ns(size + settings.overhead_bytes, rate_bps)
            word = self._words(flight, False, frame)(0)[0] if frame else flight.words[Slot.BACKOFF]
            retries, is_lost = errors.lte_harq(word)
            delay_ns = max(delay_ns, airtime_ns + retries * errors.HARQ_ROUND_NS)
            all_retries += retries
            if is_lost:
                outcome = "error"
        return Access(delay_ns, airtime_ns, all_retries, airtime_ns, outcome), airtime_ns


_MEDIA: Final = {"radio": OnAir, "wifi": WiFi, "ieee802154": LrWpan, "lora": LoRa, "lte": Lte}


def make_medium(setup: LinkSetup) -> Wire | OnAir | None:
    """Return the stage of a link's medium; None where sending takes no time."""
    settings = setup.settings
    if setup.settings.is_on_air:
        return _MEDIA[settings.medium](setup)
    return Wire(setup) if settings.rate_bps is not None or setup.opportunities_ms else None
