"""`python -m bench [names...] [--seconds S] [--json]`: runs the benches, prints tables, and JSON in the last line."""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, is_dataclass
from typing import Any, Final

from bench import (
    answers,
    bodies,
    cameras,
    distributed,
    env,
    fleet,
    gateways,
    lateness,
    machine,
    rays,
    realtime,
    rendering,
    spares,
    sweep,
    table_one_process,
    verdict,
    yarp,
)
from bench.runs import BenchError


@dataclass(frozen=True, slots=True)
class Bench:
    """A row of the table of benches. `run` takes the seconds of simulated time, None for its own."""

    name: str
    title: str
    run: Callable[[float | None], Any]
    lines: Callable[[Any], list[str]]


def with_default(measure: Callable[..., Any]) -> Callable[[float | None], Any]:
    """Return a bench whose seconds may be left out."""
    return lambda seconds: measure() if seconds is None else measure(seconds)


BENCHES: Final = (
    Bench(
        "table",
        "the table in one process (rehearsal, one node, no capture)",
        with_default(table_one_process.table_one_process),
        table_one_process.lines,
    ),
    Bench(
        "distributed",
        "table and warehouse as processes: two nodes, vHub recording, supervisor, players; as fast as possible",
        with_default(distributed.distributed),
        distributed.lines,
    ),
    Bench("realtime", "the table as processes in real time", with_default(realtime.realtime), realtime.lines),
    Bench("spares", "absent entities, and added ones", with_default(spares.spares), spares.lines),
    Bench("fleet", "kinematic robots with their poses, in one process", with_default(fleet.fleet), fleet.lines),
    Bench("bodies", "rigid bodies of any kind", lambda _: bodies.bodies(), bodies.lines),
    Bench("rays", "scans of a fleet, by the kernel and by numpy", lambda _: rays.rays(), rays.lines),
    Bench("rendering", "pictures of the table", lambda _: rendering.rendering(), rendering.lines),
    Bench(
        "gateways",
        "programs of MORSE at 500 robots, services in realtime, 50 robots heard and recorded in one process",
        with_default(gateways.gateways),
        gateways.lines,
    ),
    Bench(
        "cameras",
        "pictures on the table, and twenty robots with cameras in real time",
        with_default(cameras.cameras),
        cameras.lines,
    ),
    Bench("verdict", "verdicts with their rows, wire and Wi-Fi", with_default(verdict.verdict), verdict.lines),
    Bench("env", "steps of an environment for learning, and of two processes", with_default(env.env), env.lines),
    Bench("answers", "when a job is known to be taken", with_default(answers.answers), answers.lines),
    Bench("lateness", "when packets leave against when they are due", with_default(lateness.lateness), lateness.lines),
    Bench("sweep", "a hundred runs of a sweep in two processes", with_default(sweep.swept), sweep.lines),
    Bench("yarp", "bottles between ports of YARP, and through a run", with_default(yarp.yarp), yarp.lines),
)


def plain(value: Any) -> Any:
    """Return a figure as JSON takes it."""
    if is_dataclass(value) and not isinstance(value, type):
        return asdict(value)
    return [plain(item) for item in value] if isinstance(value, list) else value


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benches that are named, or all of them, until one fails; return the exit code."""
    names = [bench.name for bench in BENCHES]
    parser = argparse.ArgumentParser(prog="python -m bench", description="How fast foosim is on this machine.")
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(names)}; all by default")
    parser.add_argument("--seconds", type=float, help="simulated time of each run, instead of each bench's own")
    parser.add_argument("--json", action="store_true", help="JSON only")
    chosen = parser.parse_args(arguments)
    unknown = sorted(set(chosen.names) - set(names))
    if unknown:
        parser.error(f"no bench {', '.join(unknown)}; there are {', '.join(names)}")
    people = sys.stderr if chosen.json else sys.stdout
    here = machine.this_machine()
    how = "compiled" if here.is_compiled else "interpreted"
    print(
        f"{here.cores} cores, {here.cpu}, Python {here.python}, {how}, load {here.load:.2f} before the bench, "
        f"b (a bare tick of the table in Bullet) {here.bare_tick_us:.0f} us",
        file=people,
        flush=True,
    )
    figures: dict[str, Any] = {}
    failed = False
    with tempfile.TemporaryDirectory() as state:
        os.environ["XDG_STATE_HOME"] = state  # the user's own runs keep their folders
        for bench in BENCHES:
            if chosen.names and bench.name not in chosen.names:
                continue
            begun_s = time.monotonic()
            try:
                found = bench.run(chosen.seconds)
            except BenchError as error:
                print(f"\n{bench.name}: {error}", file=sys.stderr)
                failed = True
                break
            figures[bench.name] = plain(found)
            print(f"\n{bench.name}: {bench.title} [{time.monotonic() - begun_s:.0f} s]", file=people)
            print("\n".join(f"  {line}" for line in bench.lines(found)), file=people, flush=True)
    print(json.dumps({"machine": asdict(here), **figures}))
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
