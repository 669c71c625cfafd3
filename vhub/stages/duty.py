"""Duty cycle: the share of time that a radio may send, by regulation, over a sliding window.

In no window of the given length, wherever it begins, is the radio on air for more than its share; of what is on air at
the window's edge the part within counts. Source: ETSI EN 300 220-1, where the duty cycle is the time on air in an
observation interval over that interval's length, one hour by default (recalled, unverified).
It is for media on which a packet is sent once, for a time that is known before: LoRa, and a radio with a rate.
"""

from __future__ import annotations

from typing import Final

from foosim.vhub.network.link_context import LinkSetup
from foosim.vhub.network.memory import RadioState, Sending
from foosim.vhub.network.mtu import frames_of
from foosim.vhub.network.packet import Flight
from foosim.vhub.radio.airtime import lora_airtime_ns, serialisation_ns
from foosim.vhub.stages.explanation import Explanation, Seen
from foosim.vhub.stages.stage import Stage

DUTY_CYCLE: Final = "duty_cycle"
RUNS_MAX: Final = 1_024
"""Number of transmissions that are remembered singly; of more, neighbours are merged."""
GRAINS: Final = 256
"""A merged transmission is at most this part of a window long: it leaves the window at most so much later."""


def allowed_ns(share: float, window_ns: int) -> int:
    """Return the airtime that is left in a window."""
    return int(share * window_ns)


def packets_an_hour(share: float, window_ns: int, airtime_ns: int) -> int:
    """Return the packets per hour that a radio can sustain: as many whole ones as fit into each window."""
    return allowed_ns(share, window_ns) // airtime_ns * 3_600_000_000_000 // window_ns


class Duty(Stage):
    """Drops a packet that exceeds the airtime of the window that ends with it; the medium adds transmissions.

    Transmissions of a radio come one after the other, so no window has more on air than the one that ends with one.
    """

    def __init__(self, setup: LinkSetup) -> None:
        self._settings, self._shared, self._sender = setup.settings, setup.shared, setup.sender
        self._window_ns = setup.settings.duty_window_ns
        self._allowed_ns = allowed_ns(setup.settings.duty_cycle, self._window_ns)
        self._broadcasts = setup.settings.sends_once

    @classmethod
    def for_link(cls, setup: LinkSetup) -> Duty | None:
        return cls(setup) if setup.is_radio and setup.settings.duty_cycle < 1.0 else None

    def at_sending(self, flight: Flight) -> str:
        sender = self._sender
        broadcast = self._broadcasts and flight.published
        if broadcast:
            shared = sender.sending(flight.sequence, flight.copy)
            if shared is not None:
                flight.decided_by = shared.decided_by
                return DUTY_CYCLE if shared.cause == DUTY_CYCLE else ""
        _forget(sender, flight.sent_ns - self._window_ns)
        airtime_ns = self.airtime_ns(flight.size, flight.published)
        end_ns = max(flight.sent_ns + flight.phase_ns, sender.free_ns) + airtime_ns
        left_ns = max(0, self._allowed_ns - _sent_since(sender, end_ns - self._window_ns))
        if airtime_ns > left_ns:
            flight.decided_by = (left_ns,)
            if broadcast:
                sender.last = Sending(flight.sequence, flight.copy, DUTY_CYCLE, decided_by=flight.decided_by)
            return DUTY_CYCLE
        return ""

    def explain(self, seen: Seen, note: Explanation) -> None:
        row, share = seen.row, self._settings.duty_cycle
        note.add("{} of any {window_ns} on air", f"{100 * share:g} %", window_ns=self._window_ns, duty_cycle=share)
        note.add(", the packet takes {airtime_ns}", airtime_ns=self.airtime_ns(row.size, row.published))
        if row.cause == DUTY_CYCLE:
            note.add(", {left_ns} is left of the one that ends with it", left_ns=row.decided_by.duty_left_ns)

    def airtime_ns(self, size: int, published: bool) -> int:
        """Return the airtime of a packet of `size` bytes."""
        settings = self._shared if self._broadcasts and published else self._settings
        sizes = frames_of(size, settings.payload_max)
        if settings.medium == "lora":
            what = int(settings.bandwidth_hz), settings.coding_rate
            return sum([lora_airtime_ns(settings.spreading_factor, size, *what) for size in sizes])
        rate_bps = settings.rate_bps
        if rate_bps is None:
            return 0
        return sum([serialisation_ns(size + settings.overhead_bytes, rate_bps) for size in sizes])


def note_sent(sender: RadioState, start_ns: int, end_ns: int, window_ns: int) -> None:
    """Append a transmission of a radio."""
    runs = sender.sent
    runs.append((start_ns, end_ns, end_ns - start_ns))
    sender.sent_ns += end_ns - start_ns
    if len(runs) < RUNS_MAX or len(runs) % (RUNS_MAX // 2):
        return
    together: list[tuple[int, int, int]] = []
    for run in runs:
        if together and run[1] - together[-1][0] <= window_ns // GRAINS:
            start_ns, _, airtime_ns = together[-1]
            together[-1] = start_ns, run[1], airtime_ns + run[2]
        else:
            together.append(run)
    runs[:] = together


def _forget(sender: RadioState, before_ns: int) -> None:
    """Drop transmissions that ended before a time."""
    runs, over = sender.sent, 0
    while over < len(runs) and runs[over][1] <= before_ns:
        sender.sent_ns -= runs[over][2]
        over += 1
    del runs[:over]


def _sent_since(sender: RadioState, since_ns: int) -> int:
    """Return the airtime since a time; for merged transmissions the greatest possible."""
    found_ns = sender.sent_ns
    for start_ns, end_ns, airtime_ns in sender.sent:
        if start_ns >= since_ns:
            break
        found_ns -= airtime_ns - min(airtime_ns, max(0, end_ns - since_ns))
    return found_ns
