"""The summary of a network as lines of text: for `foosim net lint` without a terminal, and the start of a run.

Pure. Neighbours: `summary` (the figures), `main`, which logs them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

from foosim.common.format import range_text, rate_text, time_text
from foosim.vhub.links.summary import MANY, SPACING_NS, LinkSummary

LINES_MAX: Final = 12
"""Lines of the effective model at the start of a run."""


def loss_text(summary: LinkSummary) -> str:
    """Return the mean loss."""
    if summary.loss == 0:
        return "0"
    return f"{100 * summary.loss:.3g} %"


def burst_text(summary: LinkSummary) -> str:
    """Return the mean length of bursts, in time or in packets."""
    if summary.burst_ns is not None:
        return time_text(summary.burst_ns)
    return "-" if summary.burst_packets is None else f"{summary.burst_packets:.3g} packets"


def delay_text(summary: LinkSummary) -> str:
    """Return the delay without the medium."""
    if summary.delay_sd_ns == 0:
        return time_text(summary.delay_mean_ns)
    times = (time_text(ns) for ns in (summary.delay_mean_ns, summary.delay_sd_ns, summary.delay_p99_ns))
    return "{}, sd {}, p99 {}".format(*times)


def summary_line(summary: LinkSummary) -> str:
    """Return the summary of settings in one line."""
    parts = [summary.medium if summary.medium != "none" else "no medium"]
    if summary.links is not None:
        example = "" if summary.example is None else f" (as {summary.example[0]} to {summary.example[1]})"
        parts.append(f"{summary.used} of {summary.links} links carry declared packets{example}")
    parts.append(f"loss {loss_text(summary)}")
    if burst_text(summary) != "-":
        parts.append(f"bursts of {burst_text(summary)}")
    parts.append(f"delay {delay_text(summary)}")
    if summary.reordered is not None:
        parts.append(f"{100 * summary.reordered:.3g} % overtaken at {1_000_000_000 // SPACING_NS} packets/s")
    if summary.rate_bps:
        parts.append(f"at {rate_text(summary.rate_bps)}")
    for carried in summary.carried:
        many = "" if carried.shared_bps is None else f", {MANY} stations {rate_text(carried.shared_bps)}"
        parts.append(f"{carried.size} B: {time_text(carried.airtime_ns)}, {rate_text(carried.goodput_bps)}{many}")
    if summary.broadcast_bps:
        times = ", ".join(f"{carried.size} B: {time_text(carried.airtime_ns)}" for carried in summary.broadcast)
        parts.append(f"broadcasts at {rate_text(summary.broadcast_bps)}, {times}")
    if summary.range_los_m is not None:
        walls = "as they allow" if summary.range_nlos_m is None else range_text(summary.range_nlos_m)
        parts.append(f"range {range_text(summary.range_los_m)} in sight, behind walls {walls}")
    if summary.duty_packets_h is not None:
        parts.append(f"{summary.duty_packets_h} packets of {summary.carried[0].size} B an hour")
    if summary.queue_ns is not None:
        parts.append(f"queue of {time_text(summary.queue_ns)}")
    return f"{summary.name}: {', '.join(parts)}"


def meaning_lines(summaries: Sequence[LinkSummary]) -> Iterator[str]:
    """Yield a line for each, followed by its warnings."""
    for summary in summaries:
        yield summary_line(summary)
        yield from (f"  warning: {summary.name}: {warning}" for warning in summary.warnings)


def start_lines(summaries: Sequence[LinkSummary], file: str) -> list[str]:
    """Return the effective model for the start of a run: all warnings, and what links use, at most LINES_MAX lines if
    there are not more warnings."""
    lines = [f"network {line.strip()}" for line in meaning_lines(summaries)]
    if len(lines) > LINES_MAX:
        lines.sort(key=lambda line: not line.startswith("network warning: "))
        warned = sum(len(summary.warnings) for summary in summaries)
        kept = max(LINES_MAX - 1, warned)
        return [*lines[:kept], f"and {len(lines) - kept} more: foosim net lint {file}"]
    return lines
