"""What a network means, in lines: of `foosim-net lint` without a terminal, and of the start of a run.

Pure: neighbours are `lint` (the figures), `supervisor.net_text` (tables), `main`, which logs them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

from foosim.common.format import range_text, rate_text, time_text
from foosim.vhub.links.summary import MANY, SPACING_NS, Carried, Meaning

LINES_MAX: Final = 12
"""Lines of the effective model at the start of a run."""


def loss_text(meaning: Meaning) -> str:
    """Return the mean loss."""
    if meaning.loss == 0:
        return "0"
    return f"{100 * meaning.loss:.3g} %"


def burst_text(meaning: Meaning) -> str:
    """Return the mean length of bursts, in time or in packets."""
    if meaning.burst_ns is not None:
        return time_text(meaning.burst_ns)
    return "-" if meaning.burst_packets is None else f"{meaning.burst_packets:.3g} packets"


def delay_text(meaning: Meaning) -> str:
    """Return the delay beside the medium."""
    if meaning.delay_sd_ns == 0:
        return time_text(meaning.delay_mean_ns)
    times = (time_text(ns) for ns in (meaning.delay_mean_ns, meaning.delay_sd_ns, meaning.delay_p99_ns))
    return "{}, sd {}, p99 {}".format(*times)


def _goodput_text(carried: Carried) -> str:
    one = rate_text(carried.goodput_bps)
    return one if carried.shared_bps is None else f"{one}, {MANY} stations {rate_text(carried.shared_bps)}"


def meaning_line(meaning: Meaning) -> str:
    """Return what settings mean in one line."""
    parts = [meaning.medium if meaning.medium != "none" else "no medium"]
    if meaning.links is not None:
        example = "" if meaning.example is None else f" (as {meaning.example[0]} to {meaning.example[1]})"
        parts.append(f"{meaning.used} of {meaning.links} links carry declared packets{example}")
    parts.append(f"loss {loss_text(meaning)}")
    if burst_text(meaning) != "-":
        parts.append(f"bursts of {burst_text(meaning)}")
    parts.append(f"delay {delay_text(meaning)}")
    if meaning.reordered is not None:
        parts.append(f"{100 * meaning.reordered:.3g} % overtaken at {1_000_000_000 // SPACING_NS} packets/s")
    if meaning.rate_bps:
        parts.append(f"at {rate_text(meaning.rate_bps)}")
    for carried in meaning.carried:
        parts.append(f"{carried.size} B: {time_text(carried.airtime_ns)}, {_goodput_text(carried)}")
    if meaning.range_los_m is not None:
        walls = "as they allow" if meaning.range_nlos_m is None else range_text(meaning.range_nlos_m)
        parts.append(f"range {range_text(meaning.range_los_m)} in sight, behind walls {walls}")
    if meaning.duty_packets_h is not None:
        parts.append(f"{meaning.duty_packets_h} packets of {meaning.carried[0].size} B an hour")
    if meaning.queue_ns is not None:
        parts.append(f"queue of {time_text(meaning.queue_ns)}")
    return f"{meaning.name}: {', '.join(parts)}"


def meaning_lines(meanings: Sequence[Meaning]) -> Iterator[str]:
    """Yield a line for each, and its warnings behind it."""
    for meaning in meanings:
        yield meaning_line(meaning)
        yield from (f"  warning: {meaning.name}: {warning}" for warning in meaning.warnings)


def start_lines(meanings: Sequence[Meaning], file: str) -> list[str]:
    """Return the effective model for the start of a run: what links use, at most LINES_MAX lines."""
    lines = [f"network {line.strip()}" for line in meaning_lines(meanings)]
    if len(lines) <= LINES_MAX:
        return lines
    return [*lines[: LINES_MAX - 1], f"and {len(lines) - LINES_MAX + 1} more: foosim-net lint {file}"]
