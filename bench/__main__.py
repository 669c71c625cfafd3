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
    barrier,
    certificates,
    console,
    console_seek,
    distributed,
    echo,
    env,
    fleet,
    hub,
    islands,
    lateness,
    machine,
    noise,
    packets,
    painter,
    rays,
    realtime,
    rigid_fleet,
    swarm,
    table_one_process,
    table_sensors,
    validate,
    verdict,
    vhub_loss,
    view,
    warehouse,
    whatif,
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


def run_barrier(seconds: float | None) -> list[dict[str, Any]]:
    """Compare all ways, for about as many ticks as fit into the seconds."""
    ticks = 1500 if seconds is None else max(100, round(1000 * seconds))
    load = barrier.Load(ticks, message_bytes=1200, node_us=0, server_us=0)
    return barrier.compare(barrier.WAYS, load, turns=1)


def barrier_lines(rows: list[dict[str, Any]]) -> list[str]:
    """Return the figures for people."""
    return [f"{row['way']:36}{row['ticks_per_s']:7} ticks/s{row['cpu_us']:7} us of processor a tick" for row in rows]


BENCHES: Final = (
    Bench(
        "table",
        "the table in one process (rehearsal, one node, no capture)",
        with_default(table_one_process.table_one_process),
        table_one_process.lines,
    ),
    Bench(
        "table-sensors",
        "the table in one process, with all sensors",
        with_default(table_sensors.table_sensors),
        table_sensors.lines,
    ),
    Bench(
        "distributed",
        "two nodes, vHub recording, supervisor, two lockstep players, as fast as it goes",
        with_default(distributed.distributed),
        distributed.lines,
    ),
    Bench(
        "warehouse",
        "twenty rovers with their controllers and a recording vHub, as fast as it goes",
        with_default(warehouse.warehouse),
        warehouse.lines,
    ),
    Bench(
        "fleet",
        "robots that move by kinematics, with their poses, in one process",
        with_default(fleet.fleet),
        fleet.lines,
    ),
    Bench(
        "islands",
        "rigid bodies island by island: boxes, an arm, robots, and the memory of their engines",
        with_default(islands.islands),
        islands.lines,
    ),
    Bench(
        "rigid-fleet",
        "rigid robots on wheels among boxes at rest, in one process and by one node and two",
        with_default(rigid_fleet.rigid_fleet),
        rigid_fleet.lines,
    ),
    Bench(
        "certificates",
        "the same by turns plain and with mutual TLS",
        with_default(certificates.certificates),
        certificates.lines,
    ),
    Bench("realtime", "the same in real time", with_default(realtime.realtime), realtime.lines),
    Bench("view", "the same as fast as it goes, looked at and not, by turns", with_default(view.view), view.lines),
    Bench("hub", "packets through the vHub's core", with_default(hub.hub), hub.lines),
    Bench(
        "packets",
        "packets, drops, refusals, repeats and restarts of the vHub, each explained",
        with_default(packets.packets),
        packets.lines,
    ),
    Bench("verdict", "verdicts with their rows, wire and Wi-Fi", with_default(verdict.verdict), verdict.lines),
    Bench("rays", "lines of sight through a hall of shelves and vehicles", with_default(rays.rays), rays.lines),
    Bench("noise", "normal numbers of noise, in batches and by themselves", with_default(noise.noise), noise.lines),
    Bench("env", "steps of an environment for learning, and of two processes", with_default(env.env), env.lines),
    Bench("painter", "pictures from above", with_default(painter.painter), painter.lines),
    Bench("whatif", "captured packets through another network", with_default(whatif.whatif), whatif.lines),
    Bench("echo", "client to node and back, in real time", with_default(echo.echo), echo.lines),
    Bench(
        "console",
        "a page beside the run: what the console takes, and the run",
        with_default(console.console),
        console.lines,
    ),
    Bench("lateness", "when packets leave against when they are due", with_default(lateness.lateness), lateness.lines),
    Bench(
        "console-seek",
        "the time slider of the console over ten minutes of the table",
        with_default(console_seek.console_seek),
        console_seek.lines,
    ),
    Bench("validate", "a deployment of a thousand robots by template is checked", validate.validate, validate.lines),
    Bench("swarm", "rehearsals under random faults, by seed", swarm.swarm, swarm.lines),
    Bench("vhub-loss", "the vHub is killed and comes back", with_default(vhub_loss.vhub_loss), vhub_loss.lines),
    Bench("barrier", "the messages of a tick alone", run_barrier, barrier_lines),
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
