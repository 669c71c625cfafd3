"""What a network costs, drawn: points against delay, a line for each loss. SVG."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from itertools import pairwise
from math import ceil, floor
from typing import Final

from foosim.rehearsal.match.figures import Figures, Interval
from foosim.rehearsal.match.game import Link

WIDTH: Final = 420
HEIGHT: Final = 300
LEFT: Final = 60
TOP: Final = 84
GAP: Final = 80
FOOT: Final = 70
COLOURS: Final[tuple[str, ...]] = ("#1864ab", "#2b8a3e", "#e67700", "#c92a2a", "#5f3dc4", "#343a40")
SPREAD: Final = 6.0
"""Pixels between the marks of neighbouring losses, so that their intervals do not hide one another."""
STEPS: Final[tuple[int, ...]] = (1, 2, 5, 10, 20, 50, 100)

Cells = Sequence[tuple[Link, Figures]]


def picture(cells: Cells, labels: tuple[str, str], title: str) -> str:
    """Return a self-contained SVG document: difference, and the points of both, per game with 95 %."""
    width, height = 2 * (LEFT + WIDTH) + GAP, TOP + HEIGHT + FOOT
    a, b = labels
    losses = sorted({link.loss for link, _ in cells})
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" font-family="sans-serif"'
        f' font-size="12"><rect width="100%" height="100%" fill="white"/>',
        _text(16, 24, title, size=15),
    ]
    for number, loss in enumerate(losses):
        x = LEFT + 110 * number
        parts.append(f'<rect x="{x}" y="36" width="12" height="12" fill="{_colour(number)}"/>')
        parts.append(_text(x + 18, 46, f"loss {100 * loss:g} %"))
    panels: list[tuple[str, list[tuple[Link, Interval, bool]]]] = [
        (f"points of {a} less those of {b}, per game", [(link, one.difference, False) for link, one in cells]),
        (
            f"points per game: {a} solid, {b} dashed",
            [entry for link, one in cells for entry in ((link, one.points_a, False), (link, one.points_b, True))],
        ),
    ]
    for place, (name, points) in enumerate(panels):
        parts += _panel(LEFT + place * (LEFT + WIDTH + GAP // 2), name, points, losses)
    return "\n".join([*parts, "</svg>", ""])


def _panel(left: int, name: str, points: Sequence[tuple[Link, Interval, bool]], losses: Sequence[float]) -> list[str]:
    delays = sorted({link.delay_ns for link, _, _ in points})
    longest = delays[-1] or 1
    ends = [value for _, it, _ in points for value in (it.value, it.low, it.high) if value is not None]
    low, high = floor(min(*ends, 0.0)), max(ceil(max(*ends, 0.0)), floor(min(*ends, 0.0)) + 1)

    def across(delay_ns: int, number: float = 0.0) -> float:
        return left + 14 + (WIDTH - 28) * delay_ns / longest + SPREAD * (number - (len(losses) - 1) / 2)

    def up(value: float) -> float:
        return TOP + HEIGHT * (high - value) / (high - low)

    step = next((step for step in STEPS if (high - low) / step <= 8), STEPS[-1])
    parts = [_text(left, TOP - 8, name, size=13)]
    for value in range(step * ceil(low / step), high + 1, step):
        shade = "#868e96" if value == 0 else "#e9ecef"
        parts.append(_line(left, up(value), left + WIDTH, up(value), shade))
        parts.append(_text(left - 8, up(value) + 4, str(value), anchor="end"))
    for delay_ns in delays:
        middle = across(delay_ns, (len(losses) - 1) / 2)
        parts.append(_line(middle, TOP + HEIGHT, middle, TOP + HEIGHT + 5, "#868e96"))
        parts.append(_text(middle, TOP + HEIGHT + 20, f"{delay_ns / 1e6:g}", anchor="middle"))
    parts.append(_text(left + WIDTH / 2, TOP + HEIGHT + 42, "delay each way, ms", anchor="middle"))
    for number, loss in enumerate(losses):
        for is_dashed in sorted({dashed for _, _, dashed in points}):
            found = {link.delay_ns: it for link, it, dashed in points if link.loss == loss and dashed == is_dashed}
            drawn = [(across(delay_ns, number), found[delay_ns]) for delay_ns in delays if delay_ns in found]
            dash = ' stroke-dasharray="5 4"' if is_dashed else ""
            for (x, it), (next_x, following) in pairwise(drawn):
                parts.append(_line(x, up(it.value), next_x, up(following.value), _colour(number), dash, thick=2.0))
            for x, it in drawn:
                if it.low is not None and it.high is not None:
                    parts.append(_line(x, up(it.low), x, up(it.high), _colour(number), thick=1.0))
                parts.append(f'<circle cx="{x:.1f}" cy="{up(it.value):.1f}" r="3" fill="{_colour(number)}"/>')
    return parts


def _colour(number: int) -> str:
    return COLOURS[number % len(COLOURS)]


def _line(  # two ends and a look
    x: float, y: float, to_x: float, to_y: float, colour: str, dash: str = "", *, thick: float = 1.0
) -> str:
    ends = f'x1="{x:.1f}" y1="{y:.1f}" x2="{to_x:.1f}" y2="{to_y:.1f}"'
    return f'<line {ends} stroke="{colour}" stroke-width="{thick}"{dash}/>'


def _text(x: float, y: float, text: str, size: int = 12, anchor: str = "start") -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" font-size="{size}" text-anchor="{anchor}">{escape(text)}</text>'
