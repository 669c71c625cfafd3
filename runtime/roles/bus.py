"""The in-memory bus between the roles of one process: messages by time, routed by the table of channels.

Carries the same bytes on the same keys as Zenoh. A rehearsal runs all roles on it in virtual time, and can delay,
reorder and lose messages by seed; without such settings delivery is immediate and in order.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

from foosim.common import limits
from foosim.common.keyed_random import draw_key, draw_words, unit_interval
from foosim.protocol.channels import Channel


@dataclass(frozen=True)
class Weather:
    """Impairments of the bus: each message takes `delay_ns` plus up to `spread_ns`; `loss` is its loss probability.

    `repeat` is the probability that it is delivered twice.
    """

    seed: int = 0
    delay_ns: int = 0
    spread_ns: int = 0
    loss: float = 0.0
    repeat: float = 0.0


CALM: Final = Weather()
LATE_NS: Final = 2_000_000_000


Message = tuple[int, int, str, Channel, str, bytes]


class Bus:
    """Messages in flight, by (time, number). Names of receivers come from subscriptions."""

    def __init__(self, weather: Weather = CALM) -> None:
        self.now_ns = 0
        self.sent = 0
        self.weather = weather
        self._key = draw_key(weather.seed, "bus")
        self._heap: list[Message] = []
        self._readers: dict[tuple[str, str], list[str]] = {}
        """By channel key and addressed process; the empty name holds the readers of the whole channel."""
        self._mute: dict[str, int] = {}
        self._deaf: dict[str, int] = {}
        self._repeat_until_ns = 0
        self._clogged: dict[str, int] = {}
        """Virtual times until which a process's output is dropped, its input is dropped, and both are delayed."""

    def subscribe(self, process: str, reads: Iterable[tuple[Channel, bool]]) -> None:
        """Subscribe a process to channels: to all messages, or only to those addressed to it."""
        for channel, own in reads:
            readers = self._readers.setdefault((channel.key, process if own else ""), [])
            if process not in readers:
                readers.append(process)

    def unsubscribe(self, process: str) -> None:
        """Forget a process that has ended; messages in flight to it are dropped."""
        for readers in self._readers.values():
            if process in readers:
                readers.remove(process)

    def readers(self, channel: Channel, name: str) -> list[str]:
        """Return the readers of messages of a channel that name this process, in the order of subscription."""
        return [*self._readers.get((channel.key, ""), ()), *self._readers.get((channel.key, name), ())]

    def cut_off(self, process: str, until_ns: int, *, output: bool = True, input_: bool = True) -> None:
        """Drop a process's output, its input, or both, until a virtual time."""
        for ways, cut in ((self._mute, output), (self._deaf, input_)):
            if cut:
                ways[process] = max(until_ns, ways.get(process, 0))

    def clog(self, process: str, until_ns: int) -> None:
        """Delay all input and output of a process until a virtual time; nothing is lost."""
        self._clogged[process] = max(until_ns, self._clogged.get(process, 0))

    def repeat_until(self, until_ns: int) -> None:
        """Deliver every message sent until a virtual time a second time, after up to `LATE_NS`."""
        self._repeat_until_ns = until_ns

    def heal(self) -> None:
        """End all loss, delay, repetition and disconnection."""
        self.weather = CALM
        self._repeat_until_ns = 0
        for ways in (self._mute, self._deaf, self._clogged):
            ways.clear()

    def put(self, sender: str, channel: Channel, name: str, payload: bytes, at_ns: int) -> None:
        """Send a message at `at_ns` to every reader except the sender."""
        if self._mute and at_ns < self._mute.get(sender, 0):
            return
        if self._clogged:
            at_ns = max(at_ns, self._clogged.get(sender, 0))
        for named in ("", name):
            for reader in self._readers.get((channel.key, named), ()):
                if reader == sender or (self._deaf and at_ns < self._deaf.get(reader, 0)):
                    continue
                arrives_ns = max(at_ns, self._clogged.get(reader, 0)) if self._clogged else at_ns
                self._push(reader, channel, name, payload, arrives_ns)

    def _push(self, reader: str, channel: Channel, name: str, payload: bytes, at_ns: int) -> None:
        self.sent += 1
        if at_ns < self._repeat_until_ns:
            late_ns = at_ns + int(unit_interval(draw_words(self._key, self.sent)[4]) * LATE_NS)
            heapq.heappush(self._heap, (late_ns, self.sent, reader, channel, name, payload))
            self.sent += 1
        weather = self.weather
        if weather is not CALM:
            words = draw_words(self._key, self.sent)
            if unit_interval(words[0]) < weather.loss:
                return
            if unit_interval(words[3]) < weather.repeat:
                late_ns = at_ns + weather.delay_ns + int(unit_interval(words[2]) * weather.spread_ns)
                heapq.heappush(self._heap, (late_ns, self.sent, reader, channel, name, payload))
                self.sent += 1
            at_ns += weather.delay_ns + int(unit_interval(words[1]) * weather.spread_ns)
        heapq.heappush(self._heap, (at_ns, self.sent, reader, channel, name, payload))

    def next_ns(self) -> int:
        """Return when the next message arrives; a time beyond any run when none is in flight."""
        return self._heap[0][0] if self._heap else limits.COUNTER_MAX

    @property
    def is_empty(self) -> bool:
        return not self._heap

    def pop(self) -> Message:
        return heapq.heappop(self._heap)
