"""Payloads as Wi-Fi frames: the modulation that rate control takes, and how long frame and acknowledgement last.

All of it is looked up by the payload's size, in bytes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from foosim.vhub.radio.airtime import WIFI_OVERHEAD_BYTES, wifi_ack_ns, wifi_airtime_ns
from foosim.vhub.radio.errors import MODES, snr_needed
from foosim.vhub.radio.timings import WifiTiming

SIZES_KEPT: Final = 4_096


@dataclass(frozen=True)
class WifiFrame:
    """A payload in one modulation. `size_bytes` is with headers; `ack_ns` is the duration of the acknowledgement."""

    mode: str
    rate_bps: int
    size_bytes: int
    airtime_ns: int
    ack_ns: int


class WifiFrames:
    """The frames of one kind of radio: `modes` in order of rising rate, or always the `fixed` one."""

    def __init__(self, modes: tuple[str, ...], timing: WifiTiming, fixed: str | None = None) -> None:
        self._modes = modes if fixed is None else (fixed,)
        self._timing = timing
        self._ladders: dict[int, tuple[tuple[int, WifiFrame], ...]] = {}

    def broadcast(self, size: int) -> WifiFrame:
        """Return a payload's frame that is sent once for all who hear: at the lowest rate."""
        return self._ladder(size)[-1][1]

    def unicast(self, size: int, snr_cdb: int) -> WifiFrame:
        """Return a payload's frame at the highest rate with at most 10 % errors; the lowest when there is none."""
        ladder = self._ladder(size)
        for needed_cdb, frame in ladder:
            if snr_cdb >= needed_cdb:
                return frame
        return ladder[-1][1]

    def _ladder(self, size: int) -> tuple[tuple[int, WifiFrame], ...]:
        """Return the frames of a size, the fastest first, with the ratio (0.01 dB) from which on each is good."""
        found = self._ladders.get(size)
        if found is None:
            if len(self._ladders) >= SIZES_KEPT:
                self._ladders.clear()
            found = self._ladders[size] = tuple(self._step(mode, size) for mode in reversed(self._modes))
        return found

    def _step(self, mode: str, size: int) -> tuple[int, WifiFrame]:
        whole, timing = size + WIFI_OVERHEAD_BYTES, self._timing
        airtime_ns, ack_ns = wifi_airtime_ns(mode, size, timing), wifi_ack_ns(mode, timing)
        return snr_needed(mode, whole), WifiFrame(mode, MODES[mode].rate_bps, whole, airtime_ns, ack_ns)
