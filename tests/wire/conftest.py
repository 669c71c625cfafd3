"""Runs of real processes through the commands, each in a folder and a state folder of its own.

Nothing here waits for a time: everything waits for a condition, with a limit that only a run that hangs reaches. The
machines are shared, so the run's own deadlines are set long, too.
"""

import io
import os
import signal
import subprocess
import sys
import sysconfig
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, redirect_stderr, redirect_stdout, suppress
from importlib.metadata import entry_points
from pathlib import Path
from typing import IO, Any, Final, TypeVar

import pytest

from foosim.client import control
from foosim.common.errors import Refused
from foosim.runtime.run_folder import RunFolder, RunInfo, live_runs

TABLE: Final = Path(__file__).parent.parent.parent / "deploy" / "table.yaml"
LONG: Final = (
    "deadlines={heartbeat: 900 s, tick_named: 500 s, tick_lost: 900 s, lockstep_fast: 900 s, lockstep_realtime: 900 s,"
    " start: 900 s, orphan: 900 s, vhub_back: 900 s, client_back: 900 s}"
)
"""Nobody is given up for being slow; a test of one of these deadlines sets that one."""
NO_CAPTURE_TO_CLOSE: Final = ("--set", "deadlines.close=1 s")
"""For a run whose vHub is gone at its end: the supervisor waits as long as this for it to close its capture."""
ONE: Final = ("--processes", "one")
"""For a run whose processes are not the point: each one that starts costs most of a second of processor time."""
LIMIT_S: Final = 900.0
LOOK_S: Final = 0.3
SLOW: Final = "0.1x"


def in_process(process: str, *roles: str) -> list[str]:
    """The arguments of `up` that put roles into a process; "null" is one of their own each."""
    return [word for role in roles for word in ("--set", f"{role}.process={process}")]


T = TypeVar("T")


def wait_for(what: str, found: Callable[[], T | None]) -> T:
    """Return the first true value of `found`; who waits longer looks less often, since each look costs."""
    deadline_s, sleep_s = time.monotonic() + LIMIT_S, 0.02
    while time.monotonic() < deadline_s:
        value = found()
        if value:
            return value
        time.sleep(sleep_s)
        sleep_s = min(LOOK_S, 1.5 * sleep_s)
    raise AssertionError(f"waited {LIMIT_S} s for {what}")


def command_path(name: str) -> str:
    """Where a command of this environment is."""
    return str(Path(sysconfig.get_path("scripts")) / name)


def processes_with(text: str) -> dict[int, str]:
    """Process ids and command lines that have this text in them."""
    found = {}
    for path in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            line = (path / "cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace").strip()
            if text in line and "State:\tZ" not in (path / "status").read_text():
                found[int(path.name)] = line
    return found


class House:
    """Starts commands, and knows the run that is live."""

    table = TABLE
    wait_for = staticmethod(wait_for)
    processes_with = staticmethod(processes_with)

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.started: list[subprocess.Popen[str]] = []

    def start(self, name: str, *arguments: str | Path) -> subprocess.Popen[str]:
        """Start one of foosim's commands, in a process group of its own."""
        process = subprocess.Popen(
            [command_path(name), *map(str, arguments)],
            cwd=self.folder,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            process_group=0,
        )
        self.started.append(process)
        return process

    def up(self, *arguments: str | Path, players: bool = False, each: bool = False) -> subprocess.Popen[str]:
        """Start a run of the table, without its players unless they are asked for; `each`: no roles share a process.

        It is slow unless another pace is asked for: while a test waits for processes, each tick only costs.
        """
        bare = () if players else ("--set", "players={}")
        apart = ("--processes", "each") if each else ()
        return self.start("foosim", "up", self.table, "--set", LONG, "--pace", SLOW, *bare, *apart, *arguments)

    def run(self, name: str, *arguments: str | Path) -> tuple[int, str, str]:
        """Run a command to its end; return exit code, output and errors."""
        return self.end(self.start(name, *arguments))

    def ask(self, name: str, *arguments: str | Path) -> tuple[int, str, str]:
        """The same in this process: for what asks a run and ends, where no interpreter need start."""
        (entry,) = entry_points(group="console_scripts", name=name)
        out, err = io.StringIO(), io.StringIO()
        with pytest.MonkeyPatch.context() as patch, redirect_stdout(out), redirect_stderr(err):
            patch.chdir(self.folder)
            patch.setattr(sys, "argv", [name, *map(str, arguments)])
            with pytest.raises(SystemExit) as ended:
                entry.load()()
        return int(ended.value.code or 0), out.getvalue(), err.getvalue()

    @staticmethod
    def end(process: subprocess.Popen[str]) -> tuple[int, str, str]:
        """Wait for a process to end; return exit code, output and errors."""
        out, err = process.communicate(timeout=LIMIT_S)
        return process.returncode, out, err

    @staticmethod
    def read_until(stream: IO[str] | None, text: str) -> str:
        """Read lines until one has this text; return it."""
        assert stream is not None
        for line in stream:
            if text in line:
                return line
        raise AssertionError(f"the output ended without {text!r}")

    def live(self) -> RunFolder:
        """The run that is live, as soon as one is; a start that failed has none and says why."""

        def begun() -> list[RunFolder]:
            folders = live_runs()
            if not folders and self.started and self.started[-1].poll() is not None:
                raise AssertionError("\n".join(self.end(self.started[-1])[1:]))
            return folders

        return wait_for("a live run", begun)[0]

    def info(self) -> RunInfo:
        """Its run file, once clients can find it."""
        folder = self.live()

        def complete() -> RunInfo | None:
            info = folder.info()
            return info if info is not None and info.radio else None

        return wait_for("the radio plane's address", complete)

    def ticking(self, ticks: int = 1) -> dict[str, Any]:
        """The status of the live run, once it has come so far."""
        connected: list[control.Control] = []

        def status() -> dict[str, Any] | None:
            with suppress(Refused):
                if not connected:
                    connected.append(stack.enter_context(control.connect()))
                content = connected[0].status()
                return content if content["ticks"] >= ticks else None
            return None

        self.live()
        with ExitStack() as stack:
            return wait_for(f"tick {ticks}", status)

    def pid_of(self, process: str) -> int:
        """The process id of a process of the live run."""
        info = self.info()
        if process == "supervisor":
            return info.pid
        addresses = [f"--connect {address}" for address in (info.simulation, f"run:{info.run}", info.radio)]
        shared = processes_with(f"foosim role roles {process} ")
        for pid, line in shared.items():
            if any(f"{mark} " in line for mark in (f"--run {info.run}", *addresses[:2])):
                return pid
        marks = {"vhub": "foosim role vhub"}
        mark = marks.get(process, f"--name {process}")
        (pid,) = [
            pid for address in addresses for pid, line in processes_with(address).items() if f"{mark} " in f"{line} "
        ]
        return pid

    def kill(self, process: str, number: signal.Signals = signal.SIGKILL) -> None:
        os.kill(self.pid_of(process), number)


@pytest.fixture
def house(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[House]:
    """A place for runs; whatever a test leaves running is killed, children with their launcher."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.setenv("COLUMNS", "200")
    monkeypatch.setattr(control, "CONNECT_S", LIMIT_S)
    made = House(tmp_path)
    yield made
    for process in made.started:
        if process.poll() is None:
            process.kill()
        process.communicate()
