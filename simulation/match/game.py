"""The games of a match: the two entrants, and a rehearsal with the sides' classes, seed and network."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, NamedTuple

import yaml

from foosim.client.loading import class_faults
from foosim.common.errors import BadValue, UnknownName
from foosim.common.units import format_ns
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.deployment.schema import Deployment
from foosim.library.table.players import OF_THE_TABLE
from foosim.simulation.study.run import Ran, Run, version_here
from foosim.simulation.study.table import LAST
from foosim.world.assembly.initial_state import initial_frame
from foosim.world.assembly.world import mark_kinds, world_status

IMPORT_S: Final = 60.0
"""How long the modules of the players may take to be imported."""
SCORE: Final = "score"
"""Where the status of a world has the points of each side."""
SIDE: Final = "team"
"""The parameter of a player that has its side."""


class Entrant(NamedTuple):
    """One of the two entrants: its label as requested, and its class."""

    label: str
    path: str


def entrant(place: str, name: str) -> Entrant:
    """Return the entrant of a short name, or of `module:Class`; `place` is the argument's name, for errors.

    Raises UnknownName, and BadValue for a class that cannot be loaded or is no player.
    """
    if name in OF_THE_TABLE:
        return Entrant(name, OF_THE_TABLE[name])
    if ":" not in name:
        raise UnknownName(f"{place}: no such player", name, OF_THE_TABLE, also="module:Class of your own")
    faults = class_faults([name], IMPORT_S)
    if name in faults:
        raise BadValue(f"{place}: {faults[name].problem}", name, faults[name].nearest)
    return Entrant(name, name)


def seats(deployment: Deployment, file: str) -> dict[str, str]:
    """Return the two sides of a world that keeps a score, and the deployment's player of each, in the score's order.

    Raises BadValue where there is no such score, a side has not one player, or one does not play in lockstep.
    """
    score: Any = world_status(deployment, initial_frame(deployment)).get(SCORE)
    if not isinstance(score, dict) or len(score) != 2:
        raise BadValue(f"{file}: a match needs a world with a rule that keeps the score of two sides")
    found: dict[str, str] = {}
    for side in score:
        names = [name for name, player in sorted(deployment.players.items()) if player.parameters.get(SIDE) == side]
        if len(names) != 1:
            shown = ", ".join(names) or "none"
            raise BadValue(f"{file}: a match needs one player with the parameter `{SIDE}: {side}`; there are: {shown}")
        if not deployment.players[names[0]].lockstep:
            raise BadValue(f"{file}: a match is played in lockstep, and players.{names[0]} is free-running")
        found[side] = names[0]
    return found


AWAY: Final = "away"
"""How marks look of what has left its place, and is put back."""


@dataclass(frozen=True, slots=True)
class Link:
    """What a worse network does to each packet, on its way in and on its way out."""

    delay_ns: int
    loss: float

    @property
    def text(self) -> str:
        return f"{format_ns(self.delay_ns)}, {100 * self.loss:g} %"


@dataclass(frozen=True, slots=True)
class Fixture:
    """What all games of a match have in common: the deployment's text and name, its folder, who plays, how long.

    The text has the digests of the deployment's files, whose contents by path are `files` (`pin_assets`).
    """

    text: str
    name: str
    folder: Path
    classes: tuple[str, str]
    ticks: int
    worse: tuple[int, ...] = (0,)
    """Which of the two play over the worse network."""
    files: Mapping[str, bytes] = field(default_factory=dict)

    def deployment(self, text: str) -> Deployment:
        """Return the deployment of a game's text."""
        return load_deployment(text, self.name).with_assets(self.files)


@dataclass(frozen=True, slots=True)
class Game:
    """One game: its seed, whether the two have changed sides, its network if it differs from the deployment's."""

    seed: int
    is_swapped: bool
    link: Link | None = None
    capture: Path | None = None


@dataclass(slots=True)
class Played:
    """Result of a game. Points are of the first and of the second player; `failed` is empty for a finished game.

    `away` counts how often a thing was put back that had left its place, as the rules mark it.
    """

    seed: int
    is_swapped: bool
    points: tuple[int, int]
    away: int
    ticks: int
    digest: str
    failed: str = ""
    link: Link | None = field(default=None)
    metrics: Mapping[str, float] = field(default_factory=dict)


def run_of(fixture: Fixture, game: Game) -> Run:
    """Return a game as a run of a study."""
    sets = tuple(sets_of(fixture, game))
    capture = None if game.capture is None else game.capture.absolute()
    return Run(fixture.text, fixture.name, fixture.folder.absolute(), sets, fixture.ticks, version_here(), capture)


def played(fixture: Fixture, game: Game, found: Ran) -> Played:
    """Return a game's result from what became of its run."""
    if found.message:
        return Played(game.seed, game.is_swapped, (0, 0), 0, 0, "", found.message, link=game.link)
    deployment, figures = fixture.deployment(fixture.text), found.figures
    score = {side: int(figures[f"{SCORE}.{side}"]) for side in seats(deployment, fixture.name)}
    away = sum(figures[f"marks.{name}"] for name, kind in mark_kinds(deployment).items() if kind.look == AWAY)
    points = points_of(score, is_swapped=game.is_swapped)
    metrics = {name: value for name, value in figures.items() if name not in LAST}
    its = points, int(away), figures["ticks"], figures["digest"]
    return Played(game.seed, game.is_swapped, *its, link=game.link, metrics=metrics)


def points_of(score: Mapping[str, int], *, is_swapped: bool) -> tuple[int, int]:
    """Return the points of the first and of the second player from the two sides' points."""
    first, second = score.values()
    return (second, first) if is_swapped else (first, second)


def sets_of(fixture: Fixture, game: Game) -> list[str]:
    """Return the settings that make a game of the deployment."""
    deployment = fixture.deployment(fixture.text)
    seated = [*seats(deployment, fixture.name).values()][:: -1 if game.is_swapped else 1]
    sets = [f"players.{name}.class={path}" for name, path in zip(seated, fixture.classes, strict=True)]
    if game.link is not None:
        sets.append(f"network.links={_links(fixture, [seated[which] for which in fixture.worse], game.link)}")
    return [f"seed={game.seed}", *sets]


def _links(fixture: Fixture, names: Sequence[str], link: Link) -> str:
    """Return the deployment's links behind those of the players that have the worse network, as YAML on one line."""
    kept = (yaml.safe_load(apply_sets(fixture.text, fixture.name, ())).get("network") or {}).get("links") or []
    worse = {"delay": format_ns(link.delay_ns), "loss": f"{100 * link.loss:g} %"}
    own = [
        {"id": f"match-{name}-{way}", "from": ends[0], "to": ends[1], **worse}
        for name in names
        for way, ends in (("in", ("*", name)), ("out", (name, "*")))
    ]
    return yaml.safe_dump([*own, *kept], default_flow_style=True, width=1 << 30).strip()
