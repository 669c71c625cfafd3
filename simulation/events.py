"""Events of a rehearsal as people write them: a node or a player is killed, a node is cut off, a robot moves.

    kill n2 at 1 s               its robots move to the other nodes
    kill n2 for 300 ms at 1 s    and it comes back
    cut n3 for 300 ms at 1 s     no message leaves or reaches it
    move robot-1 to n2 at 1 s

`at` is simulated time, `for` time of the processes' clocks.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Final

from foosim.common.errors import BadValue, UnknownName, read_at
from foosim.common.units import parse_ns
from foosim.deployment.schema import Deployment
from foosim.protocol.messages import Answer
from foosim.simulation.system import System

AGAIN_NS: Final = 150_000_000
"""Period at which an unanswered request is repeated."""
FORM: Final = "kill NAME [for TIME] at TIME, cut NODE for TIME at TIME, or move ROBOT to NODE at TIME"
_EVENT: Final = re.compile(
    r"(?:kill (?P<process>\S+)(?: for (?P<down>.+?))?|cut (?P<node>\S+) for (?P<gap>.+?)"
    r"|move (?P<robot>\S+) to (?P<to>\S+)) at (?P<at>.+)"
)


class Events:
    """The events of one rehearsal: `prepare` schedules them, `check` reports afterwards which did not happen."""

    def __init__(self, texts: Sequence[str], deployment: Deployment, nodes: int) -> None:
        """Raises BadValue for an invalid event, UnknownName for a name in it."""
        here = [f"n{number + 1}" for number in range(nodes)]
        self._names: dict[str, tuple[str, list[str]]] = {
            "process": ("node or player", [*here, *deployment.players]),
            "node": ("node", here),
            "robot": ("robot", [*deployment.robots]),
            "to": ("node", here),
        }
        self._tick_ns = deployment.tick_ns
        self._due = [(text, *self._read(text)) for text in texts]
        self._left = dict.fromkeys(texts, "the rehearsal ended before")
        """Of each outstanding event: why it has not happened."""
        self._requests: dict[str, str] = {}
        """The event of each request, by its id."""

    def _read(self, text: str) -> tuple[int, Callable[[System, str], None]]:
        """Return the tick of an event, and what it does."""
        found = _EVENT.fullmatch(text)
        if found is None:
            raise BadValue(f"no event: write {FORM}", text)
        for group, (what, choices) in self._names.items():
            if found[group] is not None and found[group] not in choices:
                raise UnknownName(f"{text}: no such {what}", found[group], choices)
        tick = max(1, -(-read_at(text, parse_ns, found["at"]) // self._tick_ns))
        lasts = found["down"] or found["gap"]
        for_ns = None if lasts is None else read_at(text, parse_ns, lasts)
        if found["robot"]:
            return tick, partial(self._move, found["robot"], found["to"])
        if found["node"]:
            return tick, partial(self._cut, found["node"], for_ns or 0)
        return tick, partial(self._kill, found["process"], for_ns)

    def prepare(self, system: System) -> None:
        """Schedule them."""
        for text, tick, do in self._due:
            system.at_tick(tick, partial(do, system, text))

    def check(self, answers: Mapping[str, Answer]) -> None:
        """Raise BadValue for an event that did not happen, after the rehearsal whose answers these are."""
        for identity, text in self._requests.items():
            if identity in answers:
                answer = answers[identity]
                self._left[text] = "" if answer.accepted else answer.text
        for text, why in self._left.items():
            if why:
                raise BadValue(f"this event did not happen: {why}", text)

    def _move(self, robot: str, node: str, system: System, text: str) -> None:
        self._requests[system.request("move", again_ns=AGAIN_NS, robot=robot, node=node)] = text

    def _cut(self, node: str, for_ns: int, system: System, text: str) -> None:
        self._left[text] = ""
        system.bus.cut_off(node, system.bus.now_ns + for_ns)

    def _kill(self, name: str, for_ns: int | None, system: System, text: str) -> None:
        if name not in system.processes:
            self._left[text] = f"{name} was away"
            return
        self._left[text] = ""
        system.kill(name)
        if for_ns is not None:
            system.later(for_ns, partial(_start, system, name))


def _start(system: System, name: str) -> None:
    """Start a process unless it is there again."""
    if name not in system.processes:
        system.start(name)
