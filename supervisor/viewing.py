"""Viewers of a run: committed frames are published for as long as a viewer has a lease.

The verb `watch` begins or renews a lease, `describe` returns what a viewer needs to read frames. A frame is published
on `view` as the bytes that were journalled, at the highest rate of the leases by wall time; a frame whose edits change
the layout at once; the last one at the next wake, so that a paused world shows its last frame. Leases are not
journalled: viewers renew them with a supervisor that was started again.
"""

from __future__ import annotations

import base64
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Final

from foosim.common import limits
from foosim.common.errors import Refused, show
from foosim.common.json_text import encode_json
from foosim.common.names import nearest_name
from foosim.protocol import channels
from foosim.protocol.actions import Publish
from foosim.protocol.messages import Answer, Heartbeat, Request, Watched
from foosim.supervisor.state import RunState
from foosim.world.edits import Add, Edit, Remove

LEASE_NS: Final = 5_000_000_000
HZ_MAX: Final = 100.0
BYTES_PER_S_MAX: Final = 5_000_000
"""Of frames: those of a large world are published less often."""
FRAME_BYTES_MAX: Final = 384 * 1024
"""A larger commit is not in the answer to `describe`, and comes with the lease."""
_NS_PER_S: Final = 1_000_000_000

Pair = tuple[str, str]


@dataclass(frozen=True, slots=True)
class _Lease:
    """The frames per second, links and readings that one viewer requests, and until when."""

    hz: float
    links: list[Pair]
    readings: list[Pair]
    until_ns: int


class Viewing:
    """The leases, and the frames that are published for them."""

    def __init__(self, state: RunState) -> None:
        self.is_shown = False
        """Whether a viewer requests frames: the only check at a commit without viewers."""
        self._state = state
        self._leases: dict[str, _Lease] = {}
        """By requester."""
        self._watched = Watched([], [])
        """The set last sent to the vHub."""
        self._sent_at: Heartbeat | None = None
        """Its last heartbeat before that."""
        self._period_ns = self._due_ns = 0
        self._unseen = b""
        """The last commit, while it has not been shown."""

    def watch(self, request: Request, arguments: dict[str, Any], now_ns: int) -> Answer:
        """Begin or renew a lease; the answer has its rate and duration. Raises Refused."""
        hz = _rate(arguments.get("hz"))
        links = _pairs("links", arguments.get("links"), self._link)
        readings = _pairs("readings", arguments.get("readings"), self._reading)
        self._end_leases(now_ns)
        if request.sender not in self._leases and len(self._leases) >= limits.OPERATORS_MAX:
            raise Refused(f"{limits.OPERATORS_MAX} watch the run already")
        known = self._leases.get(request.sender)
        leases = {**self._leases, request.sender: _Lease(hz, links, readings, now_ns + LEASE_NS)}
        watched = _watched_by(leases.values())
        self._leases = leases
        if watched != self._watched or links or readings:
            self._send_watched(watched)
        self._set_rate()
        if hz and not (known is not None and known.hz):
            self._unseen = self._last_commit
        got = min(hz, _NS_PER_S / self._period_ns) if hz else 0.0
        return self._answer(request, {"hz": got, "lease_s": LEASE_NS / _NS_PER_S})

    def describe(self, request: Request, arguments: dict[str, Any], now_ns: int) -> Answer:
        """Answer with deployment, owners and layout, by which a viewer reads the frames."""
        state, run = self._state, self._state.settings
        commit = self._last_commit
        has_frame = 0 < len(commit) <= FRAME_BYTES_MAX
        what = {
            "run": run.run,
            "deployment_name": run.deployment_name,
            "deployment": run.deployment_text,
            "layout": state.frame.layout.digest.hex(),
            "pace": str(state.pacer.pace),
            "owners": state.owners,
            "epoch": state.epoch,
            "first_tick": state.first_tick,
            "tick": state.frame.tick,
            "frame": base64.b64encode(commit).decode() if has_frame else None,
        }
        return self._answer(request, what)

    def committed(self, payload: bytes, edits: Sequence[Edit], now_ns: int) -> None:
        """Publish a commit when it is due, or when an entity is added or removed with it."""
        self._unseen = payload
        if now_ns >= self._due_ns or any(isinstance(edit, Add | Remove) for edit in edits):
            self._show(now_ns)

    def wake(self, now_ns: int) -> None:
        """End leases that were not renewed; publish the last commit if it has not been."""
        if self._leases:
            self._end_leases(now_ns)
        if self._hub_is_wrong():
            self._send_watched(self._watched)
        if self._unseen and now_ns >= self._due_ns:
            self._show(now_ns)

    def _show(self, now_ns: int) -> None:
        self._state.actions.append(Publish(channels.VIEW, channels.SUPERVISOR, self._unseen))
        self._unseen = b""
        self._due_ns += self._period_ns
        if self._due_ns <= now_ns:  # nothing is made up for
            self._due_ns = now_ns + self._period_ns

    def _end_leases(self, now_ns: int) -> None:
        over = [name for name, lease in self._leases.items() if lease.until_ns <= now_ns]
        for name in over:
            self._leases.pop(name)
        if over:
            self._set_rate()
            watched = _watched_by(self._leases.values())
            if watched != self._watched:
                self._send_watched(watched)

    def hub_ready(self) -> None:
        """Send a restarted vHub the links and readings to report."""
        if self._is_watching:
            self._send_watched(self._watched)

    def _hub_is_wrong(self) -> bool:
        """Whether the vHub reports values that no viewer requests, after a missed message or a failover."""
        hub = self._state.roster.by_name.get(channels.VHUB)
        keeps = hub is not None and "watched" in hub.report and hub.heartbeat is not self._sent_at
        return keeps and not self._is_watching and self._state.end is None

    def _send_watched(self, watched: Watched) -> None:
        self._watched = watched
        hub = self._state.roster.by_name.get(channels.VHUB)
        self._sent_at = None if hub is None else hub.heartbeat
        self._state.publish(channels.WATCHED, channels.SUPERVISOR, watched)

    @property
    def _is_watching(self) -> bool:
        return bool(self._watched.links or self._watched.readings)

    def _link(self, source: str, destination: str) -> None:
        """Raise Refused for a link whose ends are no endpoints."""
        ends = self._state.deployment.endpoints()
        for name in (source, destination):
            chosen("endpoint", name, ends)

    def _reading(self, robot: str, channel: str) -> None:
        """Raise Refused for a channel other than the robot's sensors."""
        robots = self._state.deployment.robots
        sensors = robots[chosen("robot", robot, sorted(robots))].sensors
        chosen(f"sensor of {robot}", channel, sorted(sensors))

    @property
    def _last_commit(self) -> bytes:
        """The last published commit; empty before the first."""
        return self._state.commits.get(self._state.frame.tick, b"")

    def _set_rate(self) -> None:
        """Publish frames at the highest rate of the leases that their size allows."""
        hz = max((lease.hz for lease in self._leases.values()), default=0.0)
        self.is_shown = hz > 0.0
        if self.is_shown:
            self._period_ns = round(_NS_PER_S / min(hz, BYTES_PER_S_MAX / max(1, len(self._last_commit))))
        else:
            self._unseen = b""

    def _answer(self, request: Request, result: dict[str, Any]) -> Answer:
        return Answer(request.sender, request.id, True, self._state.frame.tick, "", encode_json(result))


def _rate(value: object) -> float:
    """Return the requested frames per second; 0 is none."""
    if value is None:
        return 0.0
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 <= value <= HZ_MAX:
        raise Refused(f"hz: a number from 0 to {HZ_MAX:g} is needed, not {show(value)}")
    return float(value)


def _watched_by(leases: Iterable[_Lease]) -> Watched:
    """Return the links and readings of some leases together. Raises Refused when these are too many."""
    links: set[Pair] = set()
    readings: set[Pair] = set()
    for lease in leases:
        links.update(lease.links)
        readings.update(lease.readings)
    for what, pairs in (("links", links), ("readings", readings)):
        if len(pairs) > limits.WATCHED_MAX:
            raise Refused(f"{what}: at most {limits.WATCHED_MAX} can be watched at once, these would be {len(pairs)}")
    return Watched(sorted(links), sorted(readings))


def _pairs(what: str, value: object, check: Callable[[str, str], None]) -> list[Pair]:
    """Return requested pairs of names. Raises Refused, as `check` does."""
    pairs = [] if value is None else value
    if not isinstance(pairs, list) or len(pairs) > limits.WATCHED_MAX:
        raise Refused(f"{what}: a list of at most {limits.WATCHED_MAX} pairs of names is needed")
    found: list[Pair] = []
    for pair in pairs:
        if not isinstance(pair, list) or len(pair) != 2 or not all(isinstance(name, str) for name in pair):
            raise Refused(f"{what}: a pair of names is needed, not {show(pair)}")
        check(*pair)
        found.append((pair[0], pair[1]))
    return found


def chosen(what: str, name: str, choices: Sequence[str]) -> str:
    """Return the name; raises Refused, with the choices, for another one."""
    if name in choices:
        return name
    nearest = nearest_name(name, choices)
    hint = f", nearest is {nearest}" if nearest else ""
    raise Refused(f"no {what} {show(name)}; there are {', '.join(choices) or 'none'}{hint}")
