"""How `foosim match` shows a match: a line for each game, a table, JSON."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import typer
from rich.console import Console
from rich.table import Table

from foosim.analysis.intervals import Interval
from foosim.simulation.match.figures import Figures
from foosim.simulation.match.game import Entrant, Fixture, Game, Link, Played


@dataclass(frozen=True, slots=True)
class Match:
    """A checked match: its players, the games in their order, and the form of the output."""

    entrants: tuple[Entrant, Entrant]
    fixture: Fixture
    games: tuple[Game, ...]
    tick_ns: int
    sides: tuple[str, str]
    worse_for: str

    @property
    def labels(self) -> tuple[str, str]:
        a, b = (one.label for one in self.entrants)
        return (f"{a} (A)", f"{b} (B)") if a == b else (a, b)

    def title(self, played: int) -> str:
        """Return `team against passive: 20 games of 5 min`, of which some may not have been played."""
        a, b = (one.label for one in self.entrants)
        each = len({game.link for game in self.games})
        count = str(len(self.games)) if played == len(self.games) else f"{played} of {len(self.games)}"
        networks = f" over {each} networks" if each > 1 else ""
        minutes = self.fixture.ticks * self.tick_ns / 60e9
        return f"{a} against {b}: {count} game{'s' * (len(self.games) != 1)} of {minutes:g} min{networks}"


def who(match: Match, game: Played) -> str:
    """`team red, passive blue`."""
    a, b = match.labels
    first, second = match.sides
    return f"{b} {first}, {a} {second}" if game.is_swapped else f"{a} {first}, {b} {second}"


def line(match: Match, game: Played, number: int) -> str:
    network = "" if game.link is None else f", {game.link.text}"
    a, b = match.labels
    return (
        f"game {number} of {len(match.games)}: seed {game.seed}{network}, {who(match, game)}: "
        f"{a} {game.points[0]} : {game.points[1]} {b}, {game.away} away"
    )


def drawn_title(match: Match) -> str:
    whose = {"a": f"the links of {match.labels[0]} are worse", "b": f"the links of {match.labels[1]} are worse"}
    return f"{match.title(len(match.games))}, {whose.get(match.worse_for, 'the links of both are worse')}"


def show(match: Match, cells: Sequence[tuple[Link | None, Figures]]) -> None:
    a, b = match.labels
    table = Table(box=None, header_style="bold", pad_edge=False)
    names = (
        "won",
        "drawn",
        "lost",
        "share of wins",
        "equals",
        f"points {a}",
        f"points {b}",
        "difference",
        "away a minute",
    )
    for name in (*(() if cells[0][0] is None else ("delay, loss",)), *names):
        table.add_column(name, justify="right", no_wrap=True)
    for link, found in cells:
        table.add_row(
            *(() if link is None else (link.text,)),
            *(str(count) for count in (found.won, found.drawn, found.lost)),
            "-" if found.wins is None else _interval_text(found.wins),
            f"{found.chance:.2g}",
            *(_interval_text(one) for one in (found.points_a, found.points_b, found.difference, found.away_per_minute)),
        )
    played = sum(found.games for _, found in cells)
    typer.echo(f"{match.title(played)}, figures of {a}, points per game, 95 % in brackets")
    Console(width=None if Console().is_terminal else 180, highlight=False).print(table)


def _interval_text(found: Interval) -> str:
    """`1.25 [0.75, 1.75]`."""
    if found.low is None or found.high is None:
        return f"{found.value:.2f}"
    return f"{found.value:.2f} [{found.low:.2f}, {found.high:.2f}]"


def as_json(match: Match, played: Sequence[Played], cells: Sequence[tuple[Link | None, Figures]]) -> dict[str, Any]:
    a, b = match.entrants
    return {
        "a": a.path,
        "b": b.path,
        "deployment": match.fixture.name,
        "ticks": match.fixture.ticks,
        "tick_ns": match.tick_ns,
        "worse_for": match.worse_for,
        "games": [asdict(game) for game in played],
        "figures": [{"link": None if link is None else asdict(link), **asdict(found)} for link, found in cells],
    }
