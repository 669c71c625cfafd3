"""Where the processor time of a tick goes between processes: by process and thread, with wake-ups, from /proc.

`python -m bench.threads [OPTIONS OF UP]` runs the table, recorded, as fast as it goes. The main thread of a process is
its loop: cores, codec, engine, journal. Zenoh's threads receive (`rx`, or `app` in a client), send (`tx`) and accept
(`acc`); the other threads of Python hand messages over to the loop and write the capture.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from bench.bare_tick import bare_tick_us
from bench.machine import PROC
from bench.runs import TABLE, BenchError, name_of
from bench.shapes import HERE, LOOK_S, processes_below

SECONDS: Final = 12.0
MIDDLE: Final = (0.45, 0.85)
LEAST_US: Final = 1.0
"""Threads with less processor time a tick are not shown."""
ZENOH: Final = ("rx", "tx", "acc", "app", "net")

Threads = dict[tuple[str, str], tuple[float, int]]
"""By process and kind of thread: processor time in us and wake-ups, both since the start."""


@dataclass(frozen=True, slots=True)
class Spent:
    """What the threads of one kind, of one process, take in a tick."""

    process: str
    threads: str
    cpu_us: float
    wakeups: float


def threads_of(pids: Sequence[int]) -> Threads:
    """Return what the threads of these processes have used."""
    found: Threads = {}
    for pid in pids:
        try:
            words = (PROC / str(pid) / "cmdline").read_bytes().decode().split("\0")
            for task in (PROC / str(pid) / "task").iterdir():
                comm = (task / "comm").read_text().strip()
                status = (task / "status").read_text()
                kind = comm.partition("-")[0] if comm.partition("-")[0] in ZENOH else "other threads of Python"
                kind = "loop" if task.name == str(pid) else kind
                wakeups = int(status.partition("\nvoluntary_ctxt_switches:")[2].split()[0])
                used_us = int((task / "schedstat").read_text().split()[0]) / 1e3
                key = _process_name(words), kind
                before = found.get(key, (0.0, 0))
                found[key] = before[0] + used_us, before[1] + wakeups
        except (FileNotFoundError, ProcessLookupError):
            continue
    return found


def _process_name(words: Sequence[str]) -> str:
    """Return a process's name in its run."""
    if any(word.endswith("foosim-process") for word in words[:2]):
        return words[2]
    return "launcher" if "up" in words[:3] else name_of(words)


def threads(options: Sequence[str] = ()) -> tuple[float, list[Spent]]:
    """Run once; return the wall time of a tick (us) and what each kind of thread takes of it. Raises BenchError."""
    looks: list[tuple[float, Threads]] = []
    with tempfile.TemporaryDirectory() as place:
        command = [
            str(HERE / "foosim-supervisor"),
            "up",
            str(TABLE),
            "--pace",
            "fast",
            "--for",
            f"{SECONDS:g}s",
            "--json",
        ]
        command += ["--capture", f"{place}/run.mcap", *options]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as ran:
            while ran.poll() is None:
                time.sleep(LOOK_S)
                looks.append((time.monotonic(), threads_of(processes_below(ran.pid))))
            assert ran.stdout is not None
            output = ran.stdout.read()
            if ran.returncode != 0:
                raise BenchError(f"{' '.join(command)}: exit code {ran.returncode}")
    result = json.loads(output.splitlines()[-1])
    tick_us = result["tick_ns"] / 1e3 / result["rtf"]
    (begun_s, first), (ended_s, last) = (looks[round(len(looks) * share)] for share in MIDDLE)
    ticks = (ended_s - begun_s) * 1e6 / tick_us
    spent = [
        Spent(process, kind, (last[process, kind][0] - used_us) / ticks, (last[process, kind][1] - wakeups) / ticks)
        for (process, kind), (used_us, wakeups) in sorted(first.items())
        if (process, kind) in last
    ]
    return tick_us, [one for one in spent if one.cpu_us >= LEAST_US]


def main() -> None:
    """Run once and print a table."""
    b_us = bare_tick_us()
    tick_us, spent = threads(sys.argv[1:])
    print(f"b {b_us:.0f} us; a tick {tick_us:.0f} us of wall, {sum(one.cpu_us for one in spent):.0f} us of processor")
    for one in spent:
        print(f"  {one.process:12}{one.threads:26}{one.cpu_us:7.0f} us{one.wakeups:7.2f} wake-ups")
    for name, kinds in (
        ("Zenoh", ZENOH),
        ("loops", ("loop",)),
        ("other threads of Python", ("other threads of Python",)),
    ):
        print(f"  {name}: {sum(one.cpu_us for one in spent if one.threads in kinds):.0f} us")


if __name__ == "__main__":
    main()
