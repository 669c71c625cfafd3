"""What another network changes, drawn per link: what is delivered, how late, and how old the newest is. SVG.

Two bars for each link and figure, captured above, judged again below.
"""

from __future__ import annotations

from collections.abc import Callable
from html import escape
from typing import Final

from foosim.replay.what_if import LinkChange, Side, WhatIf

ROW: Final = 30
NAME: Final = 230
PANEL: Final = 190
GAP: Final = 70
TOP: Final = 64
LINKS_MAX: Final = 200
BEFORE: Final = "#9aa5b1"
AFTER: Final = "#d9480f"

_FIGURES: Final[tuple[tuple[str, Callable[[LinkChange, Side], float]], ...]] = (
    ("delivered, %", lambda link, side: 100.0 * side.delivered / link.offered if link.offered else 0.0),
    ("mean delay, ms", lambda link, side: side.delay_mean_ms),
    ("mean age of information, ms", lambda link, side: side.age_ms),
)


def picture(found: WhatIf, title: str) -> str:
    """Return a self-contained SVG document."""
    links = found.links[:LINKS_MAX]
    width, height = NAME + len(_FIGURES) * (PANEL + GAP), TOP + ROW * len(links) + 20
    head = f"{title}: {found.packets} packets, {found.changed} changed"
    if len(found.links) > LINKS_MAX:
        head += f" (the first {LINKS_MAX} of {len(found.links)} links)"
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" font-family="sans-serif"'
        f' font-size="11"><rect width="100%" height="100%" fill="white"/>',
        _text(10, 20, head, size=14),
        f'<rect x="10" y="30" width="10" height="10" fill="{BEFORE}"/>{_text(25, 39, "captured")}',
        f'<rect x="95" y="30" width="10" height="10" fill="{AFTER}"/>{_text(110, 39, "over the other network")}',
    ]
    for number, (name, figure) in enumerate(_FIGURES):
        x = NAME + number * (PANEL + GAP)
        most = max((figure(link, side) for link in links for side in (link.before, link.after)), default=0.0)
        parts.append(_text(x, TOP - 6, name))
        for row, link in enumerate(links):
            parts += _bars(x, TOP + row * ROW, figure(link, link.before), figure(link, link.after), most)
    for row, link in enumerate(links):
        parts.append(_text(10, TOP + row * ROW + 16, f"{link.source} \N{RIGHTWARDS ARROW} {link.destination}"))
    return "\n".join([*parts, "</svg>", ""])


def _bars(x: int, y: int, before: float, after: float, most: float) -> list[str]:
    parts = []
    for shift, value, colour in ((2, before, BEFORE), (14, after, AFTER)):
        length = PANEL * value / most if most else 0.0
        parts.append(f'<rect x="{x}" y="{y + shift}" width="{length:.1f}" height="10" fill="{colour}"/>')
        parts.append(_text(x + length + 4, y + shift + 9, f"{value:.4g}"))
    return parts


def _text(x: float, y: float, text: str, size: int = 11) -> str:
    return f'<text x="{x:.1f}" y="{y}" font-size="{size}">{escape(text)}</text>'
