"""The queue before a radio or a wire: bounded in packets, bytes and time; with CoDel where configured.

A queue is served in order at a rate that is known when a packet comes, so its wait is known then, too: the time until
the sender is free. CoDel's law (RFC 8289) is applied to that wait at the moment at which the packet would leave.
"""

from __future__ import annotations

from math import sqrt
from typing import Final

from foosim.deployment.network.radios import Radio
from foosim.vhub.network.link_context import LinkSetup
from foosim.vhub.network.memory import Sending
from foosim.vhub.network.mtu import frame_count
from foosim.vhub.network.packet import Flight
from foosim.vhub.stages.explanation import Explanation, Seen
from foosim.vhub.stages.policy import EXPIRED
from foosim.vhub.stages.stage import Stage

QUEUE_FULL: Final = "queue_full"
CODEL: Final = "queue_codel"


class Limits:
    """Limits of a queue: the radio's for broadcasts, the link's for other packets."""

    def __init__(self, settings: Radio) -> None:
        queue = settings.queue
        self.packets, self.bytes_max, self.wait_ns = queue.packets, queue.bytes_max, queue.wait_ns
        self.codel = queue.drop == "codel"
        self.target_ns, self.interval_ns = queue.codel_target_ns, queue.codel_interval_ns
        self._mtu, self._overhead = settings.payload_max, settings.overhead_bytes

    def size(self, flight: Flight) -> int:
        """Return the bytes of a packet in the queue, with the overhead of each frame."""
        return flight.size + self._overhead * frame_count(flight.size, self._mtu)


class Queue(Stage):
    """Decides whether a packet is queued, and for how long."""

    def __init__(self, setup: LinkSetup) -> None:
        self._sender = setup.sender
        self._own, self._shared = Limits(setup.settings), Limits(setup.shared)
        self._broadcasts = setup.settings.sends_once

    @classmethod
    def for_link(cls, setup: LinkSetup) -> Queue | None:
        return cls(setup) if setup.settings.has_queue else None

    def at_sending(self, flight: Flight) -> str:
        sender = self._sender
        broadcast = self._broadcasts and flight.published
        if broadcast:
            shared = sender.sending(flight.sequence, flight.copy)
            if shared is not None:
                flight.queue_bytes, flight.queue_ns = shared.queue_bytes, shared.queue_ns
                flight.decided_by = shared.decided_by
                return shared.cause
        now_ns, waiting = flight.sent_ns + flight.phase_ns, sender.waiting
        while waiting and waiting[0][0] <= now_ns:
            del waiting[0]
        queued = 0
        for _, size in waiting:
            queued += size
        wait_ns = sender.free_ns - now_ns if sender.free_ns > now_ns else 0
        limits = self._shared if broadcast else self._own
        cause = self._judge(limits, len(waiting), queued + limits.size(flight), now_ns, wait_ns)
        flight.queue_bytes, flight.queue_ns = queued, wait_ns
        if cause:
            flight.decided_by = self._numbers(limits, cause, len(waiting), now_ns + wait_ns)
        if broadcast:
            sender.last = Sending(flight.sequence, flight.copy, cause, queued, wait_ns)
            sender.last.decided_by = flight.decided_by
        return cause

    def explain(self, seen: Seen, note: Explanation) -> None:
        row, decided, limits = seen.row, seen.row.decided_by, self._shared if seen.is_broadcast else self._own
        if row.cause in (QUEUE_FULL, CODEL):
            note.add("{packets} packets of ", packets=decided.queue_packets)
        note.add("{bytes} B before it, waits {wait_ns}", bytes=row.queue_bytes, wait_ns=row.queue_ns)
        note.add(
            " (at most {packets_max} packets", packets_max=limits.packets, drop="codel" if limits.codel else "tail"
        )
        note.add(", {bytes_max} B, {wait_max_ns}", bytes_max=limits.bytes_max, wait_max_ns=limits.wait_ns)
        note.text += f"; {note.facts['drop']})"
        if row.cause == CODEL:
            note.add(", for {above_ns} above {target_ns}", above_ns=decided.codel_above_ns, target_ns=limits.target_ns)
            note.add(", drop {drops}", drops=decided.codel_drops, interval_ns=limits.interval_ns)

    def _numbers(self, limits: Limits, cause: str, packets: int, leaves_ns: int) -> tuple[int, ...]:
        """Return the numbers of a drop: packets that wait; for CoDel also the time above target and its count."""
        if cause != CODEL:
            return (packets,)
        since_ns = self._sender.first_above_ns - limits.interval_ns
        return packets, leaves_ns - since_ns, self._sender.drop_count

    def _judge(self, limits: Limits, packets: int, size: int, now_ns: int, wait_ns: int) -> str:
        if packets >= limits.packets or size > limits.bytes_max:
            return QUEUE_FULL
        if wait_ns > limits.wait_ns:
            return EXPIRED
        return CODEL if limits.codel and self._drops(limits, now_ns + wait_ns, wait_ns, packets) else ""

    def _drops(self, limits: Limits, now_ns: int, wait_ns: int, packets: int) -> bool:
        """Apply CoDel's law of control to a packet that leaves the queue at `now_ns` (RFC 8289, 5.5 and 5.6)."""
        sender = self._sender
        above = self._is_above(limits, now_ns, wait_ns, packets)
        if sender.is_dropping:
            if not above:
                sender.is_dropping = False
                return False
            if now_ns < sender.drop_next_ns:
                return False
            sender.drop_count += 1
            sender.drop_next_ns = self._law(limits, sender.drop_next_ns)
            return True
        if not above:
            return False
        sender.is_dropping = True
        gained = sender.drop_count - sender.last_count
        is_recent = now_ns - sender.drop_next_ns < 16 * limits.interval_ns
        sender.drop_count = sender.last_count = gained if is_recent and gained > 1 else 1
        sender.drop_next_ns = self._law(limits, now_ns)
        return True

    def _is_above(self, limits: Limits, now_ns: int, wait_ns: int, packets: int) -> bool:
        """Whether waits have been above the target for an interval; a queue of one packet never is."""
        sender = self._sender
        if wait_ns < limits.target_ns or packets <= 1:
            sender.first_above_ns = 0
            return False
        if sender.first_above_ns == 0:
            sender.first_above_ns = now_ns + limits.interval_ns
            return False
        return now_ns >= sender.first_above_ns

    def _law(self, limits: Limits, time_ns: int) -> int:
        return time_ns + int(limits.interval_ns / sqrt(max(1, self._sender.drop_count)))
