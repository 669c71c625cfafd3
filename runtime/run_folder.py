"""The folder of a run: run file, logs, journals; with it control commands find the run.

Each run has a folder with its name, by default in the platform's state folder. Its supervisor keeps a lock on it while
it lives, so an ended run is never mistaken for a live one when its process id is used again. The run file has the
run's addresses.
"""

from __future__ import annotations

import fcntl
import os
import shutil
import time
from pathlib import Path
from typing import Any, Final, TypeVar

import msgspec
import platformdirs

from foosim.common import wall_clock
from foosim.common.errors import BadValue, Failed, Refused
from foosim.common.names import NAME_RULE, is_name, nearest_name

LOGS: Final = "logs"
KEPT_RUNS: Final = 20
"""How many runs that are over keep their folder."""
RUN_FILE: Final = "run.json"
RESULT_FILE: Final = "result.json"
LOCK_FILE: Final = "lock"
LAUNCHER_FILE: Final = "launcher"
LAUNCH_FILE: Final = "launch.json"
HOLD_TRIES: Final = 50
SPARE_FILE: Final = "spare"
SPARE_BYTES: Final = 64 * 1024
"""Kept on the disk while the run lives, so that its result can be written when the disk is full."""

Content = TypeVar("Content")


GATEWAY: Final = "gateway."
"""Before the name of a gateway, in the name of its file."""


class NoRun(Failed):
    """There is no such run, or none that is live."""


UNREADABLE: Final = (OSError, msgspec.DecodeError, UnicodeDecodeError, RecursionError)
"""How a file of a run fails that is missing or spoiled."""


class RunInfo(msgspec.Struct, frozen=True):
    """The content of a run file. `radio` is empty until the vHub reports its address, `pki` without certificates."""

    run: str
    world: str
    deployment: str
    pid: int
    started: str
    simulation: str
    radio: str = ""
    pki: str = ""


class Launch(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """How `up` was called: where it captures, empty where it does not, and its options as the launcher wrote them."""

    capture: str
    options: msgspec.Raw


class RunFolder:
    """The folder of one run."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.name = path.name
        self._lock: int | None = None
        self._launcher: int | None = None

    @property
    def logs(self) -> Path:
        return self.path / LOGS

    @property
    def journals(self) -> Path:
        return self.path / "journals"

    def log(self, process: str) -> Path:
        """Return the log file of one process."""
        return self.logs / f"{process}.log"

    def hold(self, *, has_spare: bool = True) -> None:
        """Lock the folder as its live supervisor, until this process ends. Raises NoRun when another one does.

        `has_spare`: keep space for the result on the disk.
        """
        self._lock = self._take(LOCK_FILE)
        if self._lock is None:
            raise NoRun(f"run {self.name} has a supervisor already")
        if has_spare:
            (self.path / SPARE_FILE).write_bytes(bytes(SPARE_BYTES))

    def hold_launcher(self) -> None:
        """Lock the folder as its run's launcher, until this process ends. Raises Refused when it has another one."""
        self._launcher = self._take(LAUNCHER_FILE)
        if self._launcher is None:
            raise Refused(f"run {self.name} is looked after by the launcher that started it")

    def _take(self, name: str) -> int | None:
        """Lock a file of the folder until this process ends; None when another process has it."""
        lock = os.open(self.path / name, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
        for _ in range(HOLD_TRIES):  # a test of the lock holds it for a moment, too
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                time.sleep(0.01)
                continue
            return lock
        os.close(lock)
        return None

    def write_launch(self, launch: Launch) -> None:
        """Write how the run was launched, so that it can be launched again."""
        _replace(self.path / LAUNCH_FILE, launch)

    def launch(self) -> Launch | None:
        """Return how the run was launched; None when no launcher did, or its file cannot be read."""
        return self._read(LAUNCH_FILE, Launch)

    def capture(self) -> Path | None:
        """Return the path of the capture that the run was launched with; None without one."""
        launch = self.launch()
        return None if launch is None or not launch.capture else Path(launch.capture)

    def is_fresh(self) -> bool:
        """Whether nothing has run in it yet."""
        return not any((self.path / name).exists() for name in (LAUNCHER_FILE, LAUNCH_FILE, LOCK_FILE, RUN_FILE))

    def is_left(self) -> bool:
        """Whether the run has lost its launcher and its supervisor, so that its processes are not restarted."""
        return (self.path / LAUNCHER_FILE).exists() and not is_locked(self.path / LAUNCHER_FILE) and not self.is_live()

    def release(self) -> None:
        """Release the lock after the run."""
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None

    def is_live(self) -> bool:
        """Whether a supervisor has locked the folder."""
        return is_locked(self.path / LOCK_FILE)

    def write_info(self, info: RunInfo) -> None:
        """Write the run file; a reader sees the old one or the new one."""
        _replace(self.path / RUN_FILE, info)

    def info(self) -> RunInfo | None:
        """Return the run file's content, or None while there is none."""
        return self._read(RUN_FILE, RunInfo)

    def write_result(self, result: dict[str, Any]) -> None:
        """Write how the run ended, on a disk that is full, too."""
        (self.path / SPARE_FILE).unlink(missing_ok=True)
        _replace(self.path / RESULT_FILE, result)

    def result(self) -> dict[str, Any] | None:
        """Return how the run ended, or None when it did not end in order."""
        return self._read(RESULT_FILE, dict[str, Any])

    def write_gateway(self, name: str, content: dict[str, Any]) -> None:
        """Write which programs are at a gateway. Raises OSError."""
        _replace(self.path / f"{GATEWAY}{name}.json", content)

    def gateways(self) -> dict[str, dict[str, Any]]:
        """Return which programs are at each gateway that has written it, by name."""
        files = sorted(self.path.glob(f"{GATEWAY}*.json"))
        found = {path.stem.removeprefix(GATEWAY): self._read(path.name, dict[str, Any]) for path in files}
        return {name: content for name, content in found.items() if content is not None}

    def _read(self, name: str, kind: type[Content]) -> Content | None:
        try:
            return msgspec.json.decode((self.path / name).read_bytes(), type=kind)
        except UNREADABLE:
            return None


def is_locked(path: Path) -> bool:
    """Whether a live process holds the lock of a file; False for a file that does not exist."""
    try:
        lock = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
    except FileNotFoundError:
        return False
    try:
        fcntl.flock(lock, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    finally:
        os.close(lock)
    return False


def _replace(path: Path, content: Launch | RunInfo | dict[str, Any]) -> None:
    fresh = path.with_name(path.name + ".new")
    fresh.write_bytes(msgspec.json.format(msgspec.json.encode(content)) + b"\n")
    fresh.replace(path)


def hosted_folder() -> Path:
    """Return the folder of the runs that have processes on this machine, and their supervisor elsewhere."""
    return platformdirs.user_state_path("foosim") / "hosts"


def runs_folder() -> Path:
    """Return the folder of all runs of this user."""
    return platformdirs.user_state_path("foosim") / "runs"


def create_run(world: str, name: str | None = None, stamp: str = "") -> RunFolder:
    """Make the folder of a new run, by default named by world and time; the oldest ones that are over go.

    `stamp` is that time, by default now.
    """
    if name is not None and not is_name(name):
        raise BadValue(f"--run: {NAME_RULE}", name)
    parent = runs_folder()
    if name is not None and (parent / name / LOGS).is_dir() and RunFolder(parent / name).is_fresh():
        return RunFolder(parent / name)  # made for us by the process that waits for the run
    parent.mkdir(parents=True, exist_ok=True)
    forget_old(parent)
    path = _make(parent, name or f"{world[:12]}-{stamp or wall_clock.now_stamp()}", is_free=name is None)
    folder = RunFolder(path)
    folder.logs.mkdir()
    folder.journals.mkdir()
    return folder


def _make(parent: Path, stem: str, *, is_free: bool) -> Path:
    """Make the folder itself: a name that is taken gets a number where it is free, else it is refused."""
    for number in range(1, 100):
        path = parent / (stem if number == 1 else f"{stem}-{number}")
        try:
            path.mkdir()
        except FileExistsError:
            if not is_free:
                raise Refused(f"there is a run {stem} already, in {path}") from None
            continue
        return path
    raise Refused(f"no free name for a run in {parent}")


def forget_old(parent: Path) -> None:
    """Remove the folders of all but the last runs that are over. A folder without a run file is just being made."""
    over = [folder for folder in _newest_first(parent) if not folder.is_live()]
    for folder in over[KEPT_RUNS - 1 :]:
        shutil.rmtree(folder.path, ignore_errors=True)


def _newest_first(parent: Path) -> list[RunFolder]:
    """Return the runs that have a run file, the newest first."""
    found = []
    for path in parent.iterdir() if parent.is_dir() else ():
        info = RunFolder(path).info()
        if info is not None:
            found.append((info.started, path.name, RunFolder(path)))
    return [folder for _, _, folder in sorted(found, key=lambda entry: entry[:2], reverse=True)]


def live_runs(parent: Path | None = None) -> list[RunFolder]:
    """Return the live runs in a folder, by default those of this user, the newest first."""
    return [folder for folder in _newest_first(parent or runs_folder()) if folder.is_live()]


def left_runs() -> list[RunFolder]:
    """Return this user's runs without launcher and supervisor, the newest first."""
    return [folder for folder in _newest_first(runs_folder()) if folder.is_left()]


def run_exists(name: str) -> bool:
    """Whether there is a folder of a run with this name."""
    return is_name(name) and (runs_folder() / name).is_dir()


def open_run(name: str) -> RunFolder:
    """Return the folder of a run by name, live or over. Raises NoRun."""
    path = runs_folder() / name
    if run_exists(name):
        return RunFolder(path)
    known = [folder.name for folder in _newest_first(runs_folder())]
    nearest = nearest_name(name, known)
    raise NoRun(f"no run {name!r}" + (f", nearest is {nearest}" if nearest else f" in {runs_folder()}"))


def find_run(name: str | None = None) -> RunFolder:
    """Return a live run: the newest one, or the one with this name. Raises NoRun."""
    if name is None:
        live = live_runs()
        if not live:
            raise NoRun("no run is live; foosim up FILE starts one")
        return live[0]
    folder = open_run(name)
    if not folder.is_live():
        raise NoRun(f"run {name} is over")
    if folder.info() is None:
        raise NoRun(f"run {name} is starting, and does not listen yet")
    return folder
