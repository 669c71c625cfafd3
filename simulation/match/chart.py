"""What a network costs, drawn: points against delay, a line for each loss."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Final

from foosim.simulation.match.figures import Figures, Interval
from foosim.simulation.match.game import Link

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SPREAD: Final = 0.01
"""Between the marks of neighbouring losses, as a share of the longest delay: no interval hides another."""

Cells = Sequence[tuple[Link, Figures]]


def draw(figure: Figure, cells: Cells, labels: tuple[str, str], title: str) -> None:
    """Draw the difference, and the points of both, per game with 95 %."""
    a, b = labels
    figure.set_size_inches(11.0, 5.0)
    figure.suptitle(title)
    left, right = figure.subplots(1, 2)
    left.set_title(f"points of {a} less those of {b}, per game", fontsize="medium")
    right.set_title(f"points per game: {a} solid, {b} dashed", fontsize="medium")
    longest_ms = max(link.delay_ns for link, _ in cells) / 1e6 or 1.0
    curves: list[tuple[int, str, Callable[[Figures], Interval]]] = [
        (0, "o-", lambda found: found.difference),
        (1, "o-", lambda found: found.points_a),
        (1, "o--", lambda found: found.points_b),
    ]
    for number, loss in enumerate(sorted({link.loss for link, _ in cells})):
        rows = {link.delay_ns / 1e6: found for link, found in cells if link.loss == loss}
        delays = sorted(rows)
        places = [delay_ms + SPREAD * longest_ms * number for delay_ms in delays]
        for panel, look, figure_of in curves:
            found = [figure_of(rows[delay_ms]) for delay_ms in delays]
            below = [0.0 if one.low is None else one.value - one.low for one in found]
            above = [0.0 if one.high is None else one.high - one.value for one in found]
            values = [one.value for one in found]
            name = f"loss {100 * loss:g} %" if look == "o-" else None
            (left, right)[panel].errorbar(
                places, values, (below, above), fmt=look, color=f"C{number}", markersize=4, elinewidth=1, label=name
            )
    for axes in (left, right):
        axes.set_xlabel("delay each way, ms")
        axes.axhline(0.0, color="0.5", linewidth=1)
        axes.grid(axis="y", color="0.9")
    left.legend()
