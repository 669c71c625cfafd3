"""Work in child processes of this machine: runs of a sweep, games of a match, seeds of the swarm.

`apart` does one piece of work in a child of the thread that calls it, and waits. So each worker of any executor can
call it, a thread here or a process of a cluster: a child that is killed, crashes or takes too long costs its work only.
"""

from __future__ import annotations

import os
import pickle
import signal
import socket
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import contextmanager, redirect_stdout, suppress
from multiprocessing.connection import Connection
from pathlib import Path
from subprocess import DEVNULL, Popen
from traceback import format_exc
from typing import Any, Final, TypeVar

from foosim.common.errors import Failed
from foosim.runtime.process import end_with

CHILD: Final = "from foosim.simulation.workers import serve; serve()"
IDLE_S: Final = 60.0
"""A child without work for so long ends: workers of a cluster outlive a sweep."""

Item = TypeVar("Item")
Result = TypeVar("Result")


class Lost(Failed):
    """A child ended before its work was done, or had to be killed."""


class Child:
    """A process that does work of one thread."""

    def __init__(self) -> None:
        ours, theirs = socket.socketpair()
        with theirs:
            paths = os.pathsep.join(path or str(Path.cwd()) for path in sys.path)
            # A session of its own: Ctrl-C, which a terminal sends to a whole group, is for the process that prints.
            self._process = Popen(
                [sys.executable, "-c", CHILD, str(theirs.fileno()), str(os.getpid())],
                stdin=DEVNULL,
                pass_fds=[theirs.fileno()],
                env={**os.environ, "PYTHONPATH": paths},
                start_new_session=True,
            )
        self._connection = Connection(ours.detach())

    def begins(self, work: bytes) -> bool:
        """Send work; return whether the child has begun: one that was idle may have ended."""
        try:
            self._connection.send_bytes(work)
            self._connection.recv_bytes()
        except (EOFError, ConnectionError):
            return False
        return True

    def answer(self, limit_s: float | None) -> Any:
        """Return the answer of a child that has begun. Raises Lost."""
        try:
            if not self._connection.poll(limit_s):
                self.end()
                raise Lost(f"not done after {limit_s:g} s of wall time, its process was killed")
            return self._connection.recv()
        except (EOFError, ConnectionError):
            code = self._process.wait()
            self._end_group()
            raise Lost(f"its process {_ending(code)}") from None

    def end(self) -> None:
        """End the process now, and the processes that it has started."""
        if self._process.returncode is None:
            self._end_group()
        self._process.wait()

    def _end_group(self) -> None:
        with suppress(ProcessLookupError):
            os.killpg(self._process.pid, signal.SIGKILL)

    def __del__(self) -> None:
        self.end()


def _ending(code: int) -> str:
    return f"was killed by {signal.Signals(-code).name}" if code < 0 else f"ended with exit code {code}"


class _Children:
    """The children of a pool's threads."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._living: list[Child] = []
        self._is_over = False

    def add(self, child: Child) -> None:
        with self._lock:
            self._living.append(child)
            if self._is_over:
                child.end()

    def end(self) -> None:
        with self._lock:
            self._is_over = True
            for child in self._living:
                child.end()


class _Here(threading.local):
    """What a thread that calls `apart` has."""

    child: Child | None = None
    children: _Children | None = None


_here = _Here()


def apart(work: Callable[[Item], Result], item: Item, limit_s: float | None = None) -> Result:
    """Return `work(item)`, done in a child process of this thread within a limit of wall time.

    All of it is pickled. Raises Lost, and what the work raises, with the child's traceback as a note.
    """
    packed = pickle.dumps((work, item))
    child, _here.child = _here.child, None
    if child is None or not child.begins(packed):
        child = Child()
        if _here.children is not None:
            _here.children.add(child)
        child.begins(packed)
    result, error = child.answer(limit_s)
    _here.child = child
    if error is not None:
        raise error
    done: Result = result
    return done


@contextmanager
def executor_here(jobs: int) -> Iterator[Executor]:
    """Give an executor of `jobs` threads that may call `apart`; their children end with the context, amid work, too."""
    children = _Children()
    pool = ThreadPoolExecutor(jobs, "worker", initializer=setattr, initargs=(_here, "children", children))
    try:
        yield pool
    finally:
        pool.shutdown(wait=False, cancel_futures=True)
        children.end()
        pool.shutdown()


# --- in a child -------------------------------------------------------------------------------------------------------

_answers: Connection | None = None
"""To the process that this one is a child of."""


def serve() -> None:
    """Do the work of the parent until it ends, or has none for a minute."""
    global _answers  # noqa: PLW0603  # one in a process, as standard output is
    number, parent = map(int, sys.argv[1:])
    end_with(parent)
    os.set_inheritable(number, False)
    _answers = Connection(number)
    os.register_at_fork(after_in_child=_answers.close)  # what the work forks does not answer in place of this process
    while _answers.poll(IDLE_S):
        try:
            packed = _answers.recv_bytes()
        except EOFError:
            return
        _answers.send_bytes(b"begun")
        answer: tuple[Any, BaseException | None]
        try:
            work, item = pickle.loads(packed)
            with redirect_stdout(sys.stderr):
                answer = work(item), None
        except Exception as error:  # noqa: BLE001  # the parent raises it
            error.add_note(format_exc())
            answer = None, error
        _answers.send(answer)


def leave(result: object) -> None:
    """End this child amid its work, with a result: for a thread that cannot stop what the work hangs in."""
    assert _answers is not None, "only a child leaves"
    _answers.send((result, None))
    os._exit(1)
