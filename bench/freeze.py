"""`python -m bench.freeze COMMIT [--rename OLD=NEW]`: whether this tree computes the same worlds as a commit.

Both trees rehearse the four deployments for 10 s at two seeds, on the spot and with the packages of this Python.
Compared are the digest of all ticks, the packets by fate, the score, each field of each entity over all ticks, and the
rows of each topic of the capture, without the log and without fields of the wall clock. --rename names a field that has
another name in the commit; digests and topics that depend on the layout are then not compared.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from hashlib import blake2b
from itertools import groupby, product
from pathlib import Path
from typing import Any, Final, cast

import numpy as np
from mcap.reader import make_reader

from bench.against import checked_out, run_in
from bench.runs import BenchError
from foosim.deployment.loader import load_deployment
from foosim.simulation.run import rehearse
from foosim.simulation.settings import Settings
from foosim.world.frame import Frame

WORLDS: Final = ("table", "table_sensors", "warehouse", "yard")
SEEDS: Final = (1, 2)
OF_LAYOUT: Final = ("/tick", "/layout", "/frame", "/epochs")
"""Topics whose rows have digests of frames or places in them."""
LOG: Final = "/log"
WALL: Final = "wall_"
"""How fields begin that come from a clock of the real world."""
SIDE: Final = """
import json, sys
from pathlib import Path
sys.path.insert(0, sys.argv[1])
from bench.freeze import rehearsed
print(json.dumps(rehearsed(Path(sys.argv[2]), int(sys.argv[3]), float(sys.argv[4]))))
"""
LINES_MAX: Final = 20


World = dict[str, Any]
"""Ticks, digest of all ticks, score, packets by fate; digests of fields by `entity field` and of rows by topic."""


def rehearsed(file: Path, seed: int, seconds: float) -> World:
    """Rehearse a deployment on two nodes with the foosim of this process."""
    text, frames = file.read_text(), list[Frame]()
    ticks = round(seconds * 1e9) // load_deployment(text, file.name).tick_ns
    with tempfile.TemporaryDirectory() as folder:
        capture = Path(folder, "run.mcap")
        settings, sets = Settings(on_commit=frames.append), [f"seed={seed}"]
        done = rehearse(text, file.name, ticks, 2, sets, settings, capture=capture, folder=file.parent).json
        rows = rows_of(capture)
    if done["failed"]:
        raise BenchError(f"{file.name}: {done['reason']}")
    figures = {"ticks": len(frames), "digest": done["digest"]["chain"], "score": done["summary"]}
    return {**figures, "packets": done["packets"], "fields": fields_of(frames), "rows": rows}


def fields_of(frames: Sequence[Frame]) -> dict[str, str]:
    """Return a digest of each field of each entity over frames, and of each outbox."""
    found = defaultdict[str, Any](partial(blake2b, digest_size=8))
    for layout, together in groupby(frames, lambda frame: frame.layout):
        kept = list(together)
        values = np.array([frame.values for frame in kept])
        for entity in layout.entities:
            for field, start in entity.offsets.items():
                found[f"{entity.name} {field}"].update(values[:, start : start + entity.counts[field]].tobytes())
            for frame in kept:
                found[f"{entity.name} outbox"].update(frame.outboxes.get(entity.index, b"") + b"\n")
    return {name: digest.hexdigest() for name, digest in found.items()}


def rows_of(capture: Path) -> dict[str, str]:
    """Return a digest of the rows of each topic, as any reader of MCAP finds them."""
    found = defaultdict[str, Any](partial(blake2b, digest_size=8))
    with capture.open("rb") as stream:
        for _, channel, message in make_reader(stream).iter_messages():
            if channel.topic != LOG:
                row = message.data
                if channel.message_encoding == "json":
                    row = json.dumps(without_wall(json.loads(row)), sort_keys=True).encode()
                found[channel.topic].update(b"%d %d " % (message.log_time, len(row)) + row)
    return {topic: digest.hexdigest() for topic, digest in found.items()}


def without_wall(row: Any) -> Any:
    """Return a row without what comes from a clock of the real world."""
    if isinstance(row, dict):
        return {name: without_wall(value) for name, value in row.items() if not name.startswith(WALL)}
    return [without_wall(value) for value in row] if isinstance(row, list) else row


def differences(here: World, there: World, renames: Mapping[str, str]) -> list[str]:
    """Return what differs between this tree and the commit, whose fields have the names that `renames` maps to ours."""
    theirs = {renamed(name, renames): digest for name, digest in there["fields"].items()}
    names = ["ticks", "score", "packets", *([] if renames else ["digest"])]
    found = [f"{name} {there[name]} -> {here[name]}" for name in names if here[name] != there[name]]
    found += [f"field {name}" for name in unequal(here["fields"], theirs)]
    return found + [f"rows of {name}" for name in unequal(here["rows"], there["rows"], OF_LAYOUT if renames else ())]


def renamed(name: str, renames: Mapping[str, str]) -> str:
    """Return `entity field` with the field's new name."""
    entity, _, field = name.partition(" ")
    return f"{entity} {renames.get(field, field)}"


def unequal(here: Mapping[str, str], there: Mapping[str, str], without: Sequence[str] = ()) -> list[str]:
    """Return the names whose digests differ, with the side of one-sided names."""
    sides = {name: (here.get(name), there.get(name)) for name in sorted({*here, *there} - {*without})}
    only = {(True, False): ", which the commit lacks", (False, True): ", which this tree lacks"}
    where = {name: only.get((bool(ours), bool(theirs)), "") for name, (ours, theirs) in sides.items()}
    return [f"{name}{where[name]}" for name, (ours, theirs) in sides.items() if ours != theirs]


def rehearsed_in(tree: Path, world: str, seed: int, seconds: float) -> World:
    """Rehearse a deployment of a tree with that tree's foosim, in a process of its own."""
    command = [sys.executable, "-c", SIDE, str(tree), str(tree / "deploy" / f"{world}.yaml")]
    return cast("World", json.loads(run_in(tree, [*command, str(seed), str(seconds)]).splitlines()[-1]))


def main(arguments: Sequence[str] | None = None) -> int:
    """Compare and print; return the exit code: 0 equal, 1 different or failed."""
    parser = argparse.ArgumentParser(prog="python -m bench.freeze", description="Does a commit compute the same?")
    parser.add_argument("commit", help="as git names it")
    parser.add_argument("--rename", action="append", default=[], metavar="OLD=NEW", help="a field, e.g. a.b=a.c")
    parser.add_argument("--world", action="append", choices=WORLDS, help="these alone (default: all four)")
    parser.add_argument("--seconds", type=float, default=10.0, help="simulated time of each (default 10)")
    chosen = parser.parse_args(arguments)
    pairs = [rename.partition("=") for rename in chosen.rename]
    if not all(old and new for old, _, new in pairs):
        parser.error(f"--rename: OLD=NEW is needed, not {', '.join(chosen.rename)}")
    renames, is_equal = {old: new for old, _, new in pairs}, True
    try:
        for label, here, there in compared(chosen.commit, chosen.world or WORLDS, chosen.seconds):
            found = differences(here, there, renames)
            is_equal = is_equal and not found
            print(f"{label}: {summary(found, here)}", flush=True)
    except BenchError as error:
        print(error, file=sys.stderr)
        return 1
    return 0 if is_equal else 1


def compared(commit: str, worlds: Sequence[str], seconds: float) -> Iterator[tuple[str, World, World]]:
    """Rehearse each world at each seed in both trees, at the same time; yield label, this tree's and the commit's."""
    with checked_out(commit) as trees, ThreadPoolExecutor(len(trees)) as pool:
        for world, seed in product(worlds, SEEDS):
            here, there = pool.map(partial(rehearsed_in, world=world, seed=seed, seconds=seconds), trees)
            yield f"{world}, seed {seed}", here, there


def summary(found: Sequence[str], here: World) -> str:
    """Return the differences of a world for people, the first of them."""
    if not found:
        return f"equal ({here['ticks']} ticks, {len(here['fields'])} fields, {len(here['rows'])} topics)"
    more = len(found) - LINES_MAX
    return "\n  ".join([f"{len(found)} differences", *found[:LINES_MAX], *([f"and {more} more"] if more > 0 else [])])


if __name__ == "__main__":
    sys.exit(main())
