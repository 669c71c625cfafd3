"""The command `foosim-learn`: trains the player that defends a shot, and tells what delay costs it.

A shell over `learning.training` and `learning.shots`.
"""

from __future__ import annotations

import os
import time
from contextlib import closing
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import msgspec
import typer

from foosim.common.errors import BadValue, Failed, read_at
from foosim.common.json_text import encode_json
from foosim.common.units import NS_PER_S, parse_ns
from foosim.rehearsal.learning.chart import Level, Point, curve_svg
from foosim.runtime.command import VersionOption, new_app, run_app

if TYPE_CHECKING:
    from foosim.rehearsal.learning.training import Measured

app = new_app()

LIBRARIES: Final = ("cma", "gymnasium", "pettingzoo")
"""Those of the extra."""
FIRST_SHOT: Final = 2_000_000
"""The seed of the first shot that `delays` counts: training learns from others, chooses and tests by others."""
SEED_MAX: Final = 1_000_000_000
"""What numpy's generators take, and as many runs of training have shots of their own."""
MS_PER_S: Final = 1e3


@app.callback()
def foosim_learn(version: VersionOption = False) -> None:
    """Train a player to defend a shot, and measure what delay costs it.

    It needs the extra `learn`: pip install 'foosim[learn]'.

    Exit codes: 0 done, 1 failed, 2 bad input, 3 refused, 130 Ctrl-C.
    """


@app.command()
def train(
    weights: Annotated[Path, typer.Argument(metavar="FILE", help="The policy is written here, as JSON.")],
    minutes: Annotated[
        float, typer.Option(help="Wall time in which it ends, but for the first generation.", min=0.0)
    ] = 10.0,
    generations: Annotated[int, typer.Option(help="Number of generations at the most.", min=1)] = 12,
    seed: Annotated[int, typer.Option(help="Of the shots and the policies that are tried.", min=1, max=SEED_MAX)] = 1,
    jobs: Annotated[int, typer.Option(help="Number of processes; it changes no result.", min=1)] = 2,
    picture: Annotated[Path | None, typer.Option(help="The curve is written here, as SVG.")] = None,
) -> None:
    """Train a keeper by CMA-ES, and test it on shots that it does not learn from.

    Ctrl-C ends it; then nothing is written.
    """
    training = _training()
    _check_files(weights, picture)
    from foosim.players.learning.exercises import DEFEND

    def report(measured: Measured) -> None:
        shots = f"{measured.shots} shots" if measured.generation else "untrained"
        print(f"generation {measured.generation}: saves {100 * measured.saved:.0f} % ({shots})", flush=True)

    effort = training.EFFORT
    end_s = time.monotonic() + 60.0 * minutes
    trained = training.train(generations, seed, jobs, effort=effort, report=report, end_s=end_s)
    _write(weights, msgspec.json.format(msgspec.json.encode(trained.file), indent=1) + b"\n")
    print(
        f"kept: generation {trained.kept.generation}, by {effort.choices} other shots; "
        f"it saves {100 * trained.kept.saved:.0f} %, who {DEFEND.by_hand_does} {100 * trained.by_hand:.0f} %"
    )
    if picture is not None:
        points = [
            Point(float(one.shots), one.saved, training.error_of(one.saved, effort.tests)) for one in trained.curve
        ]
        level = Level(DEFEND.by_hand_does, trained.by_hand)
        chart = curve_svg("Learning to defend a shot", "shots learned from", "shots saved", points, level)
        _write(picture, chart.encode())


@app.command()
def delays(
    weights: Annotated[
        Path | None, typer.Argument(metavar="[FILE]", help="A policy; by default the one that comes with foosim.")
    ] = None,
    delay: Annotated[
        str, typer.Option(help="Delays of each packet, one way.", metavar="TIMES")
    ] = "0 ms, 10 ms, 20 ms, 50 ms",
    shots: Annotated[int, typer.Option(help="Shots at each delay, the same ones.", min=1)] = 200,
    picture: Annotated[Path | None, typer.Option(help="The curve is written here, as SVG.")] = None,
    json: Annotated[bool, typer.Option("--json", help="Print JSON, for scripts.")] = False,
) -> None:
    """Count what a trained player saves over the emulated network, by the delay of its packets.

    It plays as in a run, by its class in the deployment: readings and commands are packets, and both are delayed.
    """
    training = _training()
    _check_files(picture)
    from foosim.players.learning.exercises import DEFEND
    from foosim.rehearsal.learning.shots import Network

    points = []
    for delay_ns in _times(delay):
        delay_ms = delay_ns * MS_PER_S / NS_PER_S
        with closing(Network(DEFEND, delay_ms, weights)) as there:
            saved = sum(there.wins(range(FIRST_SHOT, FIRST_SHOT + shots))) / shots
        points.append(Point(delay_ms, saved, training.error_of(saved, shots)))
        if not json:
            error = 200 * points[-1].error
            print(f"{points[-1].x:g} ms: saves {100 * saved:.1f} % of {shots} shots (+- {error:.1f})", flush=True)
    if json:
        print(encode_json([{"delay_ms": one.x, "saved": one.share, "shots": shots} for one in points]).decode())
    if picture is not None:
        chart = curve_svg("What delay costs", "delay of each packet, one way (ms)", "shots saved", points)
        _write(picture, chart.encode())


def _training() -> Any:
    """Return the module that trains. Raises Failed where a library of the extra is not installed."""
    lacking = [name for name in LIBRARIES if find_spec(name) is None]
    if lacking:
        raise Failed(f"not installed: {', '.join(lacking)}; pip install 'foosim[learn]' brings them")
    from foosim.rehearsal.learning import training

    return training


def _times(text: str) -> list[int]:
    """Return the times in ns of a list such as `0 ms, 10 ms`. Raises BadValue."""
    return [read_at("--delay", parse_ns, part.strip()) for part in text.split(",")]


def _check_files(*paths: Path | None) -> None:
    """Raise BadValue for a file that cannot be written, before anything is computed for it."""
    for path in paths:
        if path is None:
            continue
        if not path.parent.is_dir():
            raise BadValue("cannot be written: its folder is not there", str(path))
        if path.is_dir():
            raise BadValue("cannot be written: it is a folder", str(path))
        if not os.access(path if path.exists() else path.parent, os.W_OK):
            raise BadValue("cannot be written: permission denied", str(path))


def _write(path: Path, content: bytes) -> None:
    """Raises BadValue for a file that cannot be written."""
    try:
        path.write_bytes(content)
    except OSError as error:
        raise BadValue(f"cannot be written: {error.strerror}", str(path)) from None


def main() -> None:
    """Entry of `foosim-learn`."""
    run_app(app, "foosim-learn")


if __name__ == "__main__":
    main()
