"""The links of a running system, busiest first: what `foosim-net top` shows, from two statuses of a run.

Pure: neighbours are `status` (where links come from), `net_text` (how they look).
"""

from __future__ import annotations

from typing import Any


def use_text(status: dict[str, Any]) -> str:
    """`18 links used`: those that a packet was offered to, however many of them are told."""
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
