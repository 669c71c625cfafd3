"""Requests of operators: pause, resume, step, rate, add, remove, move, balance, push, set, network, stop and start
(a node), down; and of viewers: status, describe, watch.

A request has an id; the same id gets the same answer. Each takes effect at a tick that the answer names: add, remove,
push and set at the first tick not yet released, network with what is sent at the next one, a move at the last commit,
with its epoch. A request is journalled when its tick is chosen, then answered; one that only reads is neither. To add a
verb: a method and a row.
"""

from __future__ import annotations

from collections.abc import Callable
from math import hypot
from typing import Any, Final

from foosim.common import limits
from foosim.common.errors import BadValue, Malformed, Refused, show
from foosim.common.json_text import decode_json, encode_json
from foosim.common.units import parse_pace
from foosim.deployment.network.rules import EVENTS_MAX, event_of
from foosim.deployment.network.settings_text import event_words
from foosim.deployment.validate_network import event_text
from foosim.protocol import channels
from foosim.protocol.messages import Answer, Inquiry, Request
from foosim.supervisor.load_balancing import WORTH, loads_of, shifts_at_once
from foosim.supervisor.node_loss import NodeLoss
from foosim.supervisor.records import RequestRecord, summary_of
from foosim.supervisor.state import RunState
from foosim.supervisor.viewing import Viewing, chosen
from foosim.world.assembly.world import body_of
from foosim.world.components.view import ComponentError
from foosim.world.edits import Disrupt, Edit, Push, Remove
from foosim.world.setting.coming import absent_named, check_present
from foosim.world.setting.settable import add_edit, set_edits

EDITS_MAX: Final = limits.ENTITIES_MAX // 2
"""Edits that requests may put into the order of one tick."""
READS: Final = ("status", "describe", "watch")
"""Verbs that change nothing: valid before, during and after a run."""
TEXT_MAX = 4000
"""Characters of a refusal."""
NUMBER_MAX = 1e100
"""Larger than any useful value, and its square does not overflow."""


class Requests:
    """Takes requests, chooses their ticks, answers."""

    def __init__(
        self,
        state: RunState,
        viewing: Viewing,
        node_loss: NodeLoss,
        status: Callable[[int], dict[str, Any]],
        open_epoch: Callable[[dict[str, str], int], None],
        stop: Callable[[], int],
        finish: Callable[[str], None],
    ) -> None:
        """`status` returns that of the run at a time, `open_epoch` opens one for owners and the time, `stop` ends the
        run in order and returns at which tick, `finish` ends it at once as failed."""
        self._state = state
        self._node_loss = node_loss
        self._status_of_run = status
        self._open_epoch = open_epoch
        self._stop_run = stop
        self._finish = finish
        self._verbs: dict[str, Callable[[Request, dict[str, Any], int], Answer | None]] = {
            "status": self._status,
            "describe": viewing.describe,
            "watch": viewing.watch,
            "pause": self._pause,
            "resume": self._resume,
            "step": self._step,
            "rate": self._rate,
            "add": self._add,
            "remove": self._remove,
            "move": self._move,
            "balance": self._balance,
            "push": self._push,
            "set": self._set,
            "network": self._network,
            "stop": self._stop_node,
            "start": self._start_node,
            "down": self._down,
        }

    def on_request(self, request: Request, payload: bytes, now_ns: int) -> None:
        """Answer a request, but where a run is being resumed: then it is repeated."""
        answer = self._state.answers.get((request.sender, request.id)) or self._decide(request, now_ns)
        if answer is not None:
            self._reply(answer)

    def on_inquiry(self, inquiry: Inquiry, payload: bytes, now_ns: int) -> None:
        """Answer a viewer, which may only read."""
        if inquiry.verb in READS:
            answer = self._decide(inquiry, now_ns)
            assert answer is not None, inquiry.verb
        else:
            why = f"{show(inquiry.verb)} is for operators: a viewer may request {', '.join(READS)}"
            answer = Answer(inquiry.sender, inquiry.id, False, self._state.frame.tick, why, b"{}")
        self._reply(answer)

    def _decide(self, request: Request, now_ns: int) -> Answer | None:
        try:
            verb = self._verbs.get(request.verb)
            if verb is None:
                raise Refused(f"no verb {show(request.verb)}; there are {', '.join(self._verbs)}")
            if self._state.end is not None and request.verb not in (*READS, "down"):
                raise Refused("the run has ended")
            if not self._state.is_open and request.verb not in (*READS, "down"):
                if self._state.is_resuming:
                    return None  # the request is repeated
                raise Refused("the run has not started yet")
            arguments = decode_json(request.arguments)
            if not isinstance(arguments, dict):
                raise Malformed("arguments must be a JSON object")
            return verb(request, arguments, now_ns)
        except Refused as refused:
            return self._refuse(request, str(refused))

    def _reply(self, answer: Answer) -> None:
        self._state.publish(channels.ANSWER, answer.sender, answer)

    def _refuse(self, request: Request, why: str) -> Answer:
        """Journal a refusal as well: a restarted supervisor might decide otherwise when the request is repeated."""
        answer = Answer(request.sender, request.id, False, self._state.released, why[:TEXT_MAX], b"{}")
        if request.verb in READS:
            return answer
        return self._write(request.verb, answer, answer.tick, [], self._state.owners)

    def _write(self, verb: str, answer: Answer, tick: int, edits: list[Edit], owners: dict[str, str]) -> Answer:
        """Journal an answer and its additions to the order of `tick`; keep it for a repeated request."""
        self._state.journal(RequestRecord(tick, edits, answer, self._state.control(), owners, verb))
        self._state.last_requests.append(summary_of(verb, answer))
        self._state.answers.keep(answer)
        return answer

    def _accept(
        self,
        request: Request,
        tick: int,
        text: str,
        edits: list[Edit] | None = None,
        owners: dict[str, str] | None = None,
        effective: int | None = None,
    ) -> Answer:
        """Journal a request whose tick is chosen, with its whole effect, and keep its answer.

        `effective` is the tick that the answer names, where its order is another than that with the edits.
        """
        answer = Answer(request.sender, request.id, True, tick if effective is None else effective, text, b"{}")
        self._write(request.verb, answer, tick, edits or [], owners or self._state.owners)
        if edits:
            self._state.note_disruptions(tick, edits)
            self._state.coming_edits.setdefault(tick, []).extend(edits)
        return answer

    # --- pace --------------------------------------------------------------------------------------------------------

    def _status(self, request: Request, arguments: dict[str, Any], now_ns: int) -> Answer:
        result = encode_json(self._status_of_run(now_ns))
        return Answer(request.sender, request.id, True, self._state.frame.tick, "", result)

    def _pause(self, request: Request, arguments: dict[str, Any], now_ns: int) -> Answer:
        tick = self._state.released
        self._state.pacer.pause(tick)
        return self._tempo(request, tick, f"paused at tick {tick}")

    def _resume(self, request: Request, arguments: dict[str, Any], now_ns: int) -> Answer:
        tick = self._state.released
        self._state.pacer.resume(tick, now_ns)
        return self._tempo(request, tick, f"resumed at tick {tick}")

    def _step(self, request: Request, arguments: dict[str, Any], now_ns: int) -> Answer:
        count = _integer(arguments, "count", 1, 10**9)
        tick = self._state.released
        self._state.pacer.step(tick, count)
        return self._tempo(request, tick, f"{count} tick{'' if count == 1 else 's'} from tick {tick}, then paused")

    def _rate(self, request: Request, arguments: dict[str, Any], now_ns: int) -> Answer:
        pace = parse_pace(arguments.get("pace"))
        tick = self._state.released
        self._state.pacer.set_pace(pace, tick, now_ns)
        return self._tempo(request, tick, f"pace {pace} from tick {tick}")

    def _tempo(self, request: Request, tick: int, text: str) -> Answer:
        answer = self._accept(request, tick, text)
        self._state.publish_tempo()
        return answer

    # --- the world ---------------------------------------------------------------------------------------------------

    def _add(self, request: Request, arguments: dict[str, Any], now_ns: int) -> Answer:
        """Add a spare, on a node that owns it from now on if one is named."""
        state, place = self._state, arguments.get("at")
        layout, numbers = state.frame.layout, state.coming_numbers()
        entity = absent_named(layout, numbers, _name(arguments, "name"))
        owners, has_node = state.owners, arguments.get("node") is not None
        if has_node:
            node = chosen("node", _name(arguments, "node"), state.members)
            if not entity.is_robot:
                raise Refused(f"{entity.name} is no robot: it has no node")
            owners = {**owners, entity.name: node}
        tick = self._tick_for_edit()
        try:
            edit = add_edit(state.deployment, layout, numbers, entity, place)
        except ComponentError as error:
            raise Refused(str(error)) from error
        except BadValue as bad:
            raise Refused(f"at of {entity.name}: {bad}") from bad
        answer = self._accept(request, tick, f"{entity.name} added at tick {tick}", [edit], owners)
        if has_node:
            self._node_loss.moved(entity.name)
        if owners != state.owners:
            state.account.moves += 1
            self._open_epoch(owners, now_ns)
        return answer

    def _remove(self, request: Request, arguments: dict[str, Any], now_ns: int) -> Answer:
        name = _name(arguments, "name")
        check_present(self._state.frame.layout, self._state.coming_numbers(), name)
        tick = self._tick_for_edit()
        return self._accept(request, tick, f"{name} removed at tick {tick}", [Remove(name)])

    def _push(self, request: Request, arguments: dict[str, Any], now_ns: int) -> Answer:
        layout, numbers = self._state.frame.layout, self._state.coming_numbers()
        free = [body.name for body in layout.free if not body.is_absent(numbers)]
        if not free:
            raise Refused("nothing can be pushed: this world has no free bodies")
        name = chosen("free body", _name(arguments, "name", free[0]), free)
        impulse = _vector(arguments, "impulse")
        body = body_of(self._state.deployment, layout, layout[name])
        mass, fastest = body.links[0].mass, body.speed_limit
        size, most = hypot(*impulse), mass * fastest
        if size > most:
            limit = f"at most {most:g} N s, which are the limit of {name}, {fastest:g} m/s, at {mass:g} kg"
            raise Refused(f"impulse: {size:g} N s in all are too much, valid are {limit}")
        tick = self._tick_for_edit()
        return self._accept(request, tick, f"{name} pushed at tick {tick}", [Push(name, impulse)])

    def _set(self, request: Request, arguments: dict[str, Any], now_ns: int) -> Answer:
        """Set a field of an entity, whose numbers follow from the newest frame and the orders since."""
        state, field = self._state, _name(arguments, "field")
        layout, numbers = state.frame.layout, state.coming_numbers()
        entity = layout[chosen("entity", _name(arguments, "name"), layout.names)]
        if entity.is_absent(numbers):
            raise Refused(f"{entity.name} is absent: add it first")
        tick = self._tick_for_edit()
        try:
            edits = set_edits(state.deployment, layout, numbers, entity, field, arguments.get("value"))
        except ComponentError as error:
            raise Refused(str(error)) from error
        except BadValue as bad:
            raise Refused(f"{field} of {entity.name}: {bad}") from bad
        return self._accept(request, tick, f"{field} of {entity.name} set at tick {tick}", [*edits])

    def _tick_for_edit(self) -> int:
        """Return the first unreleased tick; raises Refused when its order is full."""
        tick = self._state.released
        if len(self._state.coming_edits.get(tick, ())) >= EDITS_MAX:
            raise Refused(f"tick {tick} has {len(self._state.coming_edits[tick])} edits already")
        return tick

    def _network(self, request: Request, arguments: dict[str, Any], now_ns: int) -> Answer:
        """An event in the order of a tick holds from the next frame on, and for packets that are sent from it."""
        tick = self._tick_for_edit()
        state, effective, deployment = self._state, tick + 1, self._state.deployment
        text = event_text(deployment, arguments.get("event"), effective * deployment.tick_ns)
        if state.disruptions >= EVENTS_MAX:
            raise Refused(f"{EVENTS_MAX} events were requested already")
        state.disruptions += 1
        event = event_of(text, effective * deployment.tick_ns)
        when = f"from tick {effective} on" if event.heal is None else f"at tick {effective}"
        return self._accept(request, tick, f"{event_words(event)}, {when}", [Disrupt(text)], effective=effective)

    def _move(self, request: Request, arguments: dict[str, Any], now_ns: int) -> Answer:
        state = self._state
        robot = chosen("robot", _name(arguments, "robot"), sorted(state.owners))
        node = chosen("node", _name(arguments, "node"), state.members)
        tick = state.frame.tick
        if state.owners[robot] == node:
            self._node_loss.moved(robot)
            return self._accept(request, tick, f"{robot} is on {node} already, at tick {tick}")
        owners = {**state.owners, robot: node}
        self._node_loss.moved(robot)
        answer = self._accept(request, tick, f"{robot} moved to {node} at tick {tick}", owners=owners)
        state.account.moves += 1
        self._open_epoch(owners, now_ns)
        return answer

    def _balance(self, request: Request, arguments: dict[str, Any], now_ns: int) -> Answer:
        """Move all robots at once whose move makes the nodes' loads more equal; the answer has the reason."""
        state, loads = self._state, loads_of(self._state)
        tick = state.frame.tick
        silent = [node for node in state.members if node not in loads]
        if silent or len(loads) < 2:
            why = f"no load is known of {', '.join(silent)}" if silent else "one node takes part: nothing can move"
            raise Refused(why)
        shifts = shifts_at_once(loads, state.present_owners(), state.deployment.owners())
        shares = ", ".join(f"{node} {load:.0%}" for node, load in loads.items())
        if not shifts:
            least = f"no move would win more than a robot's share, or {WORTH:.0%}"
            return self._accept(request, tick, f"nothing moves at tick {tick}: loads are {shares}; {least}")
        owners = dict(state.owners)
        moved: dict[tuple[str, str], list[str]] = {}
        for shift in shifts:
            owners[shift.robot] = shift.target
            self._node_loss.moved(shift.robot)
            moved.setdefault((shift.source, shift.target), []).append(shift.robot)
        ways = "; ".join(f"{', '.join(robots)} from {source} to {node}" for (source, node), robots in moved.items())
        text = f"moved at tick {tick}, for loads were {shares}: {ways}"
        answer = self._accept(request, tick, text[:TEXT_MAX], owners=owners)
        state.account.moves += len(shifts)
        self._open_epoch(owners, now_ns)
        return answer

    def _stop_node(self, request: Request, arguments: dict[str, Any], now_ns: int) -> Answer:
        state = self._state
        node = chosen("node", _name(arguments, "node"), sorted(state.deployment.nodes))
        tick = state.frame.tick
        if node in state.roster.stopped:
            return self._accept(request, tick, f"{node} is stopped already")
        if state.deployment.nodes[node].required:
            raise Refused(f"{node} is required by the deployment: the run cannot do without it")
        if state.members == (node,):
            raise Refused(f"{node} is the only node that is left")
        process = state.settings.processes.get(node)
        if process is not None:
            others = [role for role, its in sorted(state.settings.processes.items()) if its == process and role != node]
            raise Refused(f"{node} shares process {process} with {', '.join(others)}: it cannot be stopped alone")
        state.roster.stopped.add(node)
        answer = self._accept(request, tick, f"{node} stopped at tick {tick}")
        self._node_loss.stop(node, now_ns)
        return answer

    def _start_node(self, request: Request, arguments: dict[str, Any], now_ns: int) -> Answer:
        state = self._state
        node = chosen("node", _name(arguments, "node"), sorted(state.deployment.nodes))
        if node in state.members:
            return self._accept(request, state.frame.tick, f"{node} takes part already")
        state.roster.stopped.discard(node)
        state.roster.starts[node] = state.roster.starts.get(node, 0) + 1
        text = f"{node} may take part from tick {state.frame.tick} on, when it has built the world"
        return self._accept(request, state.frame.tick, text)

    def _down(self, request: Request, arguments: dict[str, Any], now_ns: int) -> Answer:
        """End the run in order; at once, as failed, with `lost`: a loss that only the launcher can detect."""
        lost = arguments.get("lost")
        if isinstance(lost, str) and lost:
            self._finish(f"lost {lost}")
            return self._accept(request, self._state.frame.tick, f"the run ends at tick {self._state.frame.tick}")
        tick = self._stop_run()
        return self._accept(request, tick, f"the run ends at tick {tick}")


def _name(arguments: dict[str, Any], key: str, default: str = "") -> str:
    value = arguments.get(key)
    if value is None and default:
        return default
    if not isinstance(value, str):
        raise Refused(f"{key}: a name is needed, not {show(value)}")
    return value


def _integer(arguments: dict[str, Any], name: str, low: int, high: int) -> int:
    value = arguments.get(name)
    if not isinstance(value, int) or isinstance(value, bool) or not low <= value <= high:
        raise Refused(f"{name}: a whole number from {low} to {high} is needed, not {show(value)}")
    return value


def _vector(arguments: dict[str, Any], name: str) -> tuple[float, float, float]:
    value = arguments.get(name)
    if isinstance(value, list) and len(value) == 3 and all(_is_small(number) for number in value):
        x, y, z = value
        return float(x), float(y), float(z)
    shown = f"[{', '.join(show(item) for item in value[:4])}]" if isinstance(value, list) else show(value)
    raise Refused(f"{name}: three numbers of at most {NUMBER_MAX:g} are needed, not {shown}")


def _is_small(number: object) -> bool:
    """Whether this is a number that is finite, also squared."""
    return isinstance(number, int | float) and not isinstance(number, bool) and -NUMBER_MAX <= number <= NUMBER_MAX
