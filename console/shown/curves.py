"""The points of plotted curves from outside of the frame: figures of links, values of the status, readings."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Final

from foosim.console.shown.source import Curve

LINK_UNITS: Final[Mapping[str, str]] = {"delay_ms": "ms", "queue_ms": "ms", "loss": ""}
"""Of a link's figures; the others are packets in the window."""


def name_and_unit(curve: Curve) -> tuple[str, str]:
    """Return the name of a curve, and its unit where that is known without the scene."""
    if curve.link is not None:
        return f"{curve.link[0]} > {curve.link[1]}: {curve.figure}", LINK_UNITS.get(curve.figure, "packets")
    if curve.reading is not None:
        return f"{curve.reading[0]}/{curve.reading[1]}[{curve.index}]", ""
    if curve.status:
        return curve.status, ""
    return f"number {curve.field}", ""


def points_of(curves: Iterable[Curve], message: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the further points of those curves that a message of `status`, `links` or `readings` is about."""
    series = []
    for curve in curves:
        points = _points(curve, message)
        if points:
            name, unit = name_and_unit(curve)
            series.append({"id": curve.id, "name": name, "unit": unit, "points": points})
    return series


def _points(curve: Curve, message: Mapping[str, Any]) -> list[tuple[float, float]]:
    kind = message["type"]
    if kind == "status" and curve.status:
        value = value_at(message["status"], curve.status)
        return [] if value is None else [(message["status"]["ticks"], value)]
    if kind == "links" and curve.link is not None:
        rows = [row for row in message["links"] if (row["from"], row["to"]) == curve.link]
        value = link_figure(rows, curve.figure)
        return [] if value is None else [(message["at"], value)]
    if kind == "readings" and curve.reading == (message["robot"], message["channel"]):
        return [(tick, numbers[curve.index]) for tick, numbers in message["points"] if curve.index < len(numbers)]
    return []


def value_at(content: Any, path: str) -> float | None:
    """Return the number at a path of keys joined by dots; None for an unknown path.

    The last key may have dots itself, as names of metrics have.
    """
    key, _, rest = path.partition(".")
    if isinstance(content, Mapping):
        key, rest = (path, "") if path in content else (key, rest)
        content = content.get(key)
    elif isinstance(content, list) and key.isdecimal() and len(key) < 6:
        content = content[int(key)] if int(key) < len(content) else None
    else:
        return None
    if rest:
        return value_at(content, rest)
    return float(content) if isinstance(content, int | float) else None


def link_figure(rows: list[Mapping[str, Any]], figure: str) -> float | None:
    """Return a figure of all rules of one link: the sum of packets, the loss of all, the greatest delay."""
    values = [row[figure] for row in rows if row[figure] is not None]
    if not values:
        return None
    if figure in ("offered", "delivered", "dropped"):
        return float(sum(values))
    if figure == "loss":
        known = [(row["loss"], row["offered"]) for row in rows if row["loss"] is not None]
        offered = sum(count for _, count in known)
        return sum(loss * count for loss, count in known) / offered if offered else None
    return float(max(values))
