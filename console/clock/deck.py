"""One clock for one or two sources: two captures, run and what-if, simulation and a recorded reality.

The clock is simulated time. A source that follows shows its own tick at that time, plus its offset. A `Deck` is the
clock of recordings, `leading.HeardClock` that of a source that has its own.
"""

from __future__ import annotations

import asyncio
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from typing import Any, Final

from foosim.common.errors import BadValue, show
from foosim.common.names import nearest_name
from foosim.console.clock.playhead import Playhead
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
"""The requests of a playhead, with the arguments of each."""
VERBS: Final = tuple(ARGUMENTS)
UNITS: Final = ("ticks", "frames")


class Clock(ABC):
    """Simulated time that sources follow, and the waiters for its changes; all of it in the event loop's thread."""

    def __init__(self, tick_ns: int, clock_ns: Callable[[], int]) -> None:
        """`tick_ns`: of the first source. `clock_ns` is a monotonic wall clock."""
        self.tick_ns = tick_ns
        self.clock_ns: Final = clock_ns
        self.changes = 0
        """How often it has changed otherwise than by time that passes."""
        self._waiting: set[asyncio.Event] = set()

    @property
    @abstractmethod
    def jumps(self) -> int:
        """How often time has jumped: paths are cut where this changes."""

    @property
    @abstractmethod
    def paused(self) -> bool:
        """Whether time is paused."""

    @abstractmethod
    def time_ns(self) -> int:
        """Return the simulated time that was reached."""

    @abstractmethod
    def wall_ns(self, time_ns: int) -> int | None:
        """Return the wall time at which a simulated time is reached; None where it is paused, or not known."""

    @abstractmethod
    def account(self) -> dict[str, Any]:
        """Return its part of a status."""

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
    """A playhead in ticks of the first source."""

    def __init__(self, playhead: Playhead, tick_ns: int, clock_ns: Callable[[], int]) -> None:
        """`clock_ns` is a monotonic wall clock."""
        super().__init__(tick_ns, clock_ns)
        self.playhead: Final = playhead

    @property
    def jumps(self) -> int:
        return self.playhead.jumps

    @property
    def paused(self) -> bool:
        return self.playhead.paused

    def time_ns(self) -> int:
        return self.playhead.tick(self.clock_ns()) * self.tick_ns

    def wall_ns(self, time_ns: int) -> int | None:
        return self.playhead.wall_ns(-(-time_ns // self.tick_ns))

    def account(self) -> dict[str, Any]:
        head = self.playhead
        return {"state": "paused" if head.paused else "running", "pace": str(head.pace), "loop": head.loops}

    def request(
        self, verb: str, arguments: Mapping[str, Any], neighbour: Callable[[int, bool], int | None]
    ) -> Answered:
        """Execute a request. `neighbour` gives the next recorded tick, later or earlier.

        Raises InvalidRequest for an unknown verb, BadValue for wrong arguments.
        """
        checked(verb, arguments)
        head, now_ns = self.playhead, self.clock_ns()
        if verb in ("play", "resume"):
            head.play(now_ns)
        elif verb == "pause":
            head.pause(now_ns)
        elif verb == "step":
            self._step(arguments, now_ns, neighbour)
        elif verb == "seek":
            head.seek(needed(verb, arguments, "tick"), now_ns)
        elif verb == "rate":
            head.set_rate(needed(verb, arguments, "pace"), now_ns)
        else:
            head.loops = needed(verb, arguments, "on")
        self.changed()
        return Answered(self._text(verb, now_ns), head.tick(now_ns))

    def _step(self, arguments: Mapping[str, Any], now_ns: int, neighbour: Callable[[int, bool], int | None]) -> None:
        count, unit = arguments.get("count", 1), arguments.get("unit", "ticks")
        if unit not in UNITS:
            raise BadValue(f"step: a unit is {' or '.join(UNITS)}", unit, nearest_name(unit, UNITS))
        if unit == "frames":
            here = self.playhead.tick(now_ns)
            there = neighbour(here, count > 0)
            count = (there - here) if there is not None else 0
            if not count:
                raise BadValue(f"step: nothing is recorded {'after' if there is None else 'at'} tick {here}")
        self.playhead.step(count, now_ns)

    def _text(self, verb: str, now_ns: int) -> str:
        head = self.playhead
        where = f"tick {head.tick(now_ns)}, {head.tick(now_ns) * self.tick_ns / 1e9:g} s"
        if verb == "rate":
            return f"at {head.pace} from {where} on"
        if verb == "loop":
            return "begins again at its end" if head.loops else "pauses at its end"
        return f"{'paused' if head.paused else 'plays'} at {where}"


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
