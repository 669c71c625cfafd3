"""A client that sends packets to the robots' `echo` channel at a rate, and times what comes back.

Free-running, a process of its own, with the client library's core. Packets go to all robots in turn and hold only
their number, 4 bytes, because a robot refuses packets beyond the room of its outbox: 1 KiB a tick, here 56 packets, 500
for all nine robots. Packets that became due since the last look are sent in one message, looks being at least half a
millisecond apart: the hub admits packets once a tick.
"""

from __future__ import annotations

import argparse
import json
import struct
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

import numpy as np

from foosim.client.core import ClientCore
from foosim.client.player import Packet
from foosim.common import limits
from foosim.common.names import CHANNEL_ECHO
from foosim.protocol import channels
from foosim.protocol.actions import Publish
from foosim.protocol.channels import Plane
from foosim.runtime.process import new_boot
from foosim.runtime.roles.wire import Wire
from foosim.runtime.transport.inbox import Inbox
from foosim.runtime.transport.session import Session, use_client_runtime

CONNECT_S: Final = 60.0
START_S: Final = 60.0
LOOK_NS: Final = 500_000
WARM_EVERY_NS: Final = 50_000_000
DRAIN_NS: Final = 1_500_000_000
"""How long the last packets may take to come back."""
OFFSET_NS: Final = 100_000_000
"""For how long the offset of simulated time from the wall clock is taken to stay: a run that lags moves it."""
WARM: Final = (1 << 32) - 1
PAYLOAD: Final = struct.Struct("<I")


@dataclass(frozen=True, slots=True)
class Echoed:
    """What came back. Delays are in ms: end to end, and beyond what was due, by p50, p99, max."""

    sent: int
    received: int
    repeated: int
    seconds: float
    end_to_end_ms: list[float]
    beyond_due_ms: list[float]


class EchoClient:
    """Sends and times; `run` does all of it."""

    def __init__(self, name: str, session: Session, rate_hz: int, seconds: float) -> None:
        self.core = ClientCore(name, new_boot(), time.monotonic_ns())
        self._inbox = Inbox(limits.INBOX_MESSAGES_MAX)
        self._wire = Wire(session, Plane.RADIO, self._inbox, name)
        self._wire.read(channels.CLIENT_READS)
        self._channels = {channel.key: channel for channel, _ in channels.CLIENT_READS}
        self._period_ns = 1_000_000_000 // rate_hz
        self._count = round(rate_hz * seconds)
        self._robots: list[str] = []
        self._is_warm = False
        self._sent_ns: dict[int, int] = {}
        self._numbers: set[int] = set()
        self._times: list[tuple[int, int, int]] = []
        """Of each packet that came back, in ns: when, end to end, and when less what was due in simulated time."""
        self._names: list[tuple[str, int]] = []
        """Of the same: sender, and its number there."""

    def run(self) -> Echoed:
        """Wait for the first echo, send all, wait for the last ones."""
        self._warm_up()
        begun_ns = look_ns = time.monotonic_ns()
        sent = 0
        while sent < self._count:
            assert not self.core.ended, f"the run ended when {sent} of {self._count} packets were sent"
            due = min(self._count, (look_ns - begun_ns) // self._period_ns + 1)
            self._send(range(sent, due))
            sent = due
            now_ns = time.monotonic_ns()
            until_ns = max(begun_ns + sent * self._period_ns, now_ns + LOOK_NS)
            while now_ns < until_ns:
                self._take(until_ns - now_ns)
                now_ns = time.monotonic_ns()
            look_ns = now_ns
        seconds = (time.monotonic_ns() - begun_ns) / 1e9
        until_ns = time.monotonic_ns() + DRAIN_NS
        while len(self._numbers) < sent and (left_ns := until_ns - time.monotonic_ns()) > 0 and not self.core.ended:
            self._take(left_ns)
        return self._echoed(sent, seconds)

    def _warm_up(self) -> None:
        """Join, and send now and then until the run is so far that something comes back."""
        since_ns = warm_ns = time.monotonic_ns()
        while not self._is_warm:
            self._take(WARM_EVERY_NS)
            now_ns = time.monotonic_ns()
            assert now_ns < since_ns + START_S * 1e9, "no echo came back"
            assert not self.core.refusal, self.core.refusal
            self.core.wake(now_ns)
            if self.core.deployment is not None and not self._robots:
                self._robots = sorted(self.core.deployment.robots)
                self._wire.declare_alive()
                self.core.join(0, [])
            if self._robots and now_ns >= warm_ns + WARM_EVERY_NS:
                warm_ns = now_ns
                self._send([WARM])
            self._perform()

    def _send(self, numbers: range | list[int]) -> None:
        now_ns = time.monotonic_ns()
        robots = self._robots
        packets = [Packet(robots[number % len(robots)], CHANNEL_ECHO, PAYLOAD.pack(number)) for number in numbers]
        self._sent_ns.update(dict.fromkeys(numbers, now_ns))
        self.core.send(packets, now_ns)
        self._perform()

    def _take(self, wait_ns: int) -> None:
        items = self._inbox.take(wait_ns / 1e9)
        now_ns = time.monotonic_ns()
        for key, name, payload in items:
            self.core.receive(self._channels[key], name, payload, now_ns)
        arrivals = self.core.arrivals
        while arrivals:
            packet = arrivals.popleft()
            (number,) = PAYLOAD.unpack(packet.payload)
            if number == WARM:
                self._is_warm = True
                continue
            self._numbers.add(number)
            self._times.append((now_ns, now_ns - self._sent_ns[number], now_ns - packet.due_ns))
            self._names.append((packet.source, packet.sequence))

    def save_times(self, path: Path) -> None:
        """Write down when each packet came back: arrays `source`, `sequence` and `received_ns`."""
        names, numbers = zip(*self._names, strict=True)
        np.savez(path, source=names, sequence=numbers, received_ns=[at_ns for at_ns, _, _ in self._times])

    def _perform(self) -> None:
        for action in self.core.actions:
            if isinstance(action, Publish):
                self._wire.put(action.channel, action.name, action.payload)
        self.core.actions.clear()

    def _echoed(self, sent: int, seconds: float) -> Echoed:
        assert self._times, "nothing came back"
        times = np.array(self._times)
        spans = times[:, 0] // OFFSET_NS
        end_to_end, after_due = times[:, 1] / 1e6, times[:, 2] / 1e6
        beyond = after_due.copy()
        for span in np.unique(spans):  # the clocks' offset is that of the promptest packet
            beyond[spans == span] -= after_due[spans == span].min()
        return Echoed(
            sent,
            len(self._numbers),
            len(self._times) - len(self._numbers),
            round(seconds, 3),
            [round(float(ms), 3) for ms in np.percentile(end_to_end, (50, 99, 100))],
            [round(float(ms), 3) for ms in np.percentile(beyond, (50, 99, 100))],
        )


def main() -> None:
    """Run as a process of the bench."""
    parser = argparse.ArgumentParser(description="A client that times echoes.")
    parser.add_argument("--name", required=True)
    parser.add_argument("--connect", required=True)
    parser.add_argument("--rate", type=int, required=True)
    parser.add_argument("--seconds", type=float, required=True)
    parser.add_argument("--times", type=Path)
    chosen = parser.parse_args()
    use_client_runtime()
    with Session.client(chosen.connect, CONNECT_S, limits.RADIO_MESSAGE_BYTES_MAX) as session:
        client = EchoClient(chosen.name, session, chosen.rate, chosen.seconds)
        echoed = client.run()
        if chosen.times is not None:
            client.save_times(chosen.times)
        print(json.dumps(asdict(echoed)), flush=True)


if __name__ == "__main__":
    main()
