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
from hashlib import blake2b
from importlib.metadata import version
from pathlib import Path
from typing import IO, Annotated, Final

import typer

from foosim.common.errors import BadValue, Failed
from foosim.common.names import NAME_RULE, is_name
from foosim.runtime.children import BY_SIGNAL, GRACE_S, GUARD, OTHER_VERSION, child_environment, script
from foosim.runtime.command import DONE, new_app
from foosim.runtime.run_folder import hosted_folder

BLOCK_BYTES: Final = 1 << 20
TAKE_OVER_S: Final = 10.0

Run = Annotated[str, typer.Argument(help="Which run.", show_default=False)]
VersionOfLauncher = Annotated[str, typer.Option(help="Refuse another version of foosim than this.")]
File = Annotated[str, typer.Argument(help="Which file of the run's folder.", show_default=False)]


def run_folder(run: str) -> Path:
    """Return the folder of a run on this machine, on which its supervisor is not."""
    if not is_name(run):
        raise BadValue(f"not a run: {NAME_RULE}", run)
    return hosted_folder() / run


class Guard:
    """One process of a run, and the end of the connection that it depends on."""

    def __init__(self, run: str, name: str) -> None:
        if not is_name(name):
            raise BadValue("not a name for a process", name)
        self.folder = run_folder(run)
        self.folder.mkdir(parents=True, exist_ok=True)
        self._lock_path = self.folder / f"{name}.guard"
        self._lock = self._take_over()
        self._process: subprocess.Popen[bytes] | None = None
        self._is_over = threading.Event()

    def _take_over(self) -> int:
        """Be the one guard of this process: an earlier one, whose connection is gone unnoticed, is killed."""
        deadline_s = time.monotonic() + TAKE_OVER_S
        while True:
            lock = os.open(self._lock_path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                earlier = os.pread(lock, 32, 0).decode("ascii", "replace").strip()
                if time.monotonic() > deadline_s:
                    raise Failed(f"{self._lock_path} is held by guard {earlier}, which does not end") from None
                if earlier.isdigit():
                    with suppress(ProcessLookupError):
                        os.kill(int(earlier), signal.SIGKILL)  # it holds the lock, so the number is its own
            else:
                if self._is_there(lock):
                    os.ftruncate(lock, 0)
                    os.pwrite(lock, str(os.getpid()).encode(), 0)
                    return lock
            os.close(lock)
            time.sleep(0.05)

    def _is_there(self, lock: int) -> bool:
        """Whether the lock is still the one in the folder: who had it before may have removed it with the folder."""
        try:
            return os.path.samestat(os.fstat(lock), self._lock_path.stat())
        except FileNotFoundError:
            self.folder.mkdir(parents=True, exist_ok=True)
            return False

    def run(self, command: list[str]) -> int:
        """Run the command to its end, or to that of the connection; return its exit code, 128 + N for signal N."""
        end, hold = os.pipe()
        self._process = subprocess.Popen(
            [script(command[0]), *command[1:]],
            stdin=subprocess.DEVNULL,
            cwd=self.folder,
            env=child_environment(end),
            pass_fds=(end,),
            process_group=0,
        )
        for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
            signal.signal(number, lambda number, frame: self._end_soon())
        threading.Thread(target=self._watch, name="connection", daemon=True).start()
        code = self._process.wait()
        self._is_over.set()
        self._signal(signal.SIGKILL)  # whatever it has started
        os.close(hold)
        os.close(end)
        self._leave()
        return BY_SIGNAL - code if code < 0 else code

    def _leave(self) -> None:
        """Leave nothing behind but what the process wrote."""
        self._lock_path.unlink(missing_ok=True)
        os.close(self._lock)
        with suppress(OSError):  # others work there, or left something
            self.folder.rmdir()

    def _watch(self) -> None:
        """Wait for the end of the connection, which nobody writes to."""
        while os.read(sys.stdin.fileno(), 4096):
            pass
        self._end()

    def _end_soon(self) -> None:
        threading.Thread(target=self._end, name="end", daemon=True).start()

    def _end(self) -> None:
        """End the process: it has some time to do so in order."""
        self._signal(signal.SIGTERM)
        if not self._is_over.wait(GRACE_S):
            self._signal(signal.SIGKILL)

    def _signal(self, number: signal.Signals) -> None:
        assert self._process is not None
        try:
            os.killpg(self._process.pid, number)
        except ProcessLookupError:
            return


def send(run: str, file: str) -> None:
    """Write a capture of the run, with the files that it goes on in, to standard output.

    For each a line with its number and size, its bytes, a line with their digest; at the end a line that says so.
    """
    from foosim.capture.parts import parts_at  # a guard of a process starts quickly

    whole = run_folder(run) / file
    out = sys.stdout.buffer
    for number, path in (parts_at(whole) or {0: whole}).items():
        try:
            _send_file(number, path, out)
        except OSError as error:
            raise Failed(f"{path}: {error.strerror}") from None
    out.write(b"end\n")
    out.flush()


def _send_file(number: int, path: Path, out: IO[bytes]) -> None:
    digest = blake2b(digest_size=32)
    with path.open("rb") as content:
        left = os.fstat(content.fileno()).st_size
        out.write(f"{number} {left}\n".encode())
        while left > 0 and (block := content.read(min(left, BLOCK_BYTES))):
            left -= len(block)
            digest.update(block)
            out.write(block)
    out.write(f"{digest.hexdigest()}\n".encode())


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
    name: Annotated[str, typer.Argument(help="Which process of it.", show_default=False)],
    command: Annotated[list[str], typer.Argument(help="What to start.", show_default=False)],
    version_of_launcher: VersionOfLauncher = "",
) -> None:
    """Run a process of a run until standard input ends."""
    _check_version(version_of_launcher)
    raise typer.Exit(Guard(run, name).run(command))


@app.command("examine")
def examine_command(version_of_launcher: VersionOfLauncher = "") -> None:
    """Answer a doctor on another machine how this one is, over standard input and output."""
    _check_version(version_of_launcher)
    from foosim.launcher.doctor.remote import serve  # a guard of a process starts quickly

    serve(sys.stdin.buffer, sys.stdout.buffer)
    raise typer.Exit(DONE)


@app.command("send")
def send_command(run: Run, file: File) -> None:
    """Write a capture in a run's folder to standard output, with the files that it goes on in and their digests."""
    send(run, file)
    raise typer.Exit(DONE)


@app.command("forget")
def forget_command(run: Run) -> None:
    """Remove the folder of a run that is over."""
    shutil.rmtree(run_folder(run), ignore_errors=True)
    raise typer.Exit(DONE)
