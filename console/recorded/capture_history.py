"""What happened in a capture, read in slices so that others get their turn: marks, and each link's windows.

The rows are read topic by topic, the few ones first; of a capture that grows, from where the last pass ended. All of it
belongs to one thread, and so does the `Recording` that it reads. Pure: the caller sets the size of a slice.
"""

from __future__ import annotations

from typing import Any, Final

from foosim.analysis.explain import Explained, explain_row, network_events
from foosim.capture.reader import TICK_MARKS
from foosim.capture.rows import CLIENTS, EPOCHS, FRAME, PACKETS, RECOVERIES, TICK, PacketRow, Row
from foosim.console.recorded.link_history import PACKET_MARKS, LinkHistory
from foosim.console.recorded.recording import Recording
from foosim.console.shown.links import drop_message
from foosim.console.shown.rule_text import RuleTexts
from foosim.console.shown.timeline import Mark, Timeline
from foosim.vhub.stages.explanation import Evidence

SLICE_ROWS: Final = 500
EXPLAINED_MAX: Final = 1024
"""Drops whose explanations are kept."""
PACKETS_MAX: Final = 10_000_000
"""Packets with kept times: some hundred MB. Windows lack later ones, which a note reports."""


class CaptureHistory:
    """Collects events. `gather` reads further; all else covers the part that was read."""

    def __init__(self, recording: Recording) -> None:
        """`recording` has the topics /packets and /clients in its index."""
        self.recording: Final = recording
        self.links: LinkHistory
        self.timeline: Timeline
        self._begin()

    def _begin(self) -> None:
        recording = self.recording
        self.links = LinkHistory(recording.tick_ns)
        self.timeline = Timeline(recording.deployment)
        self._done: dict[str, int] = dict.fromkeys((EPOCHS, RECOVERIES, TICK, FRAME, PACKETS), 0)
        self._requested: list[tuple[int, str]] = []
        """Requested events of the network, by tick."""
        versions, frame = recording.about.versions, recording.frame_up_to
        self._evidence = Evidence(recording.deployment, versions, self._requested, frame, self._clients)
        self._explained: dict[int, Explained] = {}
        self._rules = RuleTexts(recording.deployment)
        self._generation = recording.index.generation

    def refresh(self) -> None:
        """Read rows written since the last call. Raises CaptureError."""
        self.recording.refresh()
        if self.recording.index.generation != self._generation:
            self._begin()

    @property
    def share(self) -> float:
        """The share of the rows that was read, 0 to 1."""
        rows = sum(self._there(topic) for topic in self._done)
        return sum(self._done.values()) / rows if rows else 1.0

    @property
    def is_complete(self) -> bool:
        """Whether all that there is was read."""
        return all(done >= self._there(topic) for topic, done in self._done.items())

    @property
    def left_packets(self) -> int:
        """Packets above the limit, which are in no window."""
        return max(0, len(self.recording.index.places[PACKETS]) - PACKETS_MAX)

    def _there(self, topic: str) -> int:
        count = len(self.recording.index.places[topic])
        return min(count, PACKETS_MAX) if topic == PACKETS else count

    def gather(self, rows: int = SLICE_ROWS) -> None:
        """Read some further rows. Raises CaptureError where the capture is damaged; that row is passed by then."""
        for topic, done in self._done.items():
            stop = min(done + rows, self._there(topic))
            for number in range(done, stop):
                self._done[topic] = number + 1
                self._take(topic, number)
            rows -= stop - done

    def _take(self, topic: str, number: int) -> None:
        recording = self.recording
        if topic == PACKETS:
            mark = recording.decoded(PACKET_MARKS, recording.index.read(topic, number))
            dropped_ns = self.links.add(mark, number)
            if dropped_ns >= 0:
                self.timeline.take_drop(dropped_ns, mark.cause)
        elif topic == TICK:
            tick = recording.decoded(TICK_MARKS, recording.index.read(topic, number))
            if tick.edits:
                self.timeline.take_edits(tick.tick, tick.edits)
                self._requested += network_events(tick)
        elif topic == FRAME:
            frame = recording.frame(number)
            assert frame is not None
            self.timeline.take_frame(frame)
        elif topic == EPOCHS:
            self.timeline.take_epoch(recording.row(topic, number))
        else:
            self.timeline.take_recovery(recording.row(topic, number))

    def news(self) -> list[Mark]:
        """Return the marks since the last call."""
        return self.timeline.news()

    # --- packets -----------------------------------------------------------------------------------------------------

    def packet(self, number: int) -> PacketRow:
        """Return the row of a packet by its number. Raises CaptureError."""
        row = self.recording.row(PACKETS, number)
        assert isinstance(row, PacketRow)
        return row

    def watched(self, source: str, destination: str, at_ns: int) -> dict[str, Any]:
        """Return the last drops of a link up to a time, each explained (`watched`). Raises CaptureError."""
        drops = []
        for number in self.links.last_drops(source, destination, at_ns):
            row = self.packet(number)
            explained = self._explained.get(number) or explain_row(self._evidence, row)
            if len(self._explained) >= EXPLAINED_MAX:
                self._explained.clear()
            self._explained[number] = explained
            dropped_ns = row.sent_ns if row.arrival_tick < 0 else row.arrival_tick * self.recording.tick_ns
            drops.append(drop_message(dropped_ns // self.recording.tick_ns, explained))
        requested = [one for one in self._requested if one[0] <= at_ns // self.recording.tick_ns]
        rule = self._rules.text(source, destination, at_ns, requested)
        return {"link": [source, destination], "rule": rule, "drops": drops}

    def _clients(self) -> list[Row]:
        return [self.recording.row(CLIENTS, number) for number in range(len(self.recording.index.places[CLIENTS]))]
