"""The changes by another network, drawn per link: delivered packets, delays, and the age of the newest packet.

Two bars for each link and figure, captured above, judged again below.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Final

from foosim.simulation.what_if import LinkChange, Side, WhatIf

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LINKS_MAX: Final = 200
BAR: Final = 0.4
"""The height of a bar; a link has the height 1."""

_FIGURES: Final[tuple[tuple[str, Callable[[LinkChange, Side], float]], ...]] = (
    ("delivered, %", lambda link, side: 100.0 * side.delivered / link.offered if link.offered else 0.0),
    ("mean delay, ms", lambda link, side: side.delay_mean_ms),
    ("mean age of information, ms", lambda link, side: side.age_ms),
)


def draw(figure: Figure, found: WhatIf, title: str) -> None:
    """Draw the first 200 links."""
    links = found.links[:LINKS_MAX]
    head = f"{title}: {found.packets} packets, {found.changed} changed"
    if len(found.links) > LINKS_MAX:
        head += f" (the first {LINKS_MAX} of {len(found.links)} links)"
    figure.set_size_inches(12.0, 1.5 + 0.3 * len(links))
    figure.suptitle(head)
    panels = figure.subplots(1, len(_FIGURES), sharey=True)
    for panel, (name, figure_of) in zip(panels, _FIGURES, strict=True):
        sides = (
            ("captured", "0.6", -BAR / 2, [figure_of(link, link.before) for link in links]),
            ("over the other network", "C1", BAR / 2, [figure_of(link, link.after) for link in links]),
        )
        for label, colour, shift, values in sides:
            bars = panel.barh([row + shift for row in range(len(links))], values, BAR, color=colour, label=label)
            panel.bar_label(bars, fmt="{:.4g}", padding=2, fontsize=7)
        panel.set_title(name, fontsize="medium")
        panel.margins(x=0.15)
    names = [f"{link.source} \N{RIGHTWARDS ARROW} {link.destination}" for link in links]
    panels[0].set_yticks(range(len(links)), names)
    panels[0].set_ylim(len(links) - 0.5, -0.5)  # the first link is the highest
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
