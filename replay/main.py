"""Play a capture: the shell around `playing`, a router session of its own plane, a reader, keys and requests.

The typed function behind `foosim-replay play`. One thread decides and publishes; it sleeps until the next entry, the
next clock message or a request.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from foosim.capture.reader import About, deployment_of
from foosim.common import limits
from foosim.common.addresses import Address, check_listen, parse_address
from foosim.common.errors import Malformed, Refused
from foosim.common.units import Pace
from foosim.deployment.schema import Deployment
from foosim.protocol import channels
from foosim.protocol.access import access_to
from foosim.protocol.channels import PLAYED, REPLAY, VHUB, Plane
from foosim.protocol.codec import encode
from foosim.protocol.replay_messages import CLOCK, STREAMS
from foosim.replay.address_file import noted
from foosim.replay.core import Playback
from foosim.replay.entries import Selection, make_selection
from foosim.replay.reader import ReadAhead, read_span
from foosim.replay.requests import KEYS_TEXT, Requests
from foosim.replay.terminal import Keys, Lines
from foosim.runtime.loop import Wire
from foosim.runtime.transport.certificates import check_host, load_credentials
from foosim.runtime.transport.inbox import Inbox
from foosim.runtime.transport.open_plane_warning import Exposure
from foosim.runtime.transport.session import Session
from foosim.runtime.transport.settings import Security

REALTIME: Final = Pace("realtime")
READ_AHEAD: Final = 10_000
CLOCK_NS: Final = 100_000_000
KEY: Final = "key"
"""Under which the inbox has keys of the terminal."""
FED_MAX: Final = 1_024
"""How many entries the core holds; the others wait with the reader."""


@dataclass(frozen=True, slots=True)
class PlayOptions:
    """What to play and how. Times are captured ns, but for the delay; None: the capture's own."""

    from_ns: int | None = None
    until_ns: int | None = None
    for_ns: int | None = None
    pace: Pace = REALTIME
    loop: bool = False
    paused: bool = False
    delay_ns: int = 0
    clock_ns: int = CLOCK_NS
    read_ahead: int = READ_AHEAD
    topics: tuple[str, ...] = ()
    regexes: tuple[str, ...] = ()
    excluded: tuple[str, ...] = ()
    remaps: tuple[str, ...] = ()
    listen: str = "127.0.0.1"
    insecure: bool = False
    pki: Path | None = None


@dataclass(frozen=True, slots=True)
class PlayResult:
    """What a replay did: `reason` is `end`, `stopped` (by a signal, a key or a request) or why it could not go on.

    `topics` counts what was published by name, `late_ns_*` how late against the deadlines, `slips` how often it was so
    late that time was held back; `too_large` rows did not fit a message.
    """

    capture: str
    reason: str
    failed: bool
    published: int
    topics: Mapping[str, int]
    from_ns: int
    until_ns: int
    time_ns: int
    rounds: int
    jumps: int
    wall_ns: int
    late_ns_mean: int
    late_ns_max: int
    slips: int
    too_large: int


@dataclass(slots=True)
class Stopper:
    """Lets a signal handler end a replay: `stop` can be called at any time, from any thread."""

    stopped: bool = False
    wake: Callable[[], None] = field(default=lambda: None)

    def stop(self) -> None:
        self.stopped = True
        self.wake()


def play_capture(path: Path, options: PlayOptions, lines: Lines, stopper: Stopper | None = None) -> PlayResult:
    """Play a capture to whoever listens, until its end or until stopped.

    Raises BadValue for an option that does not fit the capture, CaptureError when there is nothing to read,
    ListenError, Insecure, CertificateError.
    """
    address = check_listen(options.listen, options.insecure, secured=options.pki is not None)
    span, about = read_span(path, options.from_ns, options.until_ns, options.for_ns)
    deployment = deployment_of(about)
    selection = make_selection(deployment, options.topics, options.regexes, options.excluded, options.remaps)
    stopper = stopper or Stopper()
    inbox = Inbox(limits.INBOX_MESSAGES_MAX)
    stopper.wake = inbox.wake
    now_ns = time.monotonic_ns()
    playback = Playback(span, deployment.tick_ns, options.pace, now_ns, options.loop, options.paused, options.delay_ns)
    with ExitStack() as opened:
        session = opened.enter_context(_session(address, deployment, options.pki))
        opened.enter_context(noted(session.locator, path, options.pki))
        reader = ReadAhead(path, deployment, selection, span, options.read_ahead, inbox.wake)
        opened.callback(reader.close)

        def pressed(key: str) -> None:
            inbox.offer((KEY, key, b""))

        keys = opened.enter_context(Keys(pressed))
        requests = Requests(playback, deployment.tick_ns, _description(path, about, deployment, selection, playback))
        lines.say(f"{path}: {span.first_ns / 1e9:g} s to {span.last_ns / 1e9:g} s, listening at {session.locator}")
        if not about.finished:
            lines.say("the capture is not finished: it is played up to its last whole chunk")
        if keys.are_read:
            lines.say(KEYS_TEXT)
        return _Play(path, session, inbox, playback, reader, requests, lines, stopper, options.clock_ns).run()


def _session(address: Address, deployment: Deployment, pki: Path | None) -> Session:
    """Listen as the router of the replay plane; with certificates by that of the vHub, whose packets it has."""
    credentials = load_credentials(pki, VHUB)
    security = None if credentials is None else Security(credentials, access_to(Plane.REPLAY, deployment))
    session = Session.router(str(address), limits.SMALL_MESSAGE_BYTES_MAX, security)
    try:
        check_host(credentials, session.locator)
    except BaseException:
        session.close()
        raise
    return session


def _description(
    path: Path, about: About, deployment: Deployment, selection: Selection, playback: Playback
) -> dict[str, Any]:
    """Return what listeners are told of a replay."""
    return {
        "capture": path.name,
        "run": about.metadata.get("run", ""),
        "deployment": about.deployment_text,
        "deployment_name": about.deployment_name,
        "tick_ns": deployment.tick_ns,
        "from_ns": playback.span.first_ns,
        "until_ns": playback.span.last_ns,
        "names": dict(selection.names),
        "channels": dict(selection.channels),
    }


class _Play:
    """One replay on its session."""

    def __init__(  # noqa: PLR0913, PLR0917  # the parts of a replay
        self,
        path: Path,
        session: Session,
        inbox: Inbox,
        playback: Playback,
        reader: ReadAhead,
        requests: Requests,
        lines: Lines,
        stopper: Stopper,
        clock_ns: int,
    ) -> None:
        self._path = path
        self._inbox = inbox
        self._playback = playback
        self._reader = reader
        self._requests = requests
        self._lines = lines
        self._stopper = stopper
        self._every_ns = clock_ns
        self._clock_ns = self._show_ns = 0
        self._told = ""
        self._topics: Counter[str] = Counter()
        self._exposure = Exposure(parse_address(session.locator), time.monotonic_ns())
        self._wire = Wire(session, Plane.REPLAY, inbox, REPLAY)
        self._wire.read(channels.REPLAY_READS)
        self._wire.declare_alive()

    def run(self) -> PlayResult:
        """Play until the end; return what was done."""
        begun_ns = time.monotonic_ns()
        playback = self._playback
        while not (playback.ended or self._stopper.stopped or self._requests.stopped):
            now_ns = time.monotonic_ns()
            self._feed()
            self._publish(now_ns)
            self._tell(now_ns)
            timeout_ns = self._deadline_ns(now_ns) - time.monotonic_ns()
            for channel, name, payload in self._inbox.take(max(0, timeout_ns) / 1e9):
                self._hear(channel, name, payload)
        now_ns = time.monotonic_ns()
        reached_ns = playback.time_ns(now_ns)
        stopped = not playback.ended
        playback.ended = True
        end = encode(playback.clock(now_ns))
        for stream in STREAMS:  # each has an order of its own: its listeners know by this that nothing more comes
            self._put(stream, end)
        self._lines.end()
        found = playback.statistics()
        return PlayResult(
            str(self._path),
            "stopped" if stopped else playback.failure or "end",
            bool(playback.failure),
            found.published,
            dict(sorted(self._topics.items())),
            playback.span.first_ns,
            playback.span.last_ns,
            reached_ns,
            found.rounds,
            found.jumps,
            now_ns - begun_ns,
            found.late_ns_mean,
            found.late_ns_max,
            found.slips,
            self._reader.entries.too_large,
        )

    def _feed(self) -> None:
        """Give the core what was read of what it wants."""
        playback = self._playback
        self._reader.ask(playback.reading)
        while playback.queued < FED_MAX and (read := self._reader.take()) is not None:
            playback.feed(read.number, read.entries, read.is_last, read.problem)

    def _publish(self, now_ns: int) -> None:
        for entry in self._playback.advance(now_ns):
            self._put(entry.stream, entry.payload)
            self._topics[entry.topic] += 1

    def _put(self, stream: str, payload: bytes) -> None:
        self._wire.put(PLAYED, stream, payload)

    def _tell(self, now_ns: int) -> None:
        """Tell listeners the time now and then, and at each change; show it to the person at the terminal."""
        clock = self._playback.clock(now_ns)
        change = f"{clock.state} {clock.rate} {clock.jumps}"
        if now_ns >= self._clock_ns or change != self._told:
            self._clock_ns = now_ns + self._every_ns
            self._put(CLOCK, encode(clock))
        if now_ns >= self._show_ns or change != self._told:
            self._show_ns = now_ns + self._lines.every_ns
            published = self._playback.statistics().published
            self._lines.show(f"{clock.time_ns / 1e9:.3f} s, {clock.state} {clock.rate}, {published} published")
        self._told = change
        reminder = self._exposure.due(now_ns)
        if reminder:
            self._lines.say(reminder)

    def _deadline_ns(self, now_ns: int) -> int:
        wanted_ns = self._playback.deadline_ns(now_ns)
        marks = [self._clock_ns, self._show_ns]
        return min(marks if wanted_ns is None else [*marks, wanted_ns])

    def _hear(self, channel: str, name: str, payload: bytes) -> None:
        now_ns = time.monotonic_ns()
        try:
            if channel == KEY:
                self._requests.key(name, now_ns)
            elif channel == channels.REPLAY_REQUEST.key:
                request = channels.read(channels.REPLAY_REQUEST, name, payload)
                answer = self._requests.answer(request, now_ns)
                self._wire.put(channels.REPLAY_ANSWER, name, encode(answer))
        except Malformed:
            self._requests.refused += 1
        except Refused as refused:
            self._lines.say(str(refused))
