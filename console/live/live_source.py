"""A running system as a source: frames of the simulation plane's `view`, statuses, and requests of an operator.

Leases bound the cost of viewers for the run: they are renewed only while a browser looks; otherwise a status is
requested each second. After a loss of the supervisor it is sought under the run's name, and the last view stays
visible; pages get the reason of the end of a run. Requests wait in threads, one connection each, so that none
waits for another's answer.
"""

from __future__ import annotations

import asyncio
import shlex
import threading
import time
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Final, TypeVar

from foosim.capture.parts import is_complete
from foosim.client.control import Control, NoAnswer, RequestRefused
from foosim.common.errors import BadValue, Refused
from foosim.console.live.following import Following, World, first_frame
from foosim.console.live.sending import VERBS as JOB_VERBS
from foosim.console.live.sending import Join, Sending
from foosim.console.shown.curves import name_and_unit
from foosim.console.shown.source import About, Answered, Curve, Eyes, Feed, Wanted
from foosim.launcher.outcome import ended_outcome
from foosim.runtime.run_folder import RunFolder
from foosim.runtime.transport.inbox import Inbox, Item
from foosim.world.frame import Frame

VERBS: Final = (
    *("pause", "resume", "step", "rate", "add", "remove", "move", "balance", "push", "set", "network"),
    *("stop", "start", "down"),
)
POLL_S: Final = 0.25
"""Period of status requests while a browser watches."""
UNSEEN_S: Final = 1.0
"""The period without a browser: a page that is opened later scrolls back."""
RENEW_S: Final = 1.5
QUESTION_S: Final = 3.0
"""How long a status is waited for; a supervisor that does not answer is looked for again."""
AGAIN_S: Final = 0.5
"""How often it is."""
ENDED_S: Final = 5.0
"""How often a run that has ended is looked for."""
FRAMES_MAX: Final = 8
"""That may wait to be received."""
HZ_MAX: Final = 100.0
REQUESTS_AT_ONCE: Final = 4
OUR_ARGUMENTS: Final = frozenset({"self", "verb", "timeout_s", "give_up"})
"""Arguments of `Control.request` that a page does not set."""
OVERLAY_S: Final = 0.1

T = TypeVar("T")
Connect = Callable[[Callable[[], bool]], Control]
"""Makes a connection; gives up when the function returns true."""
HowEnded = Callable[[str], Mapping[str, Any] | None]
"""Returns the message about the end of the run, given its requester if known; None before the end."""


class LiveSource:
    """One run."""

    def __init__(
        self,
        name: str,
        view: Connect,
        operate: Connect | None,
        how_ended: HowEnded = lambda stopped_by: None,
        join: Join | None = None,
        gateways: Callable[[], Mapping[str, Any]] = dict,
    ) -> None:
        """`name` is the run's; `operate` None permits no requests, `join` None gives no jobs. `gateways` returns which
        programs are at each gateway (`RunFolder.gateways`)."""
        self._name, self._connect_view, self._connect_operator = name, view, operate
        self._how_ended, self._gateways = how_ended, gateways
        self._has_ended = False
        self._sending = None if join is None else Sending(join)
        self._verbs = () if operate is None else VERBS
        self.about = About("live", name, "", 1_000_000, self._verbs)
        self._following = Following(self.about)
        self._overlay_s = 0.0
        self._wanted = Wanted()
        self._changed = asyncio.Event()
        """Set when another subscription is needed."""
        self._closing = threading.Event()
        self._viewing = ThreadPoolExecutor(1, "console-view")
        self._requesting = ThreadPoolExecutor(REQUESTS_AT_ONCE, "console-request")
        self._idle: list[Control] = []
        """Idle connections."""

    def want(self, wanted: Wanted) -> None:
        self._wanted = wanted
        self._following.listen(wanted)
        if self._sending is not None:
            self._sending.want(wanted.readers)
        self._changed.set()

    def eyes(self) -> Eyes | None:
        return self._following.eyes()

    async def request(self, verb: str, arguments: Mapping[str, Any], who: str) -> Answered:
        """Send a request to the supervisor. Raises RequestRefused, NoAnswer, ConnectError, BadValue."""
        wrong = [key for key in arguments if not key.isidentifier() or key in OUR_ARGUMENTS]
        if wrong:
            raise BadValue("a request has no such argument", wrong[0])
        if verb in JOB_VERBS:
            assert self._sending is not None, "a source without these verbs gets no request"
            self._following.check_present(arguments.get("robot"))
            return await self._sending.request(verb, arguments)
        loop = asyncio.get_running_loop()
        answered, sender = await loop.run_in_executor(self._requesting, self._request, verb, dict(arguments))
        self._following.keep_requester(sender, answered.tick, verb, who)
        self._changed.set()
        return answered

    def _request(self, verb: str, arguments: dict[str, Any]) -> tuple[Answered, str]:
        assert self._connect_operator is not None, "a source without verbs gets no request"
        try:
            control = self._idle.pop()
        except IndexError:
            control = self._connect_operator(self._closing.is_set)
        try:
            answer = control.request(verb, give_up=self._closing.is_set, **arguments)
        except NoAnswer:
            control.close()
            raise
        except Refused:
            self._idle.append(control)
            raise
        self._idle.append(control)
        return Answered(answer.text, answer.tick), answer.sender

    async def history(self, curve: Curve) -> tuple[str, str, list[tuple[float, float]]]:
        points = await asyncio.to_thread(self._following.points(curve))
        return *name_and_unit(curve), points

    # --- looking on --------------------------------------------------------------------------------------------------

    async def run(self, feed: Feed) -> None:
        trouble = ""  # the last reported reason of a missing run
        sending = None if self._sending is None else asyncio.create_task(self._sending.run(feed))
        try:
            while True:
                try:
                    control = await self._in_thread(lambda: self._connect_view(self._closing.is_set))
                except Refused as refused:
                    if trouble != str(refused):
                        trouble = str(refused)
                        await self._report_away(feed, f"{self._name} is not reached: {refused}; reconnecting")
                    await asyncio.sleep(ENDED_S if self._has_ended else AGAIN_S)
                    continue
                if trouble:
                    trouble, self._has_ended = "", False
                    feed.publish({"type": "presence", "state": "here", "text": ""})
                    feed.publish(_note("info", f"connected to {self._name} again"))
                try:
                    await self._follow(control, feed)
                except Refused as refused:
                    trouble = str(refused)
                    await self._report_away(feed, f"lost {self._name}: {refused}; reconnecting")
                    self._forget_idle()
                    await asyncio.sleep(AGAIN_S)
                except asyncio.CancelledError:
                    self._closing.set()  # before the wait for the last request
                    raise
                finally:
                    await self._in_thread(control.close)
        finally:
            self._closing.set()
            if sending is not None:
                sending.cancel()
            await self._report_end(feed)  # `up` ends its console when the run has ended
            self._forget_idle()
            self._viewing.shutdown(wait=False)
            self._requesting.shutdown(wait=False)

    async def _report_away(self, feed: Feed, text: str) -> None:
        """Report once that the run is away, or that it has ended."""
        if not await self._report_end(feed):
            feed.publish({"type": "presence", "state": "away", "text": text})
            feed.publish(_note("warning", text))

    async def _report_end(self, feed: Feed) -> bool:
        """Report the end of the run, if it has ended; return whether it was reported."""
        if not self._has_ended:
            message = await self._in_thread(lambda: self._how_ended(self._following.stopped_by))
            if message is not None:
                self._has_ended = True
                feed.publish(message)
        return self._has_ended

    def _forget_idle(self) -> None:
        """Close connections of operators that wait: the supervisor that they lead to may be gone."""
        while self._idle:
            with suppress(IndexError):
                self._idle.pop().close()

    async def _in_thread(self, work: Callable[[], T]) -> T:
        return await asyncio.get_running_loop().run_in_executor(self._viewing, work)

    async def _follow(self, control: Control, feed: Feed) -> None:
        """Follow a run as long as its supervisor answers. Raises Refused."""
        await self._describe(control, feed)
        newest = _Newest(asyncio.get_running_loop(), partial(self._take_frame, feed))
        control.view(newest)
        try:
            await self._poll(control, feed)
        finally:
            newest.end()

    async def _describe(self, control: Control, feed: Feed) -> None:
        """Request the description of the world, and publish its scene if that is new."""

        def request() -> tuple[dict[str, Any], World, Frame | None]:
            what = control.describe(QUESTION_S, self._closing.is_set)
            files = partial(control.files, timeout_s=QUESTION_S, give_up=self._closing.is_set)
            world = self._following.world_of(what, files)
            return what, world, first_frame(world.drawing, what)

        what, world, first = await self._in_thread(request)
        if self._following.turn_to(what, world):
            jobs = () if self._sending is None else self._sending.turn_to(world.drawing)
            self.about = replace(self._following.about, verbs=(*self._verbs, *jobs))
            feed.describe(self.about, self._following.content())
        moment = self._following.first_moment(first)
        if moment is not None:
            feed.show(moment)

    async def _poll(self, control: Control, feed: Feed) -> None:
        """Request statuses, and renew the lease while a browser watches."""
        following, lease = self._following, Wanted()
        renewed_s = 0.0
        while True:
            self._changed.clear()
            wanted = self._wanted
            now_s = time.monotonic()
            if wanted.readers and (wanted != lease or now_s >= renewed_s + RENEW_S):
                await self._renew(control, feed, following.watch_arguments(wanted, HZ_MAX), wanted != lease)
                lease, renewed_s = wanted, now_s
            status = await self._in_thread(lambda: control.status(QUESTION_S, self._closing.is_set))
            messages = following.take_status({**status, "gateways": self._gateways()})
            if wanted.links:
                messages += await self._in_thread(partial(following.explained, status, wanted))
            for message in messages:
                feed.publish(message)
            moment = following.standing_moment()
            if moment is not None:
                feed.show(moment)
            with suppress(TimeoutError):
                async with asyncio.timeout(POLL_S if wanted.readers else UNSEEN_S):
                    await self._changed.wait()

    async def _renew(self, control: Control, feed: Feed, wanted: dict[str, Any], is_new: bool) -> None:
        """Begin or renew the lease; frames alone, where the links that others watch leave no room for more."""
        watch = partial(control.request, "watch", QUESTION_S, self._closing.is_set)
        try:
            await self._in_thread(partial(watch, **wanted))
        except RequestRefused as refused:
            if is_new:
                feed.publish(_note("warning", str(refused)))
            await self._in_thread(partial(watch, hz=wanted["hz"]))

    def _take_frame(self, feed: Feed, payload: bytes) -> None:
        """Show a commit, and from time to time its overlays."""
        wanted = self._wanted
        if not wanted.readers:
            return  # a lease ends after a while
        moment = self._following.show(payload)
        if moment is None:
            return
        feed.show(moment)
        now_s = time.monotonic()
        if wanted.overlays and now_s >= self._overlay_s + OVERLAY_S:
            self._overlay_s = now_s
            for message in self._following.overlays(wanted.overlays):
                feed.publish(message)


class _Newest(Inbox):
    """An inbox that has the event loop take the newest frame and drop older ones."""

    def __init__(self, loop: asyncio.AbstractEventLoop, take: Callable[[bytes], None]) -> None:
        super().__init__(FRAMES_MAX)
        self._loop, self._take = loop, take
        self._payload = b""
        self._is_due = self._has_ended = False

    def offer(self, item: Item) -> bool:
        """Keep it. Called in the thread that receives, which does nothing else."""
        self._payload = item[2]
        if not self._is_due:
            self._is_due = True
            with suppress(RuntimeError):  # the loop is over
                self._loop.call_soon_threadsafe(self._give)
        return True

    def end(self) -> None:
        """Give nothing more."""
        self._has_ended = True

    def _give(self) -> None:
        self._is_due = False  # before it is read: a newer one is given again
        if not self._has_ended:
            self._take(self._payload)


def _note(level: str, text: str) -> dict[str, Any]:
    return {"type": "note", "level": level, "text": text}


def how_ended(folder: RunFolder, stopped_by: str) -> dict[str, Any] | None:
    """Return the message about a run that has a result, with reason and capture; None for a run that continues or may
    be resumed. `stopped_by` is the requester of the end, if known.
    """
    if folder.result() is None:
        return None
    result = ended_outcome(folder).result
    reason, failed, capture = result["reason"], bool(result["failed"]), result["capture"]
    if stopped_by and reason == "stopped":
        reason = f"stopped by {stopped_by}"
    command = "" if capture is None else f"foosim view {shlex.quote(capture)}"
    text = f"The run has {'failed' if failed else 'ended'} at tick {result['ticks']}: {reason}. "
    if capture is None:
        text += "It has no capture."
    else:
        state = "" if is_complete(Path(capture)) else " (unfinished)"
        text += f"Its capture is {capture}{state}; this shows it: {command}"
    return {
        "type": "presence", "state": "ended", "failed": failed, "reason": reason, "capture": capture,
        "command": command, "text": text,
    }  # fmt: skip
