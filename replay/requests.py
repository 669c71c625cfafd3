"""What can be asked of a replay that runs, by key or by request: one table of verbs. Pure.

The same request gets the same answer, so it can be said again until it is answered.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Mapping
from typing import Any, Final

from foosim.common.errors import BadValue, Malformed, Refused, show
from foosim.common.json_text import decode_json, encode_json
from foosim.common.names import nearest_name
from foosim.common.units import PACE_FACTOR_MAX, PACE_FACTOR_MIN, Pace, parse_pace
from foosim.protocol.messages import Answer, Request
from foosim.replay.core import ENDED, PAUSED, Playback

ASKING_MAX: Final = 256
"""Of how many that asked the last answer is kept."""
SEEK_NS: Final = 5_000_000_000
STATUS, PAUSE, RESUME, STEP, SEEK, RATE, STOP = "status", "pause", "resume", "step", "seek", "rate", "stop"
ARGUMENTS: Final[Mapping[str, tuple[str, type] | None]] = {
    STATUS: None,
    PAUSE: None,
    RESUME: None,
    STEP: ("count", int),
    SEEK: ("time_ns", int),
    RATE: ("pace", str),
    STOP: None,
}
"""The verbs, each with its argument."""

KEYS_TEXT: Final = "space pause, s step, up/down rate, left/right 5 s, q quit"


class Requests:
    """Answers requests about one replay. `description` is told with its status: what it plays."""

    def __init__(self, playback: Playback, tick_ns: int, description: Mapping[str, Any]) -> None:
        self.stopped = False
        """Whether somebody asked it to end."""
        self.refused = 0
        self._playback = playback
        self._tick_ns = tick_ns
        self._description = description
        self._answers: OrderedDict[str, Answer] = OrderedDict()

    def answer(self, request: Request, now_ns: int) -> Answer:
        """Do what is asked, once, and return the answer."""
        known = self._answers.get(request.sender)
        if known is not None and known.id == request.id:
            return known
        accepted, text, result = True, "", b"{}"
        try:
            result = encode_json(self._perform(request, now_ns))
        except (Refused, Malformed) as error:
            accepted, text = False, str(error)
            self.refused += 1
        tick = self._playback.goal_ns(now_ns) // self._tick_ns
        answer = Answer(request.sender, request.id, accepted, tick, text, result)
        self._answers[request.sender] = answer
        self._answers.move_to_end(request.sender)
        while len(self._answers) > ASKING_MAX:
            self._answers.popitem(last=False)
        return answer

    def _perform(self, request: Request, now_ns: int) -> dict[str, Any]:
        verb = request.verb
        if verb not in ARGUMENTS:
            nearest = nearest_name(verb, ARGUMENTS)
            what = f"no request of a replay (there are: {', '.join(ARGUMENTS)})"
            raise BadValue(what, verb, None if nearest is None else show(nearest))
        arguments = decode_json(request.arguments)
        wanted = ARGUMENTS[verb]
        names = [] if wanted is None else [wanted[0]]
        if not isinstance(arguments, dict) or sorted(arguments) != names:
            raise BadValue(f"{verb} has {', '.join(names) or 'no'} argument{'' if names else 's'}", arguments)
        value = None
        if wanted is not None:
            value = arguments[wanted[0]]
            if not isinstance(value, wanted[1]) or isinstance(value, bool):
                raise BadValue(f"{verb}: {wanted[0]} is not {'text' if wanted[1] is str else 'a whole number'}", value)
        self.perform(verb, value, now_ns)
        return self.status(now_ns)

    def perform(self, verb: str, value: Any, now_ns: int) -> None:
        """Do what a verb says. Raises BadValue."""
        playback = self._playback
        if playback.ended and verb not in (STATUS, STOP):
            raise Refused("the replay has ended")
        if verb == PAUSE:
            playback.pause(now_ns)
        elif verb == RESUME:
            playback.resume(now_ns)
        elif verb == STEP:
            playback.step(value, now_ns)
        elif verb == SEEK:
            playback.seek(value, now_ns)
        elif verb == RATE:
            playback.set_pace(parse_pace(value), now_ns)
        elif verb == STOP:
            self.stopped = True

    def status(self, now_ns: int) -> dict[str, Any]:
        """Return where the replay is, and what it plays."""
        clock = self._playback.clock(now_ns)
        goal_ns = self._playback.goal_ns(now_ns)
        place = {"time_ns": goal_ns, "rate": clock.rate, "state": clock.state, "jumps": clock.jumps}
        return {**place, "published": self._playback.statistics().published, **self._description}

    def key(self, key: str, now_ns: int) -> None:
        """Do what a key says; one without a meaning does nothing."""
        playback = self._playback
        state = playback.state(now_ns)
        if state == ENDED:
            return
        if key == " ":
            self.perform(RESUME if state == PAUSED else PAUSE, None, now_ns)
        elif key == "s":
            self.perform(STEP, 1, now_ns)
        elif key in ("up", "down"):
            playback.set_pace(_changed(playback.pace, key == "up"), now_ns)
        elif key in ("left", "right"):
            wanted_ns = playback.time_ns(now_ns) + (SEEK_NS if key == "right" else -SEEK_NS)
            span = playback.span
            self.perform(SEEK, min(max(wanted_ns, span.first_ns), span.last_ns), now_ns)
        elif key == "q":
            self.perform(STOP, None, now_ns)


def _changed(pace: Pace, faster: bool) -> Pace:
    """Return twice or half the pace, within its bounds; `fast` has no double, and is left to realtime."""
    if pace.kind == "fast":
        return Pace("realtime")
    factor = pace.factor * 2 if faster else pace.factor / 2
    return Pace("realtime", min(max(factor, PACE_FACTOR_MIN), PACE_FACTOR_MAX))
