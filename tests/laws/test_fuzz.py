"""Law 7 by the thousand: hostile bytes on every channel that a process reads, into the real cores of a running world.

`make fuzz` brings 200,000 payloads for each channel, `make test` a few hundred. A payload is a true message of the run
with a part swapped, bytes flipped, put in or cut; or well-formed, with senders, epochs and ticks that are not so; or
noise. Nothing but the typed refusals may come of it: each is counted once, for its channel and sender. A core that took
something and ended by it makes room for a new one: messages of the trusted plane are believed.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator, Sequence
from itertools import islice
from typing import TYPE_CHECKING, Any, Final

import pytest

from foosim.common.errors import Malformed
from foosim.protocol import channels
from foosim.protocol.channels import CLIENT_READS, NODE_READS, SUPERVISOR, SUPERVISOR_READS, VHUB, VHUB_READS, Channel
from foosim.protocol.codec import encode
from foosim.protocol.rejects import OTHERS

if TYPE_CHECKING:
    from tests.laws.conftest import Disturbed, Fuzz, Running

READS: Final = {"n1": NODE_READS, VHUB: VHUB_READS, SUPERVISOR: SUPERVISOR_READS, "player-red": CLIENT_READS}
NAMES: Final = (
    "n1",
    "n2",
    VHUB,
    SUPERVISOR,
    "player-red",
    "player-blue",
    "nobody",
    "",
    "a/b",
    "*",
    "x" * 300,
    "\u202e",
)
TRUE: Final = 0.7
"""Share of what comes on the key that it would come on."""
FRESH: Final = 1_000
"""Payloads after which another core takes over: one that believed a forged epoch does little afterwards."""
ENDS: Final = (channels.END, channels.REFUSAL, channels.CLIENT_REFUSAL)
END: Final = 0.01
"""Share of the messages by which the core would end that it gets: each takes a new world."""
STEP_NS: Final = 1_000_000
Spoil = Callable[[random.Random, bytes], bytes]


def is_message(channel: Channel, name: str, payload: bytes) -> bool:
    try:
        channels.read(channel, name, payload)
    except Malformed:
        return False
    return True


class Target:
    """One process of a running world, to whom payloads are brought."""

    def __init__(
        self, who: str, running: type[Running], disturbed: Disturbed, spoil: Spoil, rng: random.Random
    ) -> None:
        self.who, self._spoil, self._rng = who, spoil, rng
        self._running = running()
        self._talk = disturbed.talk(rng.randrange(1 << 32))
        self._process = self._running.system.processes[who]
        self._now_ns = self._running.system.bus.now_ns

    @property
    def is_over(self) -> bool:
        return self._running.is_over(self.who)

    def payload(self, channel: Channel) -> bytes:
        known = self._running.said.get(f"{self.who} {channel.name}", ())
        while True:
            payload = self._any_payload(channel, known)
            if channel not in ENDS or self._rng.random() < END or not is_message(channel, self.who, payload):
                return payload

    def _any_payload(self, channel: Channel, known: Sequence[bytes]) -> bytes:
        rng = self._rng
        kind = rng.random()
        if known and kind < 0.6:
            return self._spoil(rng, rng.choice(known))
        if kind < 0.97:
            message = encode(self._talk.about(channel, self._running.tick))
            return message if kind < 0.85 else self._spoil(rng, message)
        return rng.randbytes(rng.randrange(80)) if kind < 0.9995 else bytes(channel.bytes_max + 1)

    def bring(self, channel: Channel, is_addressed: bool, payload: bytes) -> None:
        """Let the core take it, and go on as its shell would."""
        core: Any = self._process.core
        name = self._rng.choice(NAMES) if self._rng.random() > TRUE else self._true_name(channel, is_addressed)
        before = dict(core.refusals.counts)
        self._now_ns += STEP_NS
        core.receive(channel, name, payload, self._now_ns)
        after = core.refusals.counts
        changed = {key: count - before.get(key, 0) for key, count in after.items() if count != before.get(key, 0)}
        if not is_message(channel, name, payload):
            assert changed in ({(channel.name, name): 1}, {(channel.name, OTHERS): 1}), changed
        self._process.turn(self._now_ns)
        core.wake(self._now_ns)
        core.actions.clear()

    def _true_name(self, channel: Channel, is_addressed: bool) -> str:
        return self.who if is_addressed else self._rng.choice(("n1", "n2", VHUB, SUPERVISOR, "player-red"))


@pytest.mark.parametrize("who", READS)
def test_hostile_messages_are_refused_counted_and_end_nothing(
    fuzz: Fuzz, disturbed: Disturbed, running: type[Running], spoil: Spoil, who: str
) -> None:
    reads = READS[who]
    brought = 0

    def bring(rng: random.Random, count: int) -> Iterator[bytes]:
        nonlocal brought
        target: Target | None = None
        for number, (channel, is_addressed) in enumerate(islice(reads * (count // len(reads) + 1), count)):
            if target is None or target.is_over or number % FRESH == 0:
                target = Target(who, running, disturbed, spoil, rng)
            payload = target.payload(channel)
            yield payload
            target.bring(channel, is_addressed, payload)
            brought += 1

    fuzz.run(bring, len(reads))
    assert brought >= fuzz.payloads
