"""What people ask of a running system: pause, resume, step, rate, add, remove, move, push, down, status.

A request has an id; the same id gets the same answer. Each takes effect at a tick that the answer names: push at the
first tick not yet released, add and remove at the first not yet released when all nodes are ready for it, a move at the
last commit, with its epoch. It is journalled when its tick is chosen, then answered. To add a verb: a method and a row.
Neighbours: `core`, `status` (what `status` answers).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite
from typing import TYPE_CHECKING, Any

from foosim.protocol import channels
from foosim.protocol.actions import Journal, Publish
from foosim.protocol.codec import decode_json, encode, encode_json
from foosim.protocol.errors import Malformed, Refused
from foosim.protocol.frame import layout_after
from foosim.protocol.layout import Layout
from foosim.protocol.messages import Add, Answer, Edit, Push, Remove, Request
from foosim.protocol.names import is_name, nearest_name
from foosim.protocol.units import parse_pace
from foosim.supervisor.records import RequestRecord
from foosim.supervisor.status import status

if TYPE_CHECKING:
    from foosim.supervisor.core import SupervisorCore

ANSWERS_KEPT = 1024
IMPULSE_MAX = 10.0
"""N s on a free body: more than any kick, less than what leaves the world at once."""


@dataclass(slots=True)
class _Waiting:
    """A change of layout that waits for every node's engine."""

    request: Request
    edit: Add | Remove
    layout: Layout


class Requests:
    """Takes requests, chooses their ticks, answers."""

    def __init__(self, core: SupervisorCore) -> None:
        self._core = core
        self._answers: dict[str, Answer] = {}
        self._pending: list[_Waiting] = []
        self._edits: dict[int, list[Edit]] = {}
        self._verbs: dict[str, Callable[[Request, dict[str, Any], int], Answer | None]] = {
            "status": self._status,
            "pause": self._pause,
            "resume": self._resume,
            "step": self._step,
            "rate": self._rate,
            "add": self._add,
            "remove": self._remove,
            "move": self._move,
            "push": self._push,
            "down": self._down,
        }

    def take(self, request: Request, payload: bytes, now_ns: int) -> None:
        """Take one request: answer it now, or when all nodes are ready for what it asks."""
        answer = self._answers.get(request.id)
        if answer is None:
            if any(waiting.request.id == request.id for waiting in self._pending):
                return
            answer = self._decide(request, now_ns)
        if answer is not None:
            self._core.actions.append(Publish(channels.ANSWER, request.sender, encode(answer)))

    def _decide(self, request: Request, now_ns: int) -> Answer | None:
        try:
            verb = self._verbs.get(request.verb)
            if verb is None:
                raise Refused(f"no verb {request.verb}; there are {', '.join(self._verbs)}")
            if self._core.end is not None and request.verb not in ("status", "down"):
                raise Refused("the run has ended")
            if self._core.epoch == 0 and request.verb not in ("status", "down"):
                raise Refused("the run has not started yet")
            arguments = decode_json(request.arguments)
            if not isinstance(arguments, dict):
                raise Malformed("arguments that are no JSON object")
            return verb(request, arguments, now_ns)
        except Refused as refused:
            return Answer(request.sender, request.id, False, self._core.released, str(refused)[:4000], b"{}")

    def _accept(self, request: Request, tick: int, text: str, edits: list[Edit] | None = None) -> Answer:
        """Journal a request whose tick is chosen, with what it adds to that tick's order, and keep its answer."""
        answer = Answer(request.sender, request.id, True, tick, text, b"{}")
        self._core.actions.append(Journal(encode(RequestRecord(tick, edits or [], answer))))
        if edits:
            self._edits.setdefault(tick, []).extend(edits)
        self._answers[request.id] = answer
        if len(self._answers) > ANSWERS_KEPT:
            self._answers.pop(next(iter(self._answers)))
        return answer

    def edits_for(self, tick: int) -> list[Edit]:
        """Take what requests add to the order of `tick`."""
        return self._edits.pop(tick, [])

    def coming_edits(self) -> list[Edit]:
        """Return what requests add to ticks that are not released yet."""
        return [edit for tick in sorted(self._edits) for edit in self._edits[tick]]

    def journalled(self) -> tuple[dict[int, list[Edit]], list[Answer]]:
        """Return what of the requests a further journal file has to say again: edits to come by tick, answers."""
        return self._edits, list(self._answers.values())

    def _next_layout(self) -> Layout:
        """Return the layout after everything that is already ordered."""
        return layout_after(self._core.frame.layout, self._core.ordered_edits())

    # --- pace --------------------------------------------------------------------------------------------------------

    def _status(self, request: Request, arguments: dict[str, Any], now_ns: int) -> Answer:
        result = encode_json(status(self._core, now_ns))
        return Answer(request.sender, request.id, True, self._core.frame.tick, "", result)

    def _pause(self, request: Request, arguments: dict[str, Any], now_ns: int) -> Answer:
        tick = self._core.released
        self._core.pacer.pause(tick)
        return self._tempo(request, tick, f"paused at tick {tick}")

    def _resume(self, request: Request, arguments: dict[str, Any], now_ns: int) -> Answer:
        tick = self._core.released
        self._core.pacer.resume(tick, now_ns)
        return self._tempo(request, tick, f"resumed at tick {tick}")

    def _step(self, request: Request, arguments: dict[str, Any], now_ns: int) -> Answer:
        count = _integer(arguments, "count", 1, 10**9)
        tick = self._core.released
        self._core.pacer.step(tick, count)
        return self._tempo(request, tick, f"{count} ticks from tick {tick}, then paused")

    def _rate(self, request: Request, arguments: dict[str, Any], now_ns: int) -> Answer:
        pace = parse_pace(arguments.get("pace"))
        tick = self._core.released
        self._core.pacer.set_pace(pace, tick, now_ns)
        return self._tempo(request, tick, f"pace {pace} from tick {tick}")

    def _tempo(self, request: Request, tick: int, text: str) -> Answer:
        answer = self._accept(request, tick, text)
        self._core.actions.append(Publish(channels.TEMPO, channels.SUPERVISOR, self._core.tempo()))
        return answer

    # --- the world ---------------------------------------------------------------------------------------------------

    def _add(self, request: Request, arguments: dict[str, Any], now_ns: int) -> None:
        layout = self._next_layout()
        name = str(arguments.get("name") or _free_name(layout))
        if not is_name(name) or name in layout or any(w.edit.name == name for w in self._pending):
            raise Refused(f"name {name!r} is taken or no name; taken are {', '.join(layout.names)}")
        table = self._core.deployment.table
        position = _vector(arguments, "position", (0.0, 0.0, table.ball.radius))
        velocity = _vector(arguments, "velocity", (0.0, 0.0, 0.0))
        bounds = (table.field.length / 2, table.field.width / 2, table.walls.height)
        if any(abs(value) > bound for value, bound in zip(position, bounds, strict=True)) or position[2] <= 0.0:
            raise Refused(f"position {position} is outside the table: at most {bounds} m")
        if sum(value * value for value in velocity) > table.ball.speed_limit**2:
            raise Refused(f"velocity {velocity} is above the ball's limit of {table.ball.speed_limit} m/s")
        self._wait_for_engines(request, Add(name, "ball", position, velocity))

    def _remove(self, request: Request, arguments: dict[str, Any], now_ns: int) -> None:
        name = str(arguments.get("name", ""))
        layout = self._next_layout()
        removable = [entity.name for entity in self._core.added_to(layout)]
        if name not in removable:
            raise Refused(f"{name!r} was not added; added are {', '.join(removable) or 'none'}")
        self._wait_for_engines(request, Remove(name))

    def _wait_for_engines(self, request: Request, edit: Add | Remove) -> None:
        """Have the engines built; the first change that waits goes first, since each builds on the one before."""
        self._pending.append(_Waiting(request, edit, layout_after(self._next_layout(), [edit])))
        if len(self._pending) == 1:
            self.prepare()

    def prepare(self) -> None:
        """Say (again) which layout the first change that waits needs."""
        if self._pending:
            self._core.prepare(self._pending[0].layout)

    def layout_ready(self, now_ns: int) -> None:
        """Order the change whose layout every node has built."""
        while self._pending:
            waiting = self._pending[0]
            if self._core.unready_nodes(waiting.layout.digest):
                return
            self._pending.pop(0)
            tick = self._core.released
            verb = "added" if isinstance(waiting.edit, Add) else "removed"
            answer = self._accept(waiting.request, tick, f"{waiting.edit.name} {verb} at tick {tick}", [waiting.edit])
            self._core.actions.append(Publish(channels.ANSWER, waiting.request.sender, encode(answer)))
            if self._pending:
                following = self._pending[0]
                following.layout = layout_after(layout_after(self._next_layout(), [waiting.edit]), [following.edit])
                self.prepare()

    def _push(self, request: Request, arguments: dict[str, Any], now_ns: int) -> Answer:
        name = str(arguments.get("name", "ball"))
        balls = [ball.name for ball in self._next_layout().balls]
        if name not in balls:
            nearest = nearest_name(name, balls)
            hint = f", nearest is {nearest}" if nearest else ""
            raise Refused(f"no free body {name!r}; there are {', '.join(balls)}{hint}")
        impulse = _vector(arguments, "impulse", None)
        if sum(value * value for value in impulse) > IMPULSE_MAX**2:
            raise Refused(f"impulse {impulse} is above {IMPULSE_MAX} N s")
        tick = self._core.released
        return self._accept(request, tick, f"{name} pushed at tick {tick}", [Push(name, impulse)])

    def _move(self, request: Request, arguments: dict[str, Any], now_ns: int) -> Answer:
        robot, node = str(arguments.get("robot", "")), str(arguments.get("node", ""))
        core = self._core
        if robot not in core.owners:
            nearest = nearest_name(robot, core.owners)
            raise Refused(f"no robot {robot!r}" + (f", nearest is {nearest}" if nearest else ""))
        if node not in core.members:
            raise Refused(f"no node {node!r}; there are {', '.join(core.members)}")
        tick = core.frame.tick
        if core.owners[robot] == node:
            return self._accept(request, tick, f"{robot} is on {node} already")
        answer = self._accept(request, tick, f"{robot} moved to {node} at tick {tick}")
        core.account.moves += 1
        core.open_epoch({**core.owners, robot: node}, now_ns)
        return answer

    def _down(self, request: Request, arguments: dict[str, Any], now_ns: int) -> Answer:
        tick = self._core.stop()
        return self._accept(request, tick, f"the run ends at tick {tick}")


def _integer(arguments: dict[str, Any], name: str, low: int, high: int) -> int:
    value = arguments.get(name)
    if not isinstance(value, int) or isinstance(value, bool) or not low <= value <= high:
        raise Refused(f"{name}: a whole number from {low} to {high} is needed, not {value!r}")
    return value


def _vector(
    arguments: dict[str, Any], name: str, default: tuple[float, float, float] | None
) -> tuple[float, float, float]:
    value = arguments.get(name, default)
    if value is not None and isinstance(value, list | tuple) and len(value) == 3:
        try:
            x, y, z = (float(number) for number in value)
        except (TypeError, ValueError):
            x = y = z = float("nan")
        if isfinite(x) and isfinite(y) and isfinite(z):
            return x, y, z
    raise Refused(f"{name}: three finite numbers are needed, not {value!r}")


def _free_name(layout: Layout) -> str:
    number = 2
    while f"ball{number}" in layout:
        number += 1
    return f"ball{number}"
