"""What comes from outside is read here or refused, and refusals are counted by whom.

Each refusal is counted by channel and sender; the first few of each are logged with their first bytes, for whoever has
to find out. A stranger, under a name that the deployment does not declare, who is refused more than 100 times in a
second is in quarantine for a while: what comes under that name is not even decoded. A declared name is not, since
whoever may write under it could otherwise silence its owner; it is named as an error instead.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from foosim.common import limits
from foosim.common.errors import Malformed, Refused, show
from foosim.deployment.schema import Deployment
from foosim.protocol import channels
from foosim.protocol.actions import Say
from foosim.protocol.channels import SUPERVISOR, VHUB, Channel

TOLD_EACH: Final = 3
"""How many refusals of a sender on a channel are logged."""
TOLD_MAX: Final = 100
"""How many are logged in all."""
BYTES_TOLD: Final = 32
WINDOW_NS: Final = 1_000_000_000
REFUSALS_MAX: Final = 100
"""In one window, from one sender."""
QUARANTINE_NS: Final = 10_000_000_000
OTHERS: Final = "others"
"""Under what senders are counted when there are too many of them to count each."""


@dataclass(slots=True)
class _Sender:
    """What one sender was refused lately."""

    since_ns: int
    count: int = 0
    until_ns: int = 0
    """End of its quarantine."""
    is_named: bool = False


class Quarantined(Malformed):
    """It was not looked at: too much that came under this name was refused."""


class Refusals:
    """Reads what comes, and keeps the account of what is refused."""

    def __init__(self, say: Callable[[Say], object], deployment: Callable[[], Deployment | None]) -> None:
        """`deployment` declares who is no stranger; before there is one, everybody may be declared."""
        self.counts: dict[tuple[str, str], int] = {}
        """Refusals by channel and sender."""
        self._say = say
        self._told = 0
        self._senders: dict[str, _Sender] = {}
        self._deployment = deployment

    def read(self, channel: Channel, name: str, payload: bytes, now_ns: int) -> Any:
        """Return the message that came on a channel's key of `name`, or raise `Malformed`."""
        if self._senders:
            sender = self._senders.get(name)
            if sender is not None and now_ns < sender.until_ns:
                raise Quarantined(f"{show(name)} is in quarantine")
        return channels.read(channel, name, payload)

    def refuse(self, channel: Channel, name: str, payload: bytes, error: Refused, now_ns: int) -> None:
        """Count a refusal; log it if it is one of the first; see whether it was one too many."""
        key = channel.name, name
        if key not in self.counts and len(self.counts) >= limits.CLIENTS_MAX:
            key = channel.name, OTHERS
        count = self.counts[key] = self.counts.get(key, 0) + 1
        if isinstance(error, Quarantined):
            return
        if count <= TOLD_EACH and self._told < TOLD_MAX:
            self._told += 1
            first = payload[:BYTES_TOLD].hex()
            what = f"{error} ({len(payload)} bytes{': ' if first else ''}{first})"
            self._say(Say("warning", f"refused from {show_name(name)} on {channel.name}: {what}"))
        self._watch(name, now_ns)

    def _watch(self, name: str, now_ns: int) -> None:
        """Put a stranger with too many refusals into quarantine, name anybody else."""
        sender = self._senders.get(name)
        if sender is None:
            if len(self._senders) >= limits.CLIENTS_MAX:
                self._senders.pop(next(iter(self._senders)))  # the one that was first
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
            self._say(Say("error", much))

    def by_sender(self) -> dict[str, int]:
        """Return the counts by `channel sender`, for people."""
        return {f"{channel} {show_name(name)}": count for (channel, name), count in sorted(self.counts.items())}


def show_name(name: str) -> str:
    """A name from a key as it may stand in a log: keys are not checked for what stands in them."""
    return name if name.isascii() and name.isprintable() and len(name) <= limits.NAME_LENGTH_MAX else show(name)
