"""The command `foosim match`: many games of two players, in several processes, and their statistics."""

from __future__ import annotations

from collections.abc import Iterable
from concurrent.futures import Executor
from contextlib import closing
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Annotated, Any, Final

import typer

from foosim.analysis.picture import HELP, check_picture, new_picture
from foosim.capture.new_file import check_absent
from foosim.cli.executor import DaskOption, JobsOption, executor_of
from foosim.cli.match.shown import Match, as_json, drawn_title, line, show, who
from foosim.cli.run_command import with_options
from foosim.client.loading import look_in
from foosim.common import units
from foosim.common.errors import BadValue, Failed, UnknownName, read_at
from foosim.common.units import parse_ns
from foosim.deployment.assets import pin_assets
from foosim.deployment.loader import apply_sets, check_engine, load_deployment
from foosim.deployment.text.files import read_source_file
from foosim.runtime.command import DONE, FAILED, INTERRUPTED, JsonOption, new_app, print_json
from foosim.simulation.match.figures import draw, figures
from foosim.simulation.match.game import Fixture, Game, Link, Played, entrant, played, run_of, seats, sets_of
from foosim.simulation.study.sweep import LIMIT_S, outcomes

TABLE: Final = Path("deploy/table.yaml")
SIDES: Final = {"a": (0,), "b": (1,), "both": (0, 1)}
"""The player with the worse network."""
CELLS_MAX: Final = 400

app = new_app()


@dataclass(frozen=True, slots=True)
class MatchOptions:
    """The settings of a match; each field is an argument or option of the command."""

    a: Annotated[str, typer.Argument(metavar="A", help="keeper, passive, striker, team, or module:Class.")]
    b: Annotated[str, typer.Argument(metavar="B", help="The other player, likewise.")]
    games: Annotated[int, typer.Option("--games", help="Number of games, with the seeds from --seed on.", min=1)] = 20
    minutes: Annotated[float, typer.Option("--minutes", help="Simulated length of a game.", min=0.001, max=1000)] = 5.0
    seed: Annotated[int, typer.Option("--seed", help="Seed of the first game.", min=0)] = 1
    keep_sides: Annotated[bool, typer.Option("--keep-sides", help="Do not change sides in every second game.")] = False
    jobs: JobsOption = None
    dask: DaskOption = None
    deployment: Annotated[Path, typer.Option("--deployment", help="The deployment file to play.")] = TABLE
    sets: Annotated[
        tuple[str, ...],
        typer.Option("--set", help="Change the deployment, e.g. --set table.walls.height='120 mm'; may be repeated."),
    ] = ()
    delay: Annotated[
        str | None, typer.Option("--delay", help="Play over links with these delays, each way: 0,10,20,50ms.")
    ] = None
    loss: Annotated[str | None, typer.Option("--loss", help="Play over links that lose these shares: 0,5,10,20%.")] = (
        None
    )
    worse_for: Annotated[
        str, typer.Option("--worse-for", help="Whose links have --delay and --loss: a, b or both.")
    ] = "a"
    drawing: Annotated[Path | None, typer.Option("--picture", help=HELP.format("points against delay and loss"))] = None
    captures: Annotated[
        Path | None, typer.Option("--captures", metavar="FOLDER", help="Write a capture of each game here.")
    ] = None


@app.command()
@with_options()
def foosim_match(
    options: MatchOptions,
    json: JsonOption = False,
) -> None:
    """Let two players play many games, and show which is better.

    Each game is a rehearsal of the deployment with the classes A and B in the places of its two players, and with a
    seed of its own; in every second game they change sides. Prints wins, points, and how often what is played with
    left the field, with intervals of 95 %: Wilson's for the share of wins among decided games, Student's for points,
    the score interval of a rate. `equals` is the probability that two equal players are so far apart (two-sided).

    With --delay or --loss there is a row for each pair of both, of the same seeds: the links to and from A
    (--worse-for) have that delay and loss in place of the deployed ones, B keeps its network. --picture draws the rows.

    Ctrl-C ends the match with the games so far.

    Exit codes: 0 done, 1 a game has failed, 2 bad input, 3 a capture exists, 130 Ctrl-C.
    """
    match = _checked(options)
    with executor_of(options.jobs, options.dask) as executor:
        raise typer.Exit(_play(match, executor, options.drawing, json))


def _checked(options: MatchOptions) -> Match:
    """Return the match of the options; raises Refused, before any game and any file."""
    drawing, name = options.drawing, str(options.deployment)
    if drawing is not None:
        if options.delay is None and options.loss is None:
            raise BadValue("--picture: there is nothing to draw without --delay or --loss", str(drawing))
        check_picture(drawing)
    if options.worse_for not in SIDES:
        raise UnknownName("--worse-for: not a side", options.worse_for, SIDES)
    look_in(str(options.deployment.parent.absolute()))
    entrants = entrant("A", options.a), entrant("B", options.b)
    links = _links(options.delay, options.loss)
    text = apply_sets(read_source_file(options.deployment), name, options.sets)
    text, files = pin_assets(text, name, options.deployment.parent)
    deployment = load_deployment(text, name).with_assets(files)
    check_engine(text, name, deployment)
    first, second = seats(deployment, name)
    ticks = max(1, round(options.minutes * 60e9 / deployment.tick_ns))
    classes = entrants[0].path, entrants[1].path
    fixture = Fixture(text, name, options.deployment.parent, classes, ticks, SIDES[options.worse_for], files)
    games = [
        Game(seed, number % 2 == 1 and not options.keep_sides, link, _capture(options.captures, seed, link))
        for link in links
        for number, seed in enumerate(range(options.seed, options.seed + options.games))
    ]
    for game in {(game.is_swapped, game.link): game for game in games}.values():
        apply_sets(text, name, sets_of(fixture, game))
    _make_room(options.captures, games)
    return Match(entrants, fixture, tuple(games), deployment.tick_ns, (first, second), options.worse_for)


def _play(match: Match, executor: Executor, drawing: Path | None, json: bool) -> int:
    """Play the games and show them; return the exit code."""
    results: dict[Game, Played] = {}
    code = DONE
    with closing(outcomes({game: run_of(match.fixture, game) for game in match.games}, executor, LIMIT_S)) as found:
        try:
            for game, outcome in found:
                result = played(match.fixture, game, outcome)
                if result.failed:
                    typer.echo(f"seed {game.seed}, {who(match, result)}: {result.failed}", err=True)
                    code = FAILED
                    break
                results[game] = result
                typer.echo(line(match, result, len(results)), err=True)
        except KeyboardInterrupt:
            typer.echo(f"interrupted after {len(results)} of {len(match.games)} games", err=True)
            code = INTERRUPTED
    shown = [results[game] for game in match.games if game in results]
    cells = [(link, figures(list(games), match.tick_ns)) for link, games in groupby(shown, key=lambda one: one.link)]
    if drawing is not None and code == DONE:
        drawn = [(link, found) for link, found in cells if link is not None]
        with new_picture(drawing) as figure:
            draw(figure, drawn, match.labels, drawn_title(match))
    if json:
        print_json(as_json(match, shown, cells))
    elif cells:
        show(match, cells)
    return code


def _links(delay: str | None, loss: str | None) -> list[Link | None]:
    """Return the networks of a match: for each delay each loss; None is the deployment's own."""
    if delay is None and loss is None:
        return [None]
    delays = [0] if delay is None else _listed("--delay", delay, "ms", parse_ns)
    losses = [0.0] if loss is None else _listed("--loss", loss, "%", _share)
    if len(delays) * len(losses) > CELLS_MAX:
        raise BadValue(f"--delay, --loss: more than {CELLS_MAX} pairs", len(delays) * len(losses))
    return [Link(late_ns, lost) for late_ns in delays for lost in losses]


def _listed(option: str, text: str, unit: str, read: Any) -> list[Any]:
    """Return the values of `0,10,20ms`: the last one's unit counts for those without; `unit` where it has none."""
    words = [word.strip() for word in text.split(",")]
    if not all(words):
        raise BadValue(f"{option}: a list with commas is needed, such as 0,10,20{unit}", text)
    own = words[-1].lstrip("0123456789.").strip() or unit
    values = [read_at(option, read, word if not word[-1].isdigit() else f"{word} {own}") for word in words]
    if len(set(values)) != len(values):
        raise BadValue(f"{option}: a value is there twice", text)
    return values


def _share(text: str) -> float:
    value = float(units.parse(text, units.PROBABILITY))
    if not 0.0 <= value < 1.0:
        raise BadValue("out of range 0 % to below 100 %", text)
    return value


def _capture(folder: Path | None, seed: int, link: Link | None) -> Path | None:
    if folder is None:
        return None
    network = "" if link is None else f"-{link.delay_ns / 1e6:g}ms-{100 * link.loss:g}pct"
    return folder / f"seed-{seed}{network}.mcap"


def _make_room(folder: Path | None, games: Iterable[Game]) -> None:
    """Make the folder of captures; raises Existing for a capture that is there already."""
    if folder is None:
        return
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise Failed(f"--captures: {folder}: cannot be made, {error.strerror or error}") from None
    for game in games:
        if game.capture is not None:
            check_absent(game.capture)
