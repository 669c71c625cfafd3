"""The requests to a replay, by message or by key: one table of verbs. Pure."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from foosim.common.errors import BadValue, Malformed, Refused, UnknownName
from foosim.common.json_text import decode_json, encode_json
from foosim.common.units import PACE_FACTOR_MAX, PACE_FACTOR_MIN, Pace, parse_pace
from foosim.protocol.kept_answers import KeptAnswers
from foosim.protocol.messages import Answer, Request
from foosim.simulation.play.core import ENDED, PAUSED, Playback

ANSWERS_KEPT: Final = 256
SEEK_NS: Final = 5_000_000_000
STATUS, PAUSE, RESUME, STEP, SEEK, RATE, STOP = "status", "pause", "resume", "step", "seek", "rate", "stop"
ARGUMENTS: Final[Mapping[str, Mapping[str, type]]] = {
    STATUS: {},
    PAUSE: {},
    RESUME: {},
    STEP: {"count": int},
    SEEK: {"time_ns": int},
    RATE: {"pace": str},
    STOP: {},
}
"""The verbs with their arguments."""
KEYS_TEXT: Final = "space pause, s step, up/down rate, left/right 5 s, q quit"


class Requests:
    """Performs requests on one replay. `description` is added to its status."""

    def __init__(self, playback: Playback, tick_ns: int, description: Mapping[str, Any]) -> None:
        self.stopped = False
        """Whether a request has ended the replay."""
        self._playback = playback
        self._tick_ns = tick_ns
        self._description = description
        self._answers = KeptAnswers(ANSWERS_KEPT)

    def answer(self, request: Request, now_ns: int) -> Answer:
        """Perform a request once, and return its answer."""
        known = self._answers.get((request.sender, request.id))
        if known is not None:
            return known
        accepted, text, result = True, "", b"{}"
        try:
            result = encode_json(self.perform(request.verb, decode_json(request.arguments), now_ns))
        except (Refused, Malformed) as error:
            accepted, text = False, str(error)
        tick = self._playback.heading_ns(now_ns) // self._tick_ns
        return self._answers.keep(Answer(request.sender, request.id, accepted, tick, text, result))

    def perform(self, verb: str, arguments: Any, now_ns: int) -> dict[str, Any]:
        """Perform a verb; return the status after it. Raises Refused."""
        if verb not in ARGUMENTS:
            raise UnknownName("no request of a replay", verb, ARGUMENTS)
        known = ARGUMENTS[verb]
        if not isinstance(arguments, dict) or arguments.keys() != known.keys():
            raise BadValue(f"{verb} has {', '.join(known) or 'no'} argument{'' if known else 's'}", arguments)
        for name, kind in known.items():
            if not isinstance(arguments[name], kind) or isinstance(arguments[name], bool):
                what = "text" if kind is str else "a whole number"
                raise BadValue(f"{verb}: {name} is not {what}", arguments[name])
        playback = self._playback
        if playback.ended and verb not in (STATUS, STOP):
            raise Refused("the replay has ended")
        self.stopped = self.stopped or verb == STOP
        if verb == RATE:
            playback.set_pace(parse_pace(arguments["pace"]), now_ns)
        elif verb in (PAUSE, RESUME, STEP, SEEK):
            getattr(playback, verb)(*arguments.values(), now_ns)
        clock = playback.clock(now_ns)
        at = {"time_ns": playback.heading_ns(now_ns), "rate": clock.rate, "state": clock.state, "jumps": clock.jumps}
        return {**at, "published": playback.published, **self._description}

    def key(self, key: str, now_ns: int) -> None:
        """Perform the request of a key, if it has one."""
        playback = self._playback
        span, time_ns = playback.span, playback.time_ns(now_ns)
        verbs: dict[str, tuple[str, dict[str, Any]]] = {
            " ": (RESUME if playback.state() == PAUSED else PAUSE, {}),
            "s": (STEP, {"count": 1}),
            "left": (SEEK, {"time_ns": max(time_ns - SEEK_NS, span.first_ns)}),
            "right": (SEEK, {"time_ns": min(time_ns + SEEK_NS, span.last_ns)}),
            "q": (STOP, {}),
        }
        if playback.state() == ENDED:
            return
        if key in verbs:
            self.perform(*verbs[key], now_ns)
        elif key in ("up", "down"):
            playback.set_pace(_changed(playback.pace, key == "up"), now_ns)


def _changed(pace: Pace, faster: bool) -> Pace:
    """Return twice or half the pace, within its bounds; `fast` becomes `realtime`."""
    if pace.kind == "fast":
        return Pace("realtime")
    factor = pace.factor * 2 if faster else pace.factor / 2
    return Pace("realtime", min(max(factor, PACE_FACTOR_MIN), PACE_FACTOR_MAX))
