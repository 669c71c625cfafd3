"""One clock for one or two sources: two captures, run and what-if, simulation and a recorded reality.

The clock is simulated time. A source that follows shows its own tick at that time, plus its offset. A `Deck` is the
clock of recordings, `leading.HeardClock` that of a source that has its own.
"""

from __future__ import annotations

import asyncio
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from fractions import Fraction
from math import ceil
from typing import Any, Final

from foosim.common.errors import BadValue, show
from foosim.common.names import nearest_name
from foosim.common.units import Pace, parse_pace
from foosim.console.shown.source import Answered, InvalidRequest

Known = Mapping[str, Mapping[str, tuple[type, ...]]]
ARGUMENTS: Final[Known] = {
    "play": {},
    "resume": {},
    "pause": {},
    "step": {"count": (int,), "unit": (str,)},
    "seek": {"tick": (int,)},
    "rate": {"pace": (str,)},
    "loop": {"on": (bool,)},
}
"""The requests of a deck, with the arguments of each."""
VERBS: Final = tuple(ARGUMENTS)
UNITS: Final = ("ticks", "frames")
STEP_MAX: Final = 1_000_000


class Clock(ABC):
    """Simulated time that sources follow, and the waiters for its changes; all of it in the event loop's thread."""

    def __init__(self, tick_ns: int, clock_ns: Callable[[], int]) -> None:
        """`tick_ns`: of the first source. `clock_ns` is a monotonic wall clock."""
        self.tick_ns = tick_ns
        self.clock_ns: Final = clock_ns
        self.paused = True
        self.jumps = 0
        """How often time has jumped: paths are cut where this changes."""
        self.changes = 0
        """How often it has changed otherwise than by time that passes."""
        self._waiting: set[asyncio.Event] = set()

    @abstractmethod
    def time_ns(self) -> int:
        """Return the simulated time that was reached."""

    @abstractmethod
    def wall_ns(self, time_ns: int) -> int | None:
        """Return the wall time at which a simulated time is reached; None where it is paused, or not known."""

    def account(self) -> dict[str, Any]:
        """Return its part of a status."""
        return {"state": "paused" if self.paused else "running"}

    def changed(self) -> None:
        """Wake the waiters: a request was done, the ends have changed, or time has been set."""
        self.changes += 1
        for event in self._waiting:
            event.set()

    async def wait(self, until_ns: int | None, seen: int) -> None:
        """Wait for another change than the first `seen`, at most until a wall time."""
        if self.changes != seen:
            return
        event = asyncio.Event()
        self._waiting.add(event)
        try:
            timeout = None if until_ns is None else max(0, until_ns - self.clock_ns()) / 1e9
            async with asyncio.timeout(timeout):
                await event.wait()
        except TimeoutError:
            return
        finally:
            self._waiting.discard(event)


class Deck(Clock):
    """The position in a recording from tick `first` to `last`: playing, paused, stepped, sought, looped, at a rate.

    It starts paused at the first tick. A position is a tick, with a fraction while it plays.
    """

    def __init__(self, first: int, last: int, tick_ns: int, clock_ns: Callable[[], int]) -> None:
        super().__init__(tick_ns, clock_ns)
        self.first, self.last = first, last
        self.pace = Pace("realtime")
        self.loops = False
        self._at = Fraction(first)
        """Position at the anchor."""
        self._anchor_ns = 0
        """Wall time of it, while it plays."""

    def time_ns(self) -> int:
        return self.tick() * self.tick_ns

    def wall_ns(self, time_ns: int) -> int | None:
        if self.paused:
            return None
        tick = -(-time_ns // self.tick_ns)
        return self._anchor_ns + ceil((tick - self._at) * self.tick_ns / self.pace.factor)

    def account(self) -> dict[str, Any]:
        return {**super().account(), "pace": str(self.pace), "loop": self.loops}

    def tick(self) -> int:
        """Return the tick that was reached; at its end a recording begins again or pauses."""
        return int(self._advance(self.clock_ns()))

    def _advance(self, now_ns: int) -> Fraction:
        """Return the position at a wall time."""
        if self.paused:
            return self._at
        at = self._at + max(0, now_ns - self._anchor_ns) * self.pace.factor / self.tick_ns
        if at < self.last:
            return at
        if not self.loops or self.first == self.last:
            self._at, self.paused = Fraction(self.last), True
            return self._at
        self.jumps += 1
        self._at, self._anchor_ns = self.first + (at - self.last) % (self.last - self.first), now_ns
        return self._at

    def _anchor(self, at: Fraction | int, now_ns: int) -> None:
        self._at, self._anchor_ns = Fraction(at), now_ns

    def grow(self, first: int, last: int) -> None:
        """Take other ends: a recording that is still being written has grown, or let its oldest files go."""
        now_ns = self.clock_ns()
        at = self._advance(now_ns)
        self.first, self.last = first, last
        self.jumps += at < first
        self._anchor(min(max(at, Fraction(first)), Fraction(last)), now_ns)
        self.changed()

    # --- requests ----------------------------------------------------------------------------------------------------

    def request(
        self, verb: str, arguments: Mapping[str, Any], neighbour: Callable[[int, bool], int | None]
    ) -> Answered:
        """Execute a request at one wall time. `neighbour` gives the next recorded tick, later or earlier.

        Raises InvalidRequest for an unknown verb, BadValue for wrong arguments.
        """
        checked(verb, arguments)
        now_ns = self.clock_ns()
        if verb in ("play", "resume"):
            self._play(now_ns)
        elif verb == "pause":
            self._pause(now_ns)
        elif verb == "step":
            self._step(arguments.get("count", 1), arguments.get("unit", "ticks"), neighbour, now_ns)
        elif verb == "seek":
            self._seek(needed(verb, arguments, "tick"), now_ns)
        elif verb == "rate":
            self._set_rate(needed(verb, arguments, "pace"), now_ns)
        else:
            self.loops = needed(verb, arguments, "on")
        self.changed()
        tick = int(self._advance(now_ns))
        return Answered(self._text(verb, tick), tick)

    def _play(self, now_ns: int) -> None:
        """Play; at the end, from the beginning."""
        if self.paused:
            if self._at >= self.last:
                self._seek(self.first, now_ns)
            self.paused = False
            self._anchor(self._at, now_ns)

    def _pause(self, now_ns: int) -> None:
        """Pause, at a whole tick."""
        self._at, self.paused = Fraction(int(self._advance(now_ns))), True

    def _seek(self, tick: int, now_ns: int) -> None:
        if not self.first <= tick <= self.last:
            raise BadValue(f"seek: not a tick of the recording, which has {self.first} to {self.last}", tick)
        self.jumps += 1
        self._anchor(tick, now_ns)

    def _step(self, count: int, unit: str, neighbour: Callable[[int, bool], int | None], now_ns: int) -> None:
        """Go some ticks or recorded moments forward, or back where negative, as far as there are any; pause there."""
        if unit not in UNITS:
            raise BadValue(f"step: a unit is {' or '.join(UNITS)}", unit, nearest_name(unit, UNITS))
        if unit == "frames":
            here = int(self._advance(now_ns))
            there = neighbour(here, count > 0)
            count = (there - here) if there is not None else 0
            if not count:
                raise BadValue(f"step: nothing is recorded {'after' if there is None else 'at'} tick {here}")
        if not count or abs(count) > STEP_MAX:
            raise BadValue(f"step: a count out of range 1 to {STEP_MAX}, or negative to go back", count)
        self._pause(now_ns)
        self.jumps += count < 0
        self._at = Fraction(min(max(int(self._at) + count, self.first), self.last))

    def _set_rate(self, text: str, now_ns: int) -> None:
        """Continue at another rate. Raises BadValue: a page has no `fast`."""
        pace = parse_pace(text)
        if pace.kind == "fast":
            raise BadValue("rate: a recording is shown at realtime or a factor such as 8x", text)
        self._anchor(self._advance(now_ns), now_ns)
        self.pace = pace

    def _text(self, verb: str, tick: int) -> str:
        where = f"tick {tick}, {tick * self.tick_ns / 1e9:g} s"
        if verb == "rate":
            return f"at {self.pace} from {where} on"
        if verb == "loop":
            return "begins again at its end" if self.loops else "pauses at its end"
        return f"{'paused' if self.paused else 'plays'} at {where}"


def checked(verb: str, arguments: Mapping[str, Any], known: Known = ARGUMENTS) -> None:
    """Raise InvalidRequest for an unknown verb, BadValue for an unknown argument or one of another type."""
    if verb not in known:
        nearest = nearest_name(verb, known)
        hint = "" if nearest is None else f", nearest is {nearest}"
        raise InvalidRequest(f"a recording has no request {show(verb)}: valid are {', '.join(known)}{hint}")
    for name, value in arguments.items():
        types = known[verb].get(name)
        if types is None:
            raise BadValue(f"{verb} has {', '.join(known[verb]) or 'no argument'}, not", name)
        if type(value) not in types:
            what = {int: "a whole number", str: "a text", bool: "true or false"}[types[0]]
            raise BadValue(f"{verb}: {name} is not {what}", value)


def needed(verb: str, arguments: Mapping[str, Any], name: str) -> Any:
    """Return a required argument of a verb. Raises BadValue."""
    if name not in arguments:
        raise BadValue(f"{verb} needs {name}")
    return arguments[name]
