"""The loop of every process: passes messages to its roles, in a fixed order, and sleeps until a message or a deadline.

Messages between the roles of a process go over the in-memory bus. One round takes what has come, gives each role that
has something its turn, and, when no message is left on the bus, does one piece of long work.
"""

from __future__ import annotations

import gc
import logging
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from foosim.protocol.channels import CHANNELS, Channel, Plane
from foosim.runtime import GC_THRESHOLDS
from foosim.runtime.health import EVERY_NS, ProgressFile
from foosim.runtime.roles.bus import Bus
from foosim.runtime.roles.role import Letter, Role
from foosim.runtime.roles.standstill import Standstill
from foosim.runtime.roles.wire import presence_channel
from foosim.runtime.systemd import Notify
from foosim.runtime.transport.inbox import Inbox, Item

NS_PER_S: Final = 1_000_000_000
NEVER_NS: Final = 2**63 - 1


def collect_seldom() -> None:
    """Exclude the loaded objects from garbage collection, and make collections rare."""
    gc.freeze()
    gc.set_threshold(*GC_THRESHOLDS)


class Loop:
    """Runs the roles of a process on one thread."""

    def __init__(self, inbox: Inbox, log: logging.Logger, bus: Bus | None = None) -> None:
        """`bus` joins several roles; a process with one role has none."""
        self.roles: list[Role] = []
        """In the order of their turns."""
        self.notify = Notify({})
        """Notifies a service manager that the loop advances; none by default."""
        self._inbox = inbox
        self._log = log
        self._bus = bus
        self._channels: dict[str, Channel] = {channel.key: channel for channel in CHANNELS}
        self._presence: dict[str, tuple[Plane, Role]] = {}
        self._standstill = Standstill(time.monotonic_ns())
        self._progress: ProgressFile | None = None
        self._sign_ns = NEVER_NS
        self._has_work = False

    def show_progress(self, path: Path | None) -> None:
        """Write the loop's progress to this file; do nothing without a path. Raises Failed."""
        if path is not None:
            self._progress = ProgressFile(path)
            self._sign_ns = 0

    def add(self, role: Role) -> None:
        """Add a role, whose turns come after those of the others. Only a loop with a bus has more than one."""
        assert self._bus is not None or not self.roles, "several roles need a bus"
        role.wake_ns = time.monotonic_ns()
        self.roles.append(role)
        self._presence |= {presence_channel(plane, role.name): (plane, role) for plane in Plane}

    def remove(self, role: Role) -> None:
        """Remove a role that has ended."""
        self.roles.remove(role)
        for plane in Plane:
            self._presence.pop(presence_channel(plane, role.name), None)
        if self._bus is not None:
            role.close()
            self._bus.unsubscribe(role.name)

    def begin(self) -> None:
        """Begin the first round."""
        collect_seldom()
        self.notify.ready(time.monotonic_ns())

    def next_ns(self) -> int:
        """When the next round is due without a message (monotonic clock); 0 while there is work left."""
        return 0 if self._is_busy else self._due_ns()

    def go_round(self, *, sleeps: bool = True) -> None:
        """Sleep until a message or a deadline, unless another loop does that; handle what has come and is due."""
        due_ns = self._due_ns()
        items = self._take(due_ns) if sleeps else self._inbox.take(0)
        now_ns = time.monotonic_ns()
        stood_ns = self._standstill.look(due_ns, now_ns)
        if stood_ns:
            for role in self.roles:
                role.stood(stood_ns, now_ns)
        self.notify.progress(now_ns)
        if self._bus is None:
            self._turn_alone(items, now_ns)
        else:
            self._turn_all(items, self._bus, now_ns)
        if now_ns >= self._sign_ns:
            self._sign(now_ns)

    def perform(self) -> None:
        """Perform the actions of all roles."""
        for role in self.roles:
            role.perform()

    def _due_ns(self) -> int:
        return min([self._sign_ns, *(role.wake_ns for role in self.roles)])

    @property
    def _is_busy(self) -> bool:
        return self._has_work or not (self._bus is None or self._bus.is_empty)

    def _take(self, due_ns: int) -> list[Item]:
        """Return the messages from other processes; wait for them while no role has anything to do."""
        if self._is_busy:
            return self._inbox.take(0)
        lacking = self.roles[0].lacking() if self._bus is None and self.roles else None
        lacks, count = ("", 1) if lacking is None else (lacking[0].key, lacking[1])
        return self._inbox.take(max(0, due_ns - time.monotonic_ns()) / NS_PER_S, lacks, count)

    def _turn_alone(self, items: Sequence[Item], now_ns: int) -> None:
        """Give the only role its turn."""
        (role,) = self.roles
        letters: list[Letter] = []
        for key, name, payload in items:
            channel = self._channels.get(key)
            if channel is not None:
                letters.append((channel, name, payload))
            elif key in self._presence:
                role.on_alive(self._presence[key][0], name, payload == b"+")
        role.take_turn(letters, now_ns)
        while role.do_work(now_ns):
            pass
        role.ended_turn(now_ns, time.monotonic_ns())

    def _turn_all(self, items: Sequence[Item], bus: Bus, now_ns: int) -> None:
        """Give each role a turn that has a message or a deadline, then do one piece of work when the bus is empty."""
        letters: dict[str, list[Letter]] = {}
        while not bus.is_empty:
            _, _, reader, channel, name, payload = bus.pop()
            letters.setdefault(reader, []).append((channel, name, payload))
        for key, name, payload in items:
            known = self._channels.get(key)
            if known is not None:
                for reader in bus.readers(known, name):
                    letters.setdefault(reader, []).append((known, name, payload))
            elif key in self._presence:
                plane, watcher = self._presence[key]
                watcher.on_alive(plane, name, payload == b"+")
                letters.setdefault(watcher.name, [])
        is_woken = not letters
        for role in tuple(self.roles):  # a turn may add a role
            mail = letters.get(role.name)
            if mail is not None or is_woken or now_ns >= role.wake_ns:
                begun_ns = time.monotonic_ns()
                role.take_turn(mail or [], begun_ns)
                role.ended_turn(begun_ns, time.monotonic_ns())
        self._has_work = False
        if bus.is_empty:
            for role in self.roles:
                begun_ns = time.monotonic_ns()
                if role.do_work(begun_ns):
                    role.ended_turn(begun_ns, time.monotonic_ns())
                    self._has_work = True
                    return

    def _sign(self, now_ns: int) -> None:
        assert self._progress is not None, "signs are due only when there is a file for them"
        self._sign_ns = now_ns + EVERY_NS
        try:
            self._progress.write(now_ns)
        except OSError as error:  # the sign gets old; the run itself is not affected
            self._log.warning("the progress file could not be written: %s", error.strerror)
