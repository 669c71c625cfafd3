"""The command `foosim guard`: the launcher's hand on another machine, at the far end of an ssh connection.

It starts one process of a run and ends it when its standard input ends, that is when the connection or the launcher
does: first by SIGTERM, then by SIGKILL to the whole process group. When the guard itself is killed, the process dies
with it. It also sends home what a run has left on its machine. A run has a folder here, in which its processes work.
"""

from __future__ import annotations

import fcntl
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from contextlib import suppress
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Final

import typer

from foosim.common.errors import BadValue, Failed
from foosim.common.names import NAME_RULE, is_name
from foosim.runtime.command import DONE, new_app
from foosim.runtime.process import BY_SIGNAL, GRACE_S, GUARD, OTHER_VERSION, child_environment, script
from foosim.runtime.run_folder import hosted_folder

TAKE_OVER_S: Final = 10.0

Run = Annotated[str, typer.Argument(help="Which run.")]
VersionOfLauncher = Annotated[str, typer.Option(help="Refuse another version of foosim than this.")]
File = Annotated[str, typer.Argument(help="Which file of the run's folder.")]


def run_folder(run: str) -> Path:
    """Return the folder of a run on this machine, on which its supervisor is not."""
    if not is_name(run):
        raise BadValue(f"not a run: {NAME_RULE}", run)
    return hosted_folder() / run


def guard(run: str, name: str, command: list[str]) -> int:
    """Run a command to its end, or to that of the connection; return its exit code, 128 + N for signal N."""
    if not is_name(name):
        raise BadValue("not a name for a process", name)
    folder = run_folder(run)
    path = folder / f"{name}.guard"
    lock = _take_over(path)
    end, hold = os.pipe()
    process = subprocess.Popen(
        [script(command[0]), *command[1:]],
        stdin=subprocess.DEVNULL,
        cwd=folder,
        env=child_environment(end),
        pass_fds=(end,),
        process_group=0,
    )

    def send(number: int) -> None:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, number)

    def end_process() -> None:
        """End it: it has some time to do so in order."""
        send(signal.SIGTERM)
        try:
            process.wait(GRACE_S)
        except subprocess.TimeoutExpired:
            send(signal.SIGKILL)

    def watch() -> None:
        """Wait for the end of the connection, which carries no data."""
        while os.read(sys.stdin.fileno(), 4096):
            pass
        end_process()

    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        signal.signal(number, lambda number, frame: threading.Thread(target=end_process, daemon=True).start())
    threading.Thread(target=watch, name="connection", daemon=True).start()
    code = process.wait()
    send(signal.SIGKILL)  # whatever it has started
    os.close(hold)
    os.close(end)
    path.unlink(missing_ok=True)
    os.close(lock)
    with suppress(OSError):  # others work there, or its files are there
        folder.rmdir()
    return BY_SIGNAL - code if code < 0 else code


def _take_over(path: Path) -> int:
    """Be the one guard of a process: an earlier one, whose connection is gone unnoticed, is killed."""
    deadline_s = time.monotonic() + TAKE_OVER_S
    while True:
        path.parent.mkdir(parents=True, exist_ok=True)
        lock = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            earlier = os.pread(lock, 32, 0).decode("ascii", "replace").strip()
            if time.monotonic() > deadline_s:
                raise Failed(f"{path} is held by guard {earlier}, which does not end") from None
            if earlier.isdigit():
                with suppress(ProcessLookupError):
                    os.kill(int(earlier), signal.SIGKILL)  # it holds the lock, so the number is its own
        else:
            with suppress(FileNotFoundError):  # the former holder of the lock may have removed it with the folder
                if os.path.samestat(os.fstat(lock), path.stat()):
                    os.ftruncate(lock, 0)
                    os.pwrite(lock, str(os.getpid()).encode(), 0)
                    return lock
        os.close(lock)
        time.sleep(0.05)


def _check_version(version_of_launcher: str) -> None:
    """End this process when the launcher has another version of foosim."""
    here = version("foosim")
    if version_of_launcher not in ("", here):
        print(f"{GUARD}: foosim {here} is installed there, the run has {version_of_launcher}", file=sys.stderr)
        raise typer.Exit(OTHER_VERSION)


app = new_app()


@app.callback()
def guard_group() -> None:
    """Serve a launcher that is on another machine; `foosim up` calls this through ssh."""


@app.command("run", context_settings={"ignore_unknown_options": True, "allow_interspersed_args": False})
def run_command(
    run: Run,
    name: Annotated[str, typer.Argument(help="Which process of it.")],
    command: Annotated[list[str], typer.Argument(help="What to start.")],
    version_of_launcher: VersionOfLauncher = "",
) -> None:
    """Run a process of a run until standard input ends."""
    _check_version(version_of_launcher)
    raise typer.Exit(guard(run, name, command))


@app.command("examine")
def examine_command(version_of_launcher: VersionOfLauncher = "") -> None:
    """Answer a doctor on another machine how this one is, over standard input and output."""
    _check_version(version_of_launcher)
    from foosim.launcher.doctor import serve  # a guard of a process starts quickly

    serve(sys.stdin.buffer, sys.stdout.buffer)
    raise typer.Exit(DONE)


@app.command("send")
def send_command(run: Run, file: File) -> None:
    """Write a capture in a run's folder to standard output: a tar file of its files, by number, with checksums."""
    import gzip  # a guard of a process starts quickly
    import tarfile

    from foosim.capture.parts import parts_at

    whole = run_folder(run) / file
    with (
        gzip.GzipFile(fileobj=sys.stdout.buffer, mode="wb", compresslevel=1) as packed,
        tarfile.open(fileobj=packed, mode="w|") as sent,
    ):
        for number, path in (parts_at(whole) or {0: whole}).items():
            try:
                sent.add(path, str(number))
            except OSError as error:
                raise Failed(f"{path}: {error.strerror}") from None


@app.command("forget")
def forget_command(run: Run) -> None:
    """Remove the folder of a run that is over."""
    shutil.rmtree(run_folder(run), ignore_errors=True)
    raise typer.Exit(DONE)
