"""Curves of shares as an SVG: a picture for documentation, made without a library for charts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple
from xml.sax.saxutils import escape

WIDTH: Final = 640
HEIGHT: Final = 340
LEFT, RIGHT, TOP, BOTTOM = 60.0, 20.0, 40.0, 50.0
STEPS: Final = 5
"""Lines across the chart."""


class Point(NamedTuple):
    """A share of 0 to 1 at `x`, and its standard error."""

    x: float
    share: float
    error: float


class Level(NamedTuple):
    """A share of 0 to 1 that does not depend on x, and what it is of."""

    name: str
    share: float


def curve_svg(title: str, x_title: str, y_title: str, points: Sequence[Point], level: Level | None = None) -> str:
    """Return a curve with bars of twice the standard error to either side, as the text of an SVG.

    A level is a dashed line across it.
    """
    x_max = max(point.x for point in points) or 1.0
    across, along = WIDTH - LEFT - RIGHT, HEIGHT - TOP - BOTTOM

    def x_of(x: float) -> str:
        return f"{LEFT + across * x / x_max:.1f}"

    def y_of(share: float) -> str:
        return f"{TOP + along * (1.0 - min(max(share, 0.0), 1.0)):.1f}"

    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" height="{HEIGHT}" '
        'font-family="sans-serif" font-size="12" fill="#333">',
        f'<rect width="{WIDTH}" height="{HEIGHT}" fill="#fff"/>',
        f'<text x="{LEFT:.0f}" y="22" font-size="14" font-weight="bold">{escape(title)}</text>',
    ]
    for step in range(STEPS + 1):
        share = step / STEPS
        at, tick = y_of(share), x_max * step / STEPS
        lines += [
            f'<line x1="{LEFT:.0f}" x2="{WIDTH - RIGHT:.0f}" y1="{at}" y2="{at}" stroke="#ddd"/>',
            f'<text x="{LEFT - 8:.0f}" y="{at}" dy="4" text-anchor="end">{100 * share:.0f} %</text>',
            f'<text x="{x_of(tick)}" y="{HEIGHT - BOTTOM + 18:.0f}" text-anchor="middle">{tick:,.6g}</text>',
        ]
    if level is not None:
        at, right = y_of(level.share), WIDTH - RIGHT
        lines += [
            f'<line x1="{LEFT:.0f}" x2="{right:.0f}" y1="{at}" y2="{at}" stroke="#b4541f" stroke-dasharray="6 4"/>',
            f'<text x="{right - 4:.0f}" y="{at}" dy="-5" text-anchor="end" fill="#b4541f">{escape(level.name)}</text>',
        ]
    path = " ".join(f"{x_of(point.x)},{y_of(point.share)}" for point in points)
    lines.append(f'<polyline points="{path}" fill="none" stroke="#1f6fb4" stroke-width="2"/>')
    for point in points:
        x = x_of(point.x)
        low, high = y_of(point.share - 2 * point.error), y_of(point.share + 2 * point.error)
        lines += [
            f'<line x1="{x}" x2="{x}" y1="{low}" y2="{high}" stroke="#1f6fb4" stroke-opacity="0.5"/>',
            f'<circle cx="{x}" cy="{y_of(point.share)}" r="3" fill="#1f6fb4"/>',
        ]
    middle = TOP + along / 2
    lines += [
        f'<text x="{LEFT + across / 2:.0f}" y="{HEIGHT - 10}" text-anchor="middle">{escape(x_title)}</text>',
        f'<text transform="translate(14 {middle:.0f}) rotate(-90)" text-anchor="middle">{escape(y_title)}</text>',
        "</svg>",
    ]
    return "\n".join(lines) + "\n"
