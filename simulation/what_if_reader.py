"""The inputs of each tick that is judged again, from a capture: clients, packets, edits, and the frame.

The row of a packet is in the file where its fate became final, which may be long after the tick at which it was
sent. The heads of the chunks to come limit how far back rows reach: a tick is yielded as soon as none of them can
have a row of it. So the memory holds the packets in flight, and a chunk.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import accumulate
from typing import Final, Literal

from foosim.capture.contents import CUT_REASON, CUT_TICK
from foosim.capture.mcap.checks import CaptureError
from foosim.capture.reader import DECODERS, TICK_MARKS, CaptureData, FrameReader, Scan, TickMark, captured_tick
from foosim.capture.rows import AGES, CLIENTS, PACKETS, TICK, AgeRow, ClientRow, EditRow, PacketRow, TickRow
from foosim.protocol.messages import Sent
from foosim.simulation.stepped_world import SteppedWorld
from foosim.simulation.verify import captured_world, frame_of, start_of
from foosim.vhub.state.hub_state import OUTBOX_SHIFT
from foosim.world.assembly.initial_state import first_frame
from foosim.world.frame import Frame
from foosim.world.robot_packets import RobotPacket

Frames = Literal["first", "captured", "computed"]
"""Source of frames: the first one is used for all, each is in the capture, or they are simulated again."""
_INDEX: Final = (1 << OUTBOX_SHIFT) - 1
_WHO_HEARS: Final = frozenset({"add", "remove", "set"})
"""Edits that may change which robots and players hear and send."""


@dataclass(slots=True)
class Offered:
    """One tick: what led to its frame, the frame if it is read, joins and leaves, the offered packets.

    A published packet is there once, whatever number of receivers it had; packets go by (source, sequence number).
    """

    row: TickRow | TickMark | None = None
    frame: Frame | None = None
    came: list[ClientRow] = field(default_factory=list)
    robots: dict[tuple[str, int], RobotPacket] = field(default_factory=dict)
    counts: dict[tuple[str, int], int] = field(default_factory=dict)
    """Of these, the counts within their channels: packets without a receiver are counted, but missing in a capture."""
    clients: dict[tuple[str, int], Sent] = field(default_factory=dict)

    @property
    def edits(self) -> list[EditRow]:
        return [] if self.row is None else self.row.edits


def frames_for(capture: CaptureData, *, on_radio: bool) -> Frames:
    """Return which frames are needed: only one if no fate depends on places and no entity comes, leaves or changes
    service."""
    if not on_radio and capture.edit_kinds.isdisjoint(_WHO_HEARS) and not capture.deployment.events:
        return "first"
    return "captured" if set(judged_ticks(capture)) <= set(capture.frame_ticks.tolist()) else "computed"


def parts_lacking(capture: CaptureData) -> tuple[str, ...]:
    """Return which end of its run a capture lacks, each with what follows from that: fates may not be the captured
    ones without another network."""
    found = []
    if CUT_TICK in capture.about.metadata:
        found.append("it begins within its run: earlier states of links and requested events are unknown")
    end = capture.about.end
    if not capture.finished or "problem" in end or end.get("reason") == CUT_REASON:
        found.append("it does not have the end of its run: packets in flight there may lack, and take no part")
    return tuple(found)


def judged_ticks(capture: CaptureData) -> list[int]:
    """Return the ticks that are closed again: after the last frame of a run with its end nothing was sent."""
    ticks: list[int] = capture.ticks.tolist()
    return ticks[:-1] if capture.finished and capture.about.end.get("reason") != CUT_REASON else ticks


class Offers:
    """One pass over a capture. `take` is given each row of a packet before the tick is yielded at which it was sent,
    `take_age` each row of ages at use."""

    def __init__(
        self,
        capture: CaptureData,
        frames: Frames,
        take: Callable[[PacketRow], None],
        take_age: Callable[[AgeRow], None] = lambda row: None,
    ) -> None:
        self._capture = capture
        self._take, self._take_age = take, take_age
        self._tick_ns = capture.deployment.tick_ns
        self._robots = frozenset(capture.deployment.robots)
        ticks = judged_ticks(capture)
        self.first, self._stop = (ticks[0], ticks[-1] + 1) if ticks else (0, 0)
        self._next = self.first
        """The first tick that is still to be yielded."""
        self.earlier = 0
        """How many rows are of packets that were sent before the capture begins, and are not judged again."""
        self._offered: dict[int, Offered] = {}
        self._waiting: deque[int] = deque()
        """Ticks of which all is read but packets, perhaps, whose fates became final later."""
        self._topics = frozenset({PACKETS, CLIENTS, TICK, AGES, *(FrameReader.TOPICS if frames == "captured" else ())})
        self._ticks = DECODERS[TICK] if frames == "computed" else TICK_MARKS

    def ticks(self) -> Iterator[Offered]:
        """Yield the ticks in their order. Raises CaptureError."""
        scan = Scan(self._capture.path)
        reader = FrameReader(scan, self._capture.deployment)
        starts_ns = self._capture.about.chunk_starts
        packets = DECODERS[PACKETS]
        rests_ns = list(accumulate(reversed(starts_ns), min))[::-1]
        chunk = 0
        for message in scan.messages(self._topics):
            if chunk < len(scan.about.chunk_starts):
                chunk = len(scan.about.chunk_starts)
                if chunk > len(rests_ns):  # it was written since the capture was opened
                    break
                yield from self._before(rests_ns[chunk - 1])
            topic = message.topic
            if topic == PACKETS:
                self._take_packet(scan.decode(packets, message))
            elif topic == TICK:
                self._take_tick(scan.decode(self._ticks, message))
            elif topic == AGES:
                self._take_age(scan.decode(DECODERS[AGES], message))
            elif topic == CLIENTS:
                client = scan.decode(DECODERS[CLIENTS], message)
                self._at(max(client.tick, self.first)).came.append(client)  # or before a cut begins
            else:
                frame = reader.frame(message)
                if frame is not None:
                    self._at(frame.tick).frame = frame
        yield from self._before(None)

    def _before(self, until_ns: int | None) -> Iterator[Offered]:
        """Yield the ticks before a time."""
        while self._waiting and (until_ns is None or self._waiting[0] * self._tick_ns < until_ns):
            tick = self._waiting.popleft()
            self._next = tick + 1
            yield self._offered.pop(tick)

    def _take_tick(self, row: TickRow | TickMark) -> None:
        if row.tick < self._stop:
            self._at(row.tick).row = row
            self._waiting.append(row.tick)

    def _take_packet(self, row: PacketRow) -> None:
        tick, source, sequence = row.sent_ns // self._tick_ns, row.source, row.sequence
        if tick < self.first:
            self.earlier += 1
            return
        self._take(row)
        if row.copy:
            return
        if tick < self._next:
            what = f"a packet of {source} that was sent at tick {tick} follows later ones"
            raise CaptureError(f"{self._capture.path}: {what}")
        to = "" if row.published else row.destination
        payload = row.payload
        offered = self._at(tick)
        if source in self._robots:
            offered.robots[source, sequence] = RobotPacket(source, sequence & _INDEX, to, row.channel, payload)
            offered.counts[source, sequence] = row.count
        else:
            offered.clients[source, sequence] = Sent(sequence, to, row.channel, row.stamp_ns, payload)

    def _at(self, tick: int) -> Offered:
        offered = self._offered.get(tick)
        if offered is None:
            offered = self._offered[tick] = Offered()
        return offered


@contextmanager
def world_of(capture: CaptureData, frames: Frames) -> Iterator[Callable[[Offered], Frame]]:
    """Yield a function from tick to frame, to be called in order. Raises CaptureError for a missing frame."""
    if frames == "captured":
        yield lambda offered: _captured(capture, offered)
    elif frames == "first":
        first = capture.first_frame()
        if first is None:
            raise CaptureError(f"{capture.path}: it does not have the frame with which it begins")
        yield lambda offered: _later(first, offered)
    else:
        world = captured_world(capture.about, capture.deployment, first_frame(capture.deployment, start_of(capture)))
        try:
            yield lambda offered: _computed(capture, world, offered)
        finally:
            world.close()


def _tick_of(offered: Offered) -> int:
    assert offered.row is not None, "a tick is yielded when its row was read"
    return offered.row.tick


def _later(first: Frame, offered: Offered) -> Frame:
    """Set a frame's tick without any other change: what is known of it stays known."""
    first.tick = _tick_of(offered)
    return first


def _captured(capture: CaptureData, offered: Offered) -> Frame:
    if offered.frame is None:
        raise CaptureError(f"{capture.path}: frame {_tick_of(offered)} follows later rows")
    return offered.frame


def _computed(capture: CaptureData, world: SteppedWorld, offered: Offered) -> Frame:
    assert isinstance(offered.row, TickRow)
    tick = captured_tick(offered.row)
    frame = frame_of(world, tick)
    if frame.tick != tick.tick or frame.digest != tick.digest:
        raise CaptureError(f"{capture.path}: frame {tick.tick} is missing, and is another one when computed: verify it")
    return frame
