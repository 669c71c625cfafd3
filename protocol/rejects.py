"""Decodes messages from outside, and counts refusals by sender.

Each refusal is counted by channel and sender; the first few of each are logged with their first bytes. A sender with a
name that the deployment does not declare is quarantined after more than 100 refusals in a second: its messages are not
decoded. A declared name is not quarantined, because another process that may write under it could silence its owner;
it is logged as an error instead.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from foosim.common import limits
from foosim.common.errors import Malformed, Refused, show
from foosim.deployment.schema import Deployment
from foosim.protocol import channels
from foosim.protocol.actions import Log
from foosim.protocol.channels import SUPERVISOR, VHUB, Channel

LOGGED_EACH_MAX: Final = 3
"""How many refusals of a sender on a channel are logged."""
LOGGED_MAX: Final = 100
"""How many refusals are logged in all."""
LOGGED_BYTES_MAX: Final = 32
WINDOW_NS: Final = 1_000_000_000
REFUSALS_MAX: Final = 100
"""Refusals of one sender in one window, above which it is quarantined."""
QUARANTINE_NS: Final = 10_000_000_000
OTHERS: Final = "others"
"""The name for all senders beyond the separately counted ones."""


@dataclass(slots=True)
class _Sender:
    """The recent refusals of one sender."""

    since_ns: int
    count: int = 0
    until_ns: int = 0
    """End of its quarantine."""
    is_named: bool = False


class Quarantined(Malformed):
    """The message was not decoded, because its sender is in quarantine."""


class Refusals:
    """Decodes messages, and counts refusals."""

    def __init__(self, log: Callable[[Log], object], deployment: Callable[[], Deployment | None]) -> None:
        """`deployment` returns the deployment, which declares names; without one, every name counts as declared."""
        self.counts: dict[tuple[str, str], int] = {}
        """Refusals by channel and sender."""
        self._log = log
        self._logged = 0
        self._senders: dict[str, _Sender] = {}
        self._deployment = deployment

    def read(self, channel: Channel, name: str, payload: bytes, now_ns: int) -> Any:
        """Return the message that arrived on a channel's key of `name`, or raise `Malformed`."""
        if self._senders:
            sender = self._senders.get(name)
            if sender is not None and now_ns < sender.until_ns:
                raise Quarantined(f"{show(name)} is in quarantine")
        return channels.read(channel, name, payload)

    def refuse(self, channel: Channel, name: str, payload: bytes, error: Refused, now_ns: int) -> None:
        """Count a refusal, log it if it is one of the first, and quarantine its sender if it is one too many."""
        key = channel.name, name
        if key not in self.counts and len(self.counts) >= limits.CLIENTS_MAX:
            key = channel.name, OTHERS
        count = self.counts[key] = self.counts.get(key, 0) + 1
        if isinstance(error, Quarantined):
            return
        if count <= LOGGED_EACH_MAX and self._logged < LOGGED_MAX:
            self._logged += 1
            first = payload[:LOGGED_BYTES_MAX].hex()
            what = f"{error} ({len(payload)} bytes{': ' if first else ''}{first})"
            self._log(Log("warning", f"refused from {show_name(name)} on {channel.name}: {what}"))
        self._watch(name, now_ns)

    def _watch(self, name: str, now_ns: int) -> None:
        """Quarantine an undeclared sender with too many refusals; log a declared one."""
        sender = self._senders.get(name)
        if sender is None:
            if len(self._senders) >= limits.CLIENTS_MAX:
                self._senders.pop(next(iter(self._senders)))  # the oldest one
            sender = self._senders[name] = _Sender(now_ns)
        if now_ns - sender.since_ns >= WINDOW_NS:
            sender.since_ns, sender.count = now_ns, 0
        sender.count += 1
        deployment = self._deployment()
        if sender.count <= REFUSALS_MAX or deployment is None:
            return
        much = f"more than {REFUSALS_MAX} messages of {show_name(name)} were refused within a second"
        known = {SUPERVISOR, VHUB, *deployment.nodes, *deployment.players, *deployment.clients}
        if name not in known:
            sender.until_ns = now_ns + QUARANTINE_NS
            much += f": it is in quarantine for {QUARANTINE_NS // 10**9} s"
        if not sender.is_named:
            sender.is_named = True
            self._log(Log("error", much))

    def by_sender(self) -> dict[str, int]:
        """Return the counts by `channel sender`, for display."""
        return {f"{channel} {show_name(name)}": count for (channel, name), count in sorted(self.counts.items())}


def show_name(name: str) -> str:
    """Return a name from a key, escaped and shortened for a log: keys are not checked."""
    return name if name.isascii() and name.isprintable() and len(name) <= limits.NAME_LENGTH_MAX else show(name)
