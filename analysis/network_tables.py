"""What a network means, and what links of a running system do, as tables and lines for people.

Pure: neighbours are `vhub.lint_text` (lines of the first), `links_shown` (figures of the second), `net_command`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

from rich.table import Table

from foosim.common.format import range_text, rate_text, time_text
from foosim.vhub.links.summary import MANY, SMALL_BYTES, LinkSummary
from foosim.vhub.links.summary_text import burst_text, delay_text, loss_text


def summary_tables(summaries: Sequence[LinkSummary]) -> list[Table]:
    """Return tables for a terminal: what happens to packets, how media carry them, how far radios reach."""
    losses = _table("links", ("rule", "medium"), ("links in use",), ("mean loss", "bursts", "delay beside the medium"))
    stations = "1 station", f"{MANY} stations"
    media = _table("media", ("rule",), ("rate", "bytes", "airtime", *stations, "full queue"))
    ranges = "range in sight", "range behind walls"
    reach = _table("radios", ("rule",), (*ranges, f"packets of {SMALL_BYTES} B an hour"))
    for summary in summaries:
        links = "?" if summary.links is None else f"{summary.used} of {summary.links}"
        losses.add_row(
            summary.name, summary.medium, links, loss_text(summary), burst_text(summary), delay_text(summary)
        )
        sizes = [(summary.name, summary.rate_bps, one) for one in summary.carried]
        sizes += [("broadcasts", summary.broadcast_bps, one) for one in summary.broadcast if summary.broadcast_bps]
        for number, (name, rate_bps, carried) in enumerate(sizes):
            first, queue_ns = carried.size == summary.carried[0].size, summary.queue_ns if number == 0 else None
            media.add_row(
                name if first else "",
                rate_text(rate_bps or 0) if first else "",
                str(carried.size),
                time_text(carried.airtime_ns),
                rate_text(carried.goodput_bps),
                "-" if carried.shared_bps is None else rate_text(carried.shared_bps),
                time_text(queue_ns) if queue_ns is not None else "",
            )
        if summary.range_los_m is not None:
            ranges = range_text(summary.range_los_m), range_text(summary.range_nlos_m)
            reach.add_row(summary.name, *ranges, "-" if summary.duty_packets_h is None else str(summary.duty_packets_h))
    return [table for table in (losses, media, reach) if table.row_count]


def _table(title: str, texts: tuple[str, ...], numbers: Sequence[str], more: Sequence[str] = ()) -> Table:
    """Return an empty table with columns of texts, of numbers, and of `more` texts; a single text is not wrapped."""
    table = Table(title=title, title_justify="left", box=None, pad_edge=False)
    for column in (*texts, *numbers, *more):
        table.add_column(column, justify="right" if column in numbers else "left", no_wrap=(column,) == texts)
    return table


RANGE_NOTE: Final = (
    f"ranges: 90 % of single frames of {SMALL_BYTES} B at the lowest rate, without shadowing and fading, "
    "antennas 1.5 m up and their mounts, or where the places of the first ends are"
)


# --- links of a running system ---------------------------------------------------------------------------------------


def link_line(link: dict[str, Any]) -> str:
    """Return one link of `foosim net top` as a line."""
    causes = "".join(f", {cause} {count}" for cause, count in link["causes"].items())
    return (
        f"{link['from']} to {link['to']} ({link['rule']}): {link['offered_per_s']:.1f}/s, offered {link['offered']}, "
        f"delivered {link['delivered']}, dropped {link['dropped']}{causes}, mean delay "
        f"{time_text(link['delay_ns'])}, queue {time_text(link['queue_ns'])}"
    ) + "".join(f", age at use of {text}" for text in map(age_text, link["ages_at_use"]))


def age_text(age: dict[str, Any]) -> str:
    """Return how old a channel is when its receiver acts: `encoder 6 ms, p99 8 ms`."""
    return f"{age['channel']} {time_text(age['p50_ns'])}, p99 {time_text(age['p99_ns'])}"


def link_table(links: Sequence[dict[str, Any]], title: str) -> Table:
    """Return the links of `foosim net top` as a table."""
    counts = "offered/s", "offered", "delivered", "dropped", "mean delay", "queue", "age at use"
    table = _table(title, ("from", "to", "rule"), counts, ("causes",))
    for link in links:
        table.add_row(
            link["from"],
            link["to"],
            link["rule"],
            f"{link['offered_per_s']:.1f}",
            str(link["offered"]),
            str(link["delivered"]),
            str(link["dropped"]),
            time_text(link["delay_ns"]),
            time_text(link["queue_ns"]),
            "; ".join(map(age_text, link["ages_at_use"])),
            ", ".join(f"{cause} {count}" for cause, count in link["causes"].items()),
        )
    return table


def use_text(status: dict[str, Any]) -> str:
    """`18 links used`: links with packets, including those without a line."""
    count = status["links_in_all"]
    return f"{count} link{'' if count == 1 else 's'} used"


def links_shown(status: dict[str, Any], before: dict[str, Any] | None = None) -> list[dict[str, Any]]:
    """Return a mapping for each link, the one with the most traffic first.

    Traffic is packets offered in a second of simulated time since the status `before`; without one, since the start.
    """
    known: dict[tuple[str, str, str], int] = {}
    since_tick = status["first_tick"]
    if before is not None and before["run"] == status["run"] and before["ticks"] < status["ticks"]:
        known = {(link[0], link[1], link[6]): link[2] for link in before["links"]}
        since_tick = before["ticks"]
    seconds = (status["ticks"] - since_tick) * status["tick_ns"] / 1e9
    shown = []
    for source, destination, offered, delivered, dropped, delay_ns, rule, queue_ns, causes, ages in status["links"]:
        new = max(0, offered - known.get((source, destination, rule), 0))
        shown.append(
            {
                "from": source,
                "to": destination,
                "rule": rule,
                "offered_per_s": round(new / seconds, 3) if seconds > 0 else 0.0,
                "offered": offered,
                "delivered": delivered,
                "dropped": dropped,
                "causes": causes,
                "delay_ns": delay_ns,
                "queue_ns": queue_ns,
                "ages_at_use": [
                    {"channel": channel, "uses": uses, "p50_ns": p50_ns, "p99_ns": p99_ns}
                    for channel, uses, p50_ns, p99_ns in ages
                ],
            }
        )
    return sorted(shown, key=lambda link: (-link["offered_per_s"], -link["offered"], link["from"], link["to"]))
