"""Figures of a match: wins, points and what went away, each with its interval of 95 %, and their picture."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import comb
from typing import TYPE_CHECKING, Final

from foosim.analysis.intervals import Interval, bars_of, mean, rate, share
from foosim.simulation.match.game import Link, Played

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, slots=True)
class Figures:
    """What a number of games shows, for the first player: its wins, the draws, its losses, the points of both.

    `wins` is the share of the decided games, None without one; `chance` the probability that two equals are as far
    apart or farther (binomial, two-sided, draws left out).
    """

    games: int
    minutes: float
    won: int
    drawn: int
    lost: int
    points: tuple[int, int]
    wins: Interval | None
    chance: float
    points_a: Interval
    points_b: Interval
    difference: Interval
    away: int
    away_per_minute: Interval


def figures(played: Sequence[Played], tick_ns: int) -> Figures:
    """Return the figures of at least one game."""
    ours, theirs = [game.points[0] for game in played], [game.points[1] for game in played]
    differences = [a - b for a, b in zip(ours, theirs, strict=True)]
    won, lost = sum(value > 0 for value in differences), sum(value < 0 for value in differences)
    minutes = sum(game.ticks for game in played) * tick_ns / 60e9
    away = sum(game.away for game in played)
    return Figures(
        games=len(played),
        minutes=minutes,
        won=won,
        drawn=len(played) - won - lost,
        lost=lost,
        points=(sum(ours), sum(theirs)),
        wins=share(won, won + lost) if won + lost else None,
        chance=chance(won, won + lost),
        points_a=mean(ours),
        points_b=mean(theirs),
        difference=mean(differences),
        away=away,
        away_per_minute=rate(away, minutes),
    )


def chance(count: int, of: int) -> float:
    """Return the two-sided probability of a count so far from the half of `of` fair throws, or farther."""
    least = min(count, of - count)
    return min(1.0, 2 * sum(comb(of, number) for number in range(least + 1)) / (1 << of))


# --- drawn -----------------------------------------------------------------------------------------------------------

SPREAD: Final = 0.01
"""Between the marks of neighbouring losses, as a share of the longest delay: no interval hides another."""

Cells = Sequence[tuple[Link, Figures]]


def draw(figure: Figure, cells: Cells, labels: tuple[str, str], title: str) -> None:
    """Draw the difference, and the points of both, per game with 95 %."""
    a, b = labels
    figure.set_size_inches(11.0, 5.0)
    figure.suptitle(title)
    left, right = figure.subplots(1, 2)
    left.set_title(f"points of {a} less points of {b}, per game", fontsize="medium")
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
            values, bars = bars_of(found)
            name = f"loss {100 * loss:g} %" if look == "o-" else None
            (left, right)[panel].errorbar(
                places, values, bars, fmt=look, color=f"C{number}", markersize=4, elinewidth=1, label=name
            )
    for axes in (left, right):
        axes.set_xlabel("delay each way, ms")
        axes.axhline(0.0, color="0.5", linewidth=1)
        axes.grid(axis="y", color="0.9")
    left.legend()
