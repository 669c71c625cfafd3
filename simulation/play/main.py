"""Plays a capture: the shell around `replay.core`, the router of a plane of its own, keys and requests.

The function behind `foosim capture play`. One thread reads, decides and publishes; it sleeps until the next entry,
the next clock message or a request.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Final

from foosim.capture.foxglove import SCENE
from foosim.capture.index import CaptureIndex
from foosim.capture.reader import About, Scan, deployment_of
from foosim.common import limits
from foosim.common.addresses import Address, check_listen, parse_address
from foosim.common.errors import BadValue, Malformed, Refused
from foosim.common.units import Pace, format_ns
from foosim.deployment.schema import Deployment
from foosim.protocol import channels
from foosim.protocol.access import access_to
from foosim.protocol.channels import PLAYED, REPLAY, VHUB, Plane
from foosim.protocol.codec import encode
from foosim.protocol.replay_messages import CLOCK, STREAMS
from foosim.runtime.roles.wire import Wire
from foosim.runtime.transport.admission import Exposure
from foosim.runtime.transport.certificates import check_host, load_credentials
from foosim.runtime.transport.inbox import Inbox
from foosim.runtime.transport.session import Session
from foosim.runtime.transport.settings import Security
from foosim.simulation.play.address_file import noted
from foosim.simulation.play.core import Playback, Span
from foosim.simulation.play.entries import Entries, Entry, make_selection
from foosim.simulation.play.requests import KEYS_TEXT, Requests
from foosim.simulation.play.terminal import Lines, keys_of_terminal

REALTIME: Final = Pace("realtime")
CLOCK_NS: Final = 100_000_000
KEY: Final = "key"
"""The inbox's channel of keys of the terminal."""


@dataclass(frozen=True, slots=True)
class PlayOptions:
    """What to play and how. Times are captured ns; None: the capture's own."""

    from_ns: int | None = None
    until_ns: int | None = None
    pace: Pace = REALTIME
    loop: bool = False
    paused: bool = False
    topics: tuple[str, ...] = ()
    remaps: tuple[str, ...] = ()
    listen: str = "127.0.0.1"
    insecure: bool = False
    pki: Path | None = None


@dataclass(frozen=True, slots=True)
class PlayResult:
    """The result of a replay: `reason` is `end`, `stopped` (by a signal, a key or a request) or why it ended early.

    `topics` counts published entries by captured name; `late_ns_max` is the greatest lag behind a deadline, `slips` how
    often a lag was so long that the anchor moved; `too_large` rows did not fit into a message.
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


def read_span(path: Path, from_ns: int | None = None, until_ns: int | None = None) -> tuple[Span, About]:
    """Return the part of a capture to play, and its metadata, by its chunks' heads alone.

    Raises CaptureError for other files, BadValue for times that it does not have.
    """
    scan = Scan(path, limits.COUNTER_MAX)
    for _ in scan.messages():
        pass
    about = scan.about
    first_ns, last_ns = about.start_ns, about.end_ns
    ends = f"the capture has {format_ns(first_ns)} to {format_ns(last_ns)}"
    begin_ns = max(first_ns, from_ns or 0)
    if begin_ns > last_ns:
        raise BadValue(f"--from: {ends}", format_ns(begin_ns))
    if until_ns is not None and until_ns < begin_ns:
        raise BadValue(f"--until: before the beginning; {ends}", format_ns(until_ns))
    return Span(begin_ns, last_ns if until_ns is None else min(last_ns, until_ns)), about


def entries_at(path: Path, entries: Entries, time_ns: int) -> Iterator[Entry]:
    """Yield the entries of a capture from a captured time on, first the scene of that time. Raises CaptureError."""
    if time_ns and entries.has_scene:
        index = CaptureIndex(path, (SCENE,))
        number = index.places[SCENE].newest(time_ns - 1)
        entry = entries.view(index.read(SCENE, number), time_ns) if number >= 0 else None
        if entry is not None:
            yield entry
    scan = Scan(path, max(0, time_ns - 2 * entries.tick_ns))
    for entry in entries.of(scan.messages(), scan.decode):
        if entry.time_ns >= time_ns:
            yield entry


def play_capture(path: Path, options: PlayOptions, lines: Lines, stopper: Stopper | None = None) -> PlayResult:
    """Play a capture to its listeners, until its end or until stopped.

    Raises BadValue for an option that does not fit the capture, CaptureError for a file that cannot be read,
    ListenError, Insecure, CertificateError.
    """
    address = check_listen(options.listen, options.insecure, secured=options.pki is not None)
    span, about = read_span(path, options.from_ns, options.until_ns)
    deployment = deployment_of(about)
    selection = make_selection(deployment, options.topics, options.remaps)
    entries = Entries(deployment, selection)
    stopper = stopper or Stopper()
    inbox = Inbox(limits.INBOX_MESSAGES_MAX)
    stopper.wake = inbox.wake
    playback = Playback(
        partial(entries_at, path, entries), span, deployment.tick_ns, options.pace, options.loop, options.paused
    )
    description = {
        "capture": path.name,
        "run": about.metadata.get("run", ""),
        "deployment": about.deployment_text,
        "deployment_name": about.deployment_name,
        "tick_ns": deployment.tick_ns,
        "from_ns": span.first_ns,
        "until_ns": span.last_ns,
        "names": dict(selection.names),
        "channels": dict(selection.channels),
    }
    with ExitStack() as opened:
        session = opened.enter_context(_session(address, deployment, options.pki))
        opened.enter_context(noted(session.locator, path, options.pki))
        has_keys = opened.enter_context(keys_of_terminal(lambda key: inbox.offer((KEY, key, b""))))
        lines.print(f"{path}: {span.first_ns / 1e9:g} s to {span.last_ns / 1e9:g} s, listening at {session.locator}")
        if not about.finished:
            lines.print("the capture is not finished: it is played up to its last whole chunk")
        if has_keys:
            lines.print(KEYS_TEXT)
        requests = Requests(playback, deployment.tick_ns, description)
        play = _Play(session, inbox, playback, requests, lines)
        wall_ns = play.run(stopper)
    return PlayResult(
        str(path),
        playback.failure or ("end" if play.at_end else "stopped"),
        bool(playback.failure),
        playback.published,
        dict(sorted(play.topics.items())),
        span.first_ns,
        span.last_ns,
        play.time_ns,
        playback.rounds,
        playback.jumps,
        wall_ns,
        playback.late_ns_max,
        playback.slips,
        entries.too_large,
    )


def _session(address: Address, deployment: Deployment, pki: Path | None) -> Session:
    """Listen as the router of the replay plane; with the vHub's certificate, since a replay has all packets."""
    credentials = load_credentials(pki, VHUB)
    security = None if credentials is None else Security(credentials, access_to(Plane.REPLAY, deployment))
    session = Session.router(str(address), limits.SMALL_MESSAGE_BYTES_MAX, security)
    try:
        check_host(credentials, session.locator)
    except BaseException:
        session.close()
        raise
    return session


class _Play:
    """One replay on its session."""

    def __init__(self, session: Session, inbox: Inbox, playback: Playback, requests: Requests, lines: Lines) -> None:
        self.topics: Counter[str] = Counter()
        self.at_end = False
        self.time_ns = 0
        self._inbox = inbox
        self._playback = playback
        self._requests = requests
        self._lines = lines
        self._clock_ns = self._show_ns = 0
        self._shown = ""
        self._exposure = Exposure(parse_address(session.locator), time.monotonic_ns())
        self._wire = Wire(session, Plane.REPLAY, inbox, REPLAY)
        self._wire.read(channels.REPLAY_READS)
        self._wire.declare_alive()

    def run(self, stopper: Stopper) -> int:
        """Play until the end; return how long it took (ns)."""
        begun_ns = time.monotonic_ns()
        playback = self._playback
        while not (playback.ended or stopper.stopped or self._requests.stopped):
            now_ns = time.monotonic_ns()
            for entry in playback.advance(now_ns):
                self._wire.put(PLAYED, entry.stream, entry.payload)
                self.topics[entry.topic] += 1
            self._report(now_ns)
            due_ns = playback.deadline_ns(now_ns)
            marks = [self._clock_ns, self._show_ns, *([] if due_ns is None else [due_ns])]
            for channel, name, payload in self._inbox.take(max(0, min(marks) - time.monotonic_ns()) / 1e9):
                self._on_message(channel, name, payload)
        now_ns = time.monotonic_ns()
        self.time_ns, self.at_end = playback.time_ns(now_ns), playback.ended
        playback.ended = True
        end = encode(playback.clock(now_ns))
        for stream in STREAMS:  # each stream has an order of its own, so each has an end
            self._wire.put(PLAYED, stream, end)
        self._lines.end()
        return now_ns - begun_ns

    def _report(self, now_ns: int) -> None:
        """Publish the time and show it, regularly and at each change."""
        clock = self._playback.clock(now_ns)
        state = f"{clock.state} {clock.rate} {clock.jumps}"
        if now_ns >= self._clock_ns or state != self._shown:
            self._clock_ns = now_ns + CLOCK_NS
            self._wire.put(PLAYED, CLOCK, encode(clock))
        if now_ns >= self._show_ns or state != self._shown:
            self._show_ns = now_ns + self._lines.every_ns
            published = self._playback.published
            self._lines.show(f"{clock.time_ns / 1e9:.3f} s, {clock.state} {clock.rate}, {published} published")
        self._shown = state
        if reminder := self._exposure.due(now_ns):
            self._lines.print(reminder)

    def _on_message(self, channel: str, name: str, payload: bytes) -> None:
        now_ns = time.monotonic_ns()
        try:
            if channel == KEY:
                self._requests.key(name, now_ns)
            elif channel == channels.REPLAY_REQUEST.key:
                answer = self._requests.answer(channels.read(channels.REPLAY_REQUEST, name, payload), now_ns)
                self._wire.put(channels.REPLAY_ANSWER, name, encode(answer))
        except Malformed:
            pass  # a request that cannot be read has no id to answer
        except Refused as refused:
            self._lines.print(str(refused))
