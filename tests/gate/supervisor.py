"""Bugs of the supervisor: epochs, orders, commits, requests, and its start after its end."""

from __future__ import annotations

from typing import Any, Final

from foosim.common import limits
from foosim.protocol import channels
from foosim.protocol.actions import Journal, Publish
from foosim.supervisor import core, records
from foosim.supervisor.core import SupervisorCore
from foosim.supervisor.handshake import Handshake
from foosim.supervisor.node_loss import NodeLoss
from foosim.supervisor.pacing import Pacer
from foosim.supervisor.requests import Requests
from foosim.supervisor.roster import Roster
from foosim.supervisor.state import InputBuffer, RunState
from tests.gate.planting import Mutant, Planting, Register

register = Register()


class _AnyDigest(bytes):
    """Equals every digest."""

    __slots__ = ()

    def __ne__(self, other: object) -> bool:
        return False

    def __eq__(self, other: object) -> bool:
        return True

    __hash__ = bytes.__hash__


@register("supervisor takes old epochs", "a part counts if its epoch is the supervisor's", 9)
def _old_epochs(planting: Planting) -> None:
    def on_part(self: Any, part: Any, payload: bytes, now_ns: int) -> None:
        state = self.state
        state.inputs.take_part(part, state.frame.tick, state.members)

    planting.swap(SupervisorCore, "_on_part", on_part)


@register("supervisor does not compare input digests", "a part counts if its input digest is the supervisor's", 4)
def _any_digest(planting: Planting) -> None:
    before: Any = planting.swap(
        core, "input_digest_of", lambda digest, edits, delivered: _AnyDigest(before(digest, edits, delivered))
    )


@register("acknowledgements are counted", "a part counts if its sender is in the roster, once for each sender", 1)
def _counted(planting: Planting) -> None:
    def take_part(self: Any, part: Any, committed: int, members: Any) -> bool:
        if not committed < part.tick <= committed + limits.KEPT_TICKS:
            return False
        self.parts.setdefault(part.tick, []).append(part)
        return True

    planting.swap(InputBuffer, "take_part", take_part)


@register("supervisor does not ask again", "who has had no progress asks again (supervisor)", 2)
def _patient(planting: Planting) -> None:
    planting.swap(SupervisorCore, "_request_missing", lambda self, now_ns: self._retry.requested(now_ns))


@register("supervisor does not answer who asks", "supervisor and vHub keep the last 16 ticks", 1)
def _mute(planting: Planting) -> None:
    planting.swap(SupervisorCore, "_on_want", lambda self, want, payload, now_ns: None)


def _spoken_first(actions: list[Any], first: int) -> None:
    """Put what is said before what is written, from a place on."""
    said = [action for action in actions[first:] if isinstance(action, Publish)]
    rest = [action for action in actions[first:] if not isinstance(action, Publish)]
    actions[first:] = said + rest


@register("commit is said before it is written", "the supervisor journals commits before it publishes", 1)
def _hasty_commit(planting: Planting) -> None:
    def publish_commit(self: Any, *given: Any) -> None:
        first = len(self.actions)
        before(self, *given)
        _spoken_first(self.actions, first)

    before: Any = planting.swap(SupervisorCore, "_publish_commit", publish_commit)


@register("epoch is said before it is written", "the supervisor journals epochs before it publishes", 1)
def _hasty_epoch(planting: Planting) -> None:
    def open_epoch(self: Any, *given: Any) -> None:
        first = len(self.actions)
        before(self, *given)
        _spoken_first(self.actions, first)

    before: Any = planting.swap(SupervisorCore, "open_epoch", open_epoch)


@register("requests are not journalled", "a request is journalled when its tick is chosen, then answered", 1)
def _unwritten(planting: Planting) -> None:
    def accept(self: Any, *given: Any, **named: Any) -> Any:
        actions = self._state.actions
        first = len(actions)
        answer = before(self, *given, **named)
        actions[first:] = [action for action in actions[first:] if not isinstance(action, Journal)]
        return answer

    before: Any = planting.swap(Requests, "_accept", accept)


@register("refusals are not journalled", "the same id gets the same answer over restarts", 1)
def _unwritten_refusal(planting: Planting) -> None:
    def write(self: Any, verb: str, answer: Any, *added: Any) -> Any:
        actions = self._state.actions
        first = len(actions)
        before(self, verb, answer, *added)
        if not answer.accepted:
            actions[first:] = []
        return answer

    before: Any = planting.swap(Requests, "_write", write)


@register("requests are done each time they come", "the same id gets the same answer", 1)
def _each_time(planting: Planting) -> None:
    def on_request(self: Any, request: Any, payload: bytes, now_ns: int) -> None:
        self._state.answers.pop((request.sender, request.id), None)
        before(self, request, payload, now_ns)

    before: Any = planting.swap(Requests, "on_request", on_request)


@register("requests do not outlive the supervisor", "a request keeps its tick over epochs and restarts", 5)
def _forgotten(planting: Planting) -> None:
    planting.swap(RunState, "restore_requests", lambda self, history: None)


@register("orders lose their edits in a new epoch", "orders from c on are issued again, equal", 25)
def _other_orders(planting: Planting) -> None:
    def open_epoch(self: Any, *given: Any) -> None:
        for tick in range(self.state.frame.tick, self.state.released):
            self.state.orders[tick] = []
        before(self, *given)

    before: Any = planting.swap(SupervisorCore, "open_epoch", open_epoch)


@register("orders are not issued again", "orders from c on are issued again", 1)
def _no_orders(planting: Planting) -> None:
    def open_epoch(self: Any, *given: Any) -> None:
        state = self.state
        said, state.released = state.released, state.frame.tick
        before(self, *given)
        state.released = said

    before: Any = planting.swap(SupervisorCore, "open_epoch", open_epoch)
    planting.swap(SupervisorCore, "_on_want", lambda self, want, payload, now_ns: None)


@register("orders run ahead", "order k is released once tick k - W is committed", 1)
def _run_ahead(planting: Planting) -> None:
    before: Any = planting.swap(
        Pacer, "may_release", lambda self, tick, committed, now_ns: before(self, tick, committed + 3, now_ns)
    )


@register("epoch does not grow", "epochs only grow", 1)
def _same_epoch(planting: Planting) -> None:
    def open_epoch(self: Any, *given: Any) -> None:
        self.state.epoch = max(0, self.state.epoch - (self.state.epoch % 3 == 2))
        before(self, *given)

    before: Any = planting.swap(SupervisorCore, "open_epoch", open_epoch)


@register("robots are not adopted", "a lost node's robots are adopted", 1)
def _orphans(planting: Planting) -> None:
    planting.swap(NodeLoss, "adopted", lambda self, lost, members: dict(self._state.owners))


@register("robots do not go back", "adopted robots go back to the node that returns", 1)
def _kept_robots(planting: Planting) -> None:
    def join(self: Any, process: Any, now_ns: int) -> None:
        if self._state.members:
            self._state.returns.clear()
        before(self, process, now_ns)

    before: Any = planting.swap(NodeLoss, "join", join)


@register("a chosen owner is forgotten", "a robot that somebody moved stays where it was moved to", 7)
def _unmoved(planting: Planting) -> None:
    planting.swap(NodeLoss, "moved", lambda self, robot: None)


@register("a lost node stays on the list", "a lost node may come back by the handshake", 1)
def _never_lost(planting: Planting) -> None:
    planting.swap(Roster, "lose", lambda self, process: None)


@register("a stopped node comes back", "who was stopped is not let in until it is started", 21)
def _unstopped(planting: Planting) -> None:
    def on_hello(self: Any, hello: Any, payload: bytes, now_ns: int) -> None:
        self._state.roster.stopped.discard(hello.name)
        before(self, hello, payload, now_ns)

    before: Any = planting.swap(Handshake, "on_hello", on_hello)


@register("an old epoch is not told", "an old epoch in a heartbeat is answered with the present one", 22)
def _untold(planting: Planting) -> None:
    planting.swap(RunState, "publish_epoch", lambda self: None)


@register("edits are folded for ever", "a fold gives what is not committed yet", 1)
def _stale_edits(planting: Planting) -> None:
    def commit(history: Any, record: Any) -> None:
        edits = {tick: list(each) for tick, each in history.edits.items()}
        before(history, record)
        history.edits.update(edits)

    before: Any = planting.swap(records, "_commit", commit)


@register("the roster of the epoch is not kept", "the barrier passes with every node of the epoch", 1)
def _short_roster(planting: Planting) -> None:
    def open_epoch(self: Any, owners: Any, now_ns: int, members: Any = None) -> None:
        before(self, owners, now_ns, members)
        state, owning = self.state, {*owners.values()}
        state.members = tuple(name for name in state.members if name in owning)[: max(1, len(owning) - 1)]

    before: Any = planting.swap(SupervisorCore, "open_epoch", open_epoch)


@register("a lost commit is not said again", "commits are asked for again and kept", 1)
def _lost_commit(planting: Planting) -> None:
    def on_want(self: Any, want: Any, payload: bytes, now_ns: int) -> None:
        if want.kind != channels.COMMIT.name:
            before(self, want, payload, now_ns)

    before: Any = planting.swap(SupervisorCore, "_on_want", on_want)


@register("a loss is told twice", "a commit tells of what is over by it, once", 1)
def _told_twice(planting: Planting) -> None:
    before: Any = planting.swap(
        core, "close_outages", lambda recovered, *when: before(recovered, *when) and recovered[-2:]
    )


MUTANTS: Final[tuple[Mutant, ...]] = tuple(register.mutants)
