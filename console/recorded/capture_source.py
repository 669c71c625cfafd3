"""A capture as a source of the page: played, sought and stepped to the tick, with marks, links and drops at that time.

Two threads read: one the view, so that the slider does not wait, one the events, in slices. Each has the capture
open by itself. A capture that is still being written is looked at again every second.
"""

from __future__ import annotations

import asyncio
import os
import shlex
import time
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Final, TypeVar

from foosim.capture.mcap.checks import CaptureError
from foosim.capture.reader import CapturedTick
from foosim.capture.rows import CLIENTS, FRAME, PACKETS
from foosim.common.errors import BadValue, Refused
from foosim.common.units import format_ns
from foosim.console.clock.comparing import Compare, compare
from foosim.console.clock.deck import ARGUMENTS, VERBS, Clock, Deck, checked
from foosim.console.recorded.capture_curves import curve_points, reading_at, reading_points, status_at
from foosim.console.recorded.capture_history import CaptureHistory
from foosim.console.recorded.recording import Look, Recording
from foosim.console.shown.curves import name_and_unit
from foosim.console.shown.links import Links, links_message
from foosim.console.shown.source import About, Answered, Curve, Eyes, Feed, Moment, Wanted
from foosim.console.shown.tracks import Where
from foosim.deployment.loader import load_deployment
from foosim.deployment.text.files import read_source_file
from foosim.world.frame import Frame

T = TypeVar("T")
Recompute = Callable[[Frame, Iterable[CapturedTick]], Frame | None]
"""Gives the frame that captured inputs lead to from a captured frame; None where it has another digest."""
BRANCH: Final = "branch"
WINDOW_NS: Final = 5_000_000_000
STATUS_S: Final = 0.25
LINKS_S: Final = 0.5
OVERLAY_NS: Final = 100_000_000
EARLY_NS: Final = 500_000
REFRESH_S: Final = 1.0
MARKS_AT_ONCE: Final = 500
"""Of one message."""
UNSEEN_HZ: Final = 2.0
"""Update period of a recording that no browser watches."""


class FileSource:
    """A capture file. Without a `clock` it has a deck of its own, which requests control; with one it follows."""

    def __init__(
        self,
        path: Path,
        clock: Clock | None = None,
        offset_ns: int = 0,
        recompute: Recompute | None = None,
        compare: Compare | None = None,
    ) -> None:
        """`offset_ns`: this capture's time at time 0 of the clock. `compare`: the other side of a comparison.

        Raises CaptureError.
        """
        self.recording: Final = Recording(path)
        first, last = self.recording.span
        tick_ns = self.recording.tick_ns
        self._deck: Deck | None = None
        """The clock, where it is this capture's own."""
        if clock is None:
            clock = self._deck = Deck(first, last, tick_ns, time.monotonic_ns)
        self.clock: Final = clock
        self.offset_ns: Final = offset_ns
        verbs = (*VERBS, BRANCH) if self._deck is not None else (BRANCH,)
        self.about = About("capture", path.name, self.recording.deployment.world, tick_ns, verbs, (first, last))
        self._recompute = recompute
        self._wanted = Wanted()
        self._front = ThreadPoolExecutor(1, "seen")
        self._back = ThreadPoolExecutor(1, "happened")
        self._exact = ThreadPoolExecutor(1, "computed")
        self._history: CaptureHistory | None = None
        self._look: Look | None = None
        self._compare = compare
        self._ends = Links(self.recording.deployment, self.recording.drawing.entities)
        self._overlay_ns = 0
        self._sent_ns = 0
        """Time up to which readings were published."""
        self._is_inexact = False
        """Whether frames between the captured ones cannot be computed."""

    def want(self, wanted: Wanted) -> None:
        self._wanted = wanted
        self.clock.changed()

    def eyes(self) -> Eyes | None:
        frame = None if self._look is None else self._look.frame
        return None if frame is None else (frame.tick, partial(self._picture, frame))

    def _picture(self, frame: Frame, robot: str, channel: str, kind: str) -> bytes:
        """Return a camera's picture at a frame: that of its packet, as `capture export` has it, where it sent one."""
        history = self._history
        payload = (
            b"" if history is None else self._back.submit(reading_at, history, robot, channel, frame.tick).result()
        )
        return self.recording.drawing.picture(frame, robot, channel, kind, payload)

    # --- running -----------------------------------------------------------------------------------------------------

    async def run(self, feed: Feed) -> None:
        """Feed messages until cancelled; damage in the file is reported, and the rest is shown."""
        try:
            async with asyncio.TaskGroup() as tasks:
                for work in (self._show, self._gather, self._publish_status, self._publish_links, self._refresh):
                    tasks.create_task(work(feed))
                if self._compare is not None:
                    tasks.create_task(compare(feed, self.clock, self._compare, self.opened(), self.covers))
        finally:
            for pool in (self._front, self._back, self._exact):
                pool.shutdown(wait=False, cancel_futures=True)

    def opened(self, *, links: bool = False) -> Callable[[], Where]:
        """Return a function that opens the capture once more, for a comparison in a thread of its own."""

        def open_again() -> Where:
            recording = Recording(self.recording.path)
            return lambda time_ns: recording.poses_at(time_ns + self.offset_ns, links=links)

        return open_again

    def covers(self) -> tuple[int, int]:
        """Return the first and the last tick of the clock at which there is something."""
        first_ns, last_ns = (tick * self.recording.tick_ns - self.offset_ns for tick in self.recording.span)
        return -(-first_ns // self.clock.tick_ns), last_ns // self.clock.tick_ns

    async def _in(self, pool: ThreadPoolExecutor, work: Callable[..., T], *arguments: Any) -> T:
        return await asyncio.get_running_loop().run_in_executor(pool, work, *arguments)

    def tick(self) -> int:
        """Return the own tick at the clock's time, within the recording."""
        first, last = self.recording.span
        return min(max((self.clock.time_ns() + self.offset_ns) // self.recording.tick_ns, first), last)

    async def _show(self, feed: Feed) -> None:
        """Publish the scene, then the moment of the newest request, at most at the browsers' rate."""
        self._describe(feed)
        shown: tuple[int, int, bool] | None = None
        clock, jumps, due_ns = self.clock, self.clock.jumps, 0
        while True:
            seen, tick = clock.changes, self.tick()
            wish = tick, clock.jumps, clock.paused
            if wish != shown or self._look is None:
                try:
                    look = await self._in(self._front, self.recording.look, tick)
                except CaptureError as error:
                    feed.publish({"type": "note", "level": "error", "text": str(error)})
                    look = None
                if look is not None:
                    self._publish_moment(feed, look, jump=clock.jumps != jumps)
                    jumps = clock.jumps
                shown = wish
                if clock.paused and look is not None and look.kind != "frame":
                    await self._show_exactly(feed, look)
                    if self.tick() != tick:
                        continue
            due_ns = self._next_ns(tick, due_ns)
            await clock.wait(None if clock.paused and self._look is not None else due_ns, seen)

    def _next_ns(self, tick: int, due_ns: int) -> int:
        """Return the wall time at which there is something else to see: that of the next frame, but not too soon."""
        now_ns = self.clock.clock_ns()
        period_ns = round(1e9 / (self._wanted.hz or UNSEEN_HZ))
        later = self.recording.neighbour(tick, later=True)
        wall_ns = None
        if later is not None:
            wall_ns = self.clock.wall_ns(later * self.recording.tick_ns - self.offset_ns)
        soonest_ns = max(due_ns + period_ns * 9 // 10, now_ns + 1_000_000)
        # A little after its time: an early timer would find the frame before.
        next_ns = now_ns + period_ns if wall_ns is None else wall_ns + EARLY_NS
        return min(max(soonest_ns, next_ns), now_ns + 10**9)

    def _publish_moment(self, feed: Feed, look: Look, *, jump: bool) -> None:
        self._look = look
        paused = self.clock.paused
        feed.show(Moment(look.tick, look.poses, look.values, jump, paused))
        now_ns = self.clock.clock_ns()
        if self._wanted.overlays and look.frame is not None and (paused or now_ns >= self._overlay_ns):
            self._overlay_ns = now_ns + OVERLAY_NS
            for message in self.recording.drawing.overlays(look.frame, self._wanted.overlays):
                feed.publish(message)

    def _describe(self, feed: Feed) -> None:
        feed.describe(self.about, self.recording.drawing.content())

    async def _show_exactly(self, feed: Feed, look: Look) -> None:
        """Publish the recomputed frame of a tick without one, or the reason why it cannot be computed."""
        if self._recompute is None or self._is_inexact or look.requested == look.tick == 0:
            return
        try:
            found = await self._in(self._front, self._start, look.requested)
            if found is None:
                return
            frame = await self._in(self._exact, self._recompute, *found)
        except Refused as error:
            self._is_inexact = True
            text = f"ticks between captured frames cannot be recomputed: {error}"
            feed.publish({"type": "note", "level": "info", "text": text})
            return
        if frame is None:
            self._is_inexact = True
            text = "this machine's results differ from the capture's: ticks without a frame show the last captured one"
            feed.publish({"type": "note", "level": "warning", "text": text})
        elif frame.tick == self.tick():
            self._publish_moment(feed, self.recording.seen(look.requested, frame, "computed"), jump=False)

    def _start(self, tick: int) -> tuple[Frame, list[CapturedTick]] | None:
        """Return the newest captured frame up to a tick, and the inputs of the ticks after it."""
        frame = self.recording.frame_up_to(tick)
        return None if frame is None else (frame, [*self.recording.inputs(frame.tick, tick)])

    # --- events ------------------------------------------------------------------------------------------------------

    async def _gather(self, feed: Feed) -> None:
        """Read events, slice by slice, and publish the marks as they are found."""
        path, topics = self.recording.path, (PACKETS, CLIENTS)
        history = await self._in(self._back, lambda: CaptureHistory(Recording(path, topics)))
        is_reported = False
        while True:
            try:
                await self._in(self._back, history.gather)
            except CaptureError as error:
                feed.publish({"type": "note", "level": "error", "text": str(error)})
            self._history = history
            if history.is_complete:
                marks = await self._in(self._back, history.news)
                content = [{"tick": mark.tick, "kind": mark.kind, "text": mark.text} for mark in marks]
                for start in range(0, len(content), MARKS_AT_ONCE):
                    feed.publish({"type": "marks", "marks": content[start : start + MARKS_AT_ONCE]})
                if history.left_packets and not is_reported:
                    text = f"the figures of links lack the last {history.left_packets} packets of the capture"
                    feed.publish({"type": "note", "level": "warning", "text": text})
                    is_reported = True
                if history.recording.index.finished:
                    return
                await asyncio.sleep(REFRESH_S)
                await self._in(self._back, history.refresh)

    async def _refresh(self, feed: Feed) -> None:
        """Read the growing file until the capture is finished."""
        while not self.recording.index.finished:
            await asyncio.sleep(REFRESH_S)
            try:
                if not await self._in(self._front, self.recording.refresh):
                    continue
            except CaptureError as error:
                feed.publish({"type": "note", "level": "error", "text": str(error)})
                continue
            first, last = self.recording.span
            self.about = replace(self.about, span=(first, last))
            if self._deck is not None:
                self._deck.grow(first, last)
            self._describe(feed)

    async def _publish_status(self, feed: Feed) -> None:
        before: Mapping[str, Any] | None = None
        while True:
            history = self._history
            look = self._look
            status = status_at(self.recording, self.clock.account(), self.tick(), look)
            status["gathered"] = 0.0 if history is None else round(history.share, 3)
            if history is not None and history.is_complete:
                at_ns = self.tick() * self.recording.tick_ns
                status["packets"] = await self._in(self._back, history.links.totals, at_ns)
            if status != before:
                feed.publish({"type": "status", "status": status})
                before = status
            await asyncio.sleep(STATUS_S)

    async def _publish_links(self, feed: Feed) -> None:
        """Publish the links' figures of the window up to now, the last drops of watched links, and readings."""
        before: Any = None
        while True:
            history, at = self._history, self.tick()
            key = at, self._wanted.links, None if history is None else history.share
            if history is not None and key != before:
                try:
                    for message in await self._in(self._back, self._link_messages, history, at):
                        feed.publish(message)
                except CaptureError as error:
                    feed.publish({"type": "note", "level": "error", "text": str(error)})
                before = key
            await asyncio.sleep(LINKS_S)

    def _link_messages(self, history: CaptureHistory, tick: int) -> list[dict[str, Any]]:
        at_ns = tick * self.recording.tick_ns
        continues = at_ns - WINDOW_NS < self._sent_ns <= at_ns
        drops = history.links.drops(self._sent_ns if continues else at_ns - WINDOW_NS, at_ns)
        frame = history.recording.frame_up_to(tick)
        if frame is not None:
            self._ends.move(frame)
        links = self._ends.with_ends(history.links.windows(at_ns, WINDOW_NS))
        messages = [links_message(tick, WINDOW_NS / 1e9, len(links), links, drops)]
        for source, destination in self._wanted.links:
            messages.append({"type": "watched", **history.watched(source, destination, at_ns)})
        after_ns = self._sent_ns if continues else at_ns - WINDOW_NS // 10
        self._sent_ns = at_ns
        for robot, channel in self._wanted.readings:
            points = reading_points(history, robot, channel, after_ns, at_ns)
            if points:
                messages.append({"type": "readings", "robot": robot, "channel": channel, "points": points})
        return messages

    # --- requests ----------------------------------------------------------------------------------------------------

    async def request(self, verb: str, arguments: Mapping[str, Any], who: str) -> Answered:
        if verb == BRANCH or self._deck is None:
            checked(verb, arguments, {BRANCH: {"tick": (int,)}})
            tick = arguments.get("tick", self.tick())
            return await self._in(self._front, branch_answer, self.recording, tick)
        checked(verb, arguments, {**ARGUMENTS, BRANCH: {}})
        return self._deck.request(verb, arguments, lambda tick, later: self.recording.neighbour(tick, later=later))

    async def history(self, curve: Curve) -> tuple[str, str, list[tuple[float, float]]]:
        name, unit = name_and_unit(curve)
        history = self._history
        if history is None:
            return name, unit, []
        try:
            points = await self._in(self._back, curve_points, history, curve, self.tick())
        except CaptureError:  # the pass over the whole capture reports it
            points = []
        return name, unit, points


def branch_answer(recording: Recording, tick: int) -> Answered:
    """Return the command that continues from a tick; its tick is that of the captured frame that the run begins with.

    After a `#` it warns that the deployment's file is not the captured one. Raises BadValue for a tick without a frame
    before it, CaptureError.
    """
    number = recording.index.places[FRAME].newest(tick * recording.tick_ns)
    if number < 0:
        first, last = recording.span
        raise BadValue(f"branch: no captured frame at or before this tick; there are ticks {first} to {last}", tick)
    row = recording.row(FRAME, number)
    name = recording.about.deployment_name
    time = format_ns(row.tick * recording.tick_ns).replace(" ", "")
    command = ["foosim", "up", name, "--from", f"{_near(recording.path)}@{time}"]
    return Answered(shlex.join(command) + _remark(recording, Path(name)), row.tick)


def _near(path: Path) -> Path:
    """Return a path for display: relative if it is below this folder."""
    whole = Path(os.path.abspath(path))
    return whole.relative_to(Path.cwd()) if whole.is_relative_to(Path.cwd()) else whole


def _remark(recording: Recording, file: Path) -> str:
    """Return a note about the deployment's file, empty when it is the captured one."""
    try:
        there = load_deployment(read_source_file(file), str(file))
    except Refused:
        return f"  # {file} is not here: name the file that the run was started with"
    if there.model_dump() != recording.deployment.model_dump():
        return f"  # {file} is not what the run had: it was changed, or the run had options (--set)"
    return ""
