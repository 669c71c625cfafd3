"""The connection of a role to a plane: reads and publishes by the table of channels, under the role's name.

Roles of one process hand each other messages over the in-memory bus, and share the plane's session for all others.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from foosim.protocol.channels import ALIVE, CHANNELS, Channel, Plane
from foosim.runtime.roles.bus import Bus
from foosim.runtime.transport.inbox import Inbox
from foosim.runtime.transport.session import Publisher, Session

_BY_KEY: Final = {channel.key.removesuffix("/{name}"): channel for channel in CHANNELS}
_NAMED: Final = "/{name}"
_STEM: Final = {plane: ALIVE[plane].partition("/alive/")[0] for plane in Plane}
"""What all keys of a plane begin with."""


class Wire:
    """One role on one plane: reads and publishes by the table of channels, under its own name."""

    def __init__(self, session: Session, plane: Plane, inbox: Inbox, name: str, bus: Bus | None = None) -> None:
        """`bus` joins the roles of the process; None for a process with one role."""
        self.session = session
        self.plane = plane
        self.name = name
        self._inbox = inbox
        self._bus = bus
        self._publishers: dict[str, Publisher] = {}

    def read(self, reads: Sequence[tuple[Channel, bool]], waits: Sequence[Channel] = ()) -> None:
        """Read these channels: (channel, whether only messages to this name).

        `waits` are those in whose queues the reader of a process with one role itself waits: the fastest path, for
        messages of every tick. With `on_offer`, its inbox has no reader that waits.
        """
        here = [(channel, own) for channel, own in reads if channel.plane is self.plane]
        if self._bus is not None:
            self._bus.subscribe(self.name, here)
            if self.session.is_open_router and self.plane is Plane.SIMULATION:
                self._receive_plane()
                return
        in_queue = waits if self._bus is None and self._inbox.on_offer is None else ()
        mine = {channel.key for channel, own in here if own}
        wanted = {channel.key for channel, _ in here}

        def read_key(key: str) -> tuple[str, str] | None:
            known = channel_of(key)
            if known is None or known[0].key not in wanted or (known[0].key in mine and known[1] != self.name):
                return None
            return known[0].key, known[1]

        for channel, own in here:
            key = channel.key_for(self.name) if own else channel.key_for_all
            if channel in in_queue:
                self.session.receive(key, channel.key, read_key, self._inbox)
            else:
                self.session.subscribe(key, channel.key, self._inbox)

    def _receive_plane(self) -> None:
        """Let the reader of the process wait for all that others publish on the plane, once for all of its roles.

        Nearly all messages to the router of a plane are for roles of its process. A thread for each channel costs
        another wake-up a message.
        """
        stem = _STEM[self.plane]
        if not self._inbox.has(stem):
            self.session.receive(stem, stem, _read_key, self._inbox)

    def put(self, channel: Channel, name: str, payload: bytes) -> None:
        """Publish on a channel; `name` is the sender, or the receiver where one is addressed."""
        if self._bus is not None:
            self._bus.put(self.name, channel, name, payload, 0)  # at one time, so in the order of their numbers
        key = channel.key_for(name)
        publisher = self._publishers.get(key)
        if publisher is None:
            publisher = self._publishers[key] = self.session.publisher(key, channel.blocking)
        publisher.put(payload)

    def declare_alive(self) -> None:
        """Declare presence under this name, after admission, since one name has one presence."""
        self.session.declare_alive(ALIVE[self.plane].replace("{name}", self.name))

    def watch_alive(self, name: str = "*") -> None:
        """Observe the presence of roles."""
        key = ALIVE[self.plane].replace("{name}", name)
        self.session.watch_alive(key, presence_channel(self.plane, self.name), self._inbox)

    def close(self) -> None:
        """End the presence of this role, which has ended before its process."""
        self.session.end_alive(ALIVE[self.plane].replace("{name}", self.name))


def presence_channel(plane: Plane, watcher: str) -> str:
    """Return the inbox's channel of the presence of roles on a plane, as one role watches it."""
    return f"{ALIVE[plane]} {watcher}"


def _read_key(key: str) -> tuple[str, str] | None:
    known = channel_of(key)
    return None if known is None else (known[0].key, known[1])


def channel_of(key: str) -> tuple[Channel, str] | None:
    """Return the channel that a key belongs to, and the name in it or its writers' role; None for any other key."""
    channel = _BY_KEY.get(key)
    if channel is not None and not channel.key.endswith(_NAMED):
        return channel, channel.writers
    stem, _, name = key.rpartition("/")
    channel = _BY_KEY.get(stem)
    return (channel, name) if channel is not None and channel.key.endswith(_NAMED) else None
