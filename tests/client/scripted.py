"""A program that uses the client library, within a rehearsal: it runs while it has the turn, and waits otherwise."""

from __future__ import annotations

from collections.abc import Callable
from threading import Semaphore, Thread
from typing import Any

from foosim.client.client import Client
from foosim.client.core import ClientCore
from foosim.common.errors import Refused

Script = Callable[[Client], None]


class _Link:
    """The client's connection, whose `wait` gives the turn back to the rehearsal."""

    def __init__(self, core: ClientCore) -> None:
        self.core = core
        self.closed = False
        self.to_program, self.to_system = Semaphore(0), Semaphore(0)

    def perform(self) -> None:
        """The rehearsal performs the core's actions after the turn."""

    def close(self) -> None:
        self.closed = True

    def wait(self, reached: Callable[[], bool], timeout_s: float | None) -> None:
        """Wait for turns until something is reached; with a time, which nobody knows here, for one turn."""
        while not reached():
            self.to_system.release()
            self.to_program.acquire()
            if timeout_s is not None:
                return


class Program:
    """Runs a script with a client: `Settings(clients={"hand": Program(script)})`. What it raises the rehearsal does."""

    def __init__(self, *scripts: Script) -> None:
        """Of several, each gets a client of its own, which knows nothing of the one before."""
        self._scripts = scripts
        self.error: BaseException | None = None
        self.is_over = False

    def __call__(self, core: ClientCore) -> Callable[[int], None]:
        link = _Link(core)

        def run() -> None:
            link.to_program.acquire()
            try:
                assert core.deployment is not None
                for script in self._scripts:
                    its: Any = link
                    script(Client(its, core.deployment))
            except BaseException as error:  # noqa: BLE001  # raised in the rehearsal's thread
                self.error = error
            self.is_over = True
            link.to_system.release()

        thread = Thread(target=run, daemon=True)
        thread.start()

        def turn(now_ns: int) -> None:
            if core.deployment is None:
                return
            if not self.is_over:
                link.to_program.release()
                link.to_system.acquire()
            if self.is_over and core.go is not None:
                core.done([])
            if self.error is not None:
                error, self.error = self.error, None
                raise error

        return turn


def refused(call: Callable[[], object]) -> str:
    """Return what a call is refused with."""
    try:
        call()
    except Refused as error:
        return f"{type(error).__name__}: {error}"
    return ""
