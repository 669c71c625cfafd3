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
from tests.gate.planting import Bug, Mutant, Planting, Register, nothing

register = Register()


class _AnyDigest(bytes):
    """Equals every digest."""

    __slots__ = ()

    def __ne__(self, other: object) -> bool:
        return False

    def __eq__(self, other: object) -> bool:
        return True

    __hash__ = bytes.__hash__


@register("supervisor takes old epochs", "a part has the supervisor's epoch", 9, SupervisorCore, "_on_part")
def _old_epochs(before: Bug, self: Any, part: Any, payload: bytes, now_ns: int) -> None:
    state = self.state
    state.inputs.take_part(part, state.frame.tick, state.members)


@register("supervisor does not compare input digests", "its part's digest is its own", 4, core, "input_digest_of")
def _any_digest(before: Bug, *given: Any) -> bytes:
    return _AnyDigest(before(*given))


@register("acknowledgements are counted", "a part counts once for each sender", 1, InputBuffer, "take_part")
def _counted(before: Bug, self: Any, part: Any, committed: int, members: Any) -> bool:
    if not committed < part.tick <= committed + limits.KEPT_TICKS:
        return False
    self.parts.setdefault(part.tick, []).append(part)
    return True


@register("supervisor does not ask again", "who has had no progress asks again", 2, SupervisorCore, "_request_missing")
def _patient(before: Bug, self: Any, now_ns: int) -> None:
    self._retry.requested(now_ns)


register("supervisor does not answer who asks", "it keeps the last 16 ticks", 1, SupervisorCore, "_on_want")(nothing)


def _spoken_first(before: Bug, self: Any, *given: Any) -> None:
    """Put what is said before what is written."""
    first = len(self.actions)
    before(self, *given)
    said = [action for action in self.actions[first:] if isinstance(action, Publish)]
    rest = [action for action in self.actions[first:] if not isinstance(action, Publish)]
    self.actions[first:] = said + rest


for _what, _method in (("commit", "_publish_commit"), ("epoch", "open_epoch")):
    _hasty = register(f"{_what} is said before it is written", "the journal comes first", 1, SupervisorCore, _method)
    _hasty(_spoken_first)


@register("requests are not journalled", "a request is journalled, then answered", 1, Requests, "_accept")
def _unwritten(before: Bug, self: Any, *given: Any, **named: Any) -> Any:
    actions = self._state.actions
    first = len(actions)
    answer = before(self, *given, **named)
    actions[first:] = [action for action in actions[first:] if not isinstance(action, Journal)]
    return answer


@register("refusals are not journalled", "the same id gets the same answer over restarts", 1, Requests, "_write")
def _unwritten_refusal(before: Bug, self: Any, verb: str, answer: Any, *added: Any) -> Any:
    actions = self._state.actions
    first = len(actions)
    before(self, verb, answer, *added)
    if not answer.accepted:
        actions[first:] = []
    return answer


@register("requests are done each time they come", "the same id gets the same answer", 1, Requests, "on_request")
def _each_time(before: Bug, self: Any, request: Any, payload: bytes, now_ns: int) -> None:
    self._state.answers.pop((request.sender, request.id), None)
    before(self, request, payload, now_ns)


register("requests do not outlive the supervisor", "a request keeps its tick", 5, RunState, "restore_requests")(nothing)


@register("orders lose their edits in a new epoch", "orders are issued again, equal", 25, SupervisorCore, "open_epoch")
def _other_orders(before: Bug, self: Any, *given: Any) -> None:
    for tick in range(self.state.frame.tick, self.state.released):
        self.state.orders[tick] = []
    before(self, *given)


@register("orders are not issued again", "orders from c on are issued again", 1)
def _no_orders(planting: Planting) -> None:
    def open_epoch(self: Any, *given: Any) -> None:
        state = self.state
        said, state.released = state.released, state.frame.tick
        before(self, *given)
        state.released = said

    before: Any = planting.swap(SupervisorCore, "open_epoch", open_epoch)
    planting.swap(SupervisorCore, "_on_want", lambda self, want, payload, now_ns: None)


@register("orders run ahead", "order k is released once tick k - W is committed", 1, Pacer, "may_release")
def _run_ahead(before: Bug, self: Any, tick: int, committed: int, now_ns: int) -> Any:
    return before(self, tick, committed + 3, now_ns)


@register("epoch does not grow", "epochs only grow", 1, SupervisorCore, "open_epoch")
def _same_epoch(before: Bug, self: Any, *given: Any) -> None:
    self.state.epoch = max(0, self.state.epoch - (self.state.epoch % 3 == 2))
    before(self, *given)


@register("robots are not adopted", "a lost node's robots are adopted", 1, NodeLoss, "adopted")
def _orphans(before: Bug, self: Any, lost: Any, members: Any) -> Any:
    return dict(self._state.owners)


@register("robots do not go back", "adopted robots go back to the node that returns", 1, NodeLoss, "join")
def _kept_robots(before: Bug, self: Any, process: Any, now_ns: int) -> None:
    if self._state.members:
        self._state.returns.clear()
    before(self, process, now_ns)


register("a chosen owner is forgotten", "a robot stays where it was moved to", 7, NodeLoss, "moved")(nothing)
register("a lost node stays on the list", "a lost node may come back by the handshake", 1, Roster, "lose")(nothing)


@register("a stopped node comes back", "who was stopped is not let in until it is started", 21, Handshake, "on_hello")
def _unstopped(before: Bug, self: Any, hello: Any, payload: bytes, now_ns: int) -> None:
    self._state.roster.stopped.discard(hello.name)
    before(self, hello, payload, now_ns)


register("an old epoch is not told", "an old epoch in a heartbeat is answered", 22, RunState, "publish_epoch")(nothing)


@register("edits are folded for ever", "a fold gives what is not committed yet", 1, records, "_commit")
def _stale_edits(before: Bug, history: Any, record: Any) -> None:
    edits = {tick: list(each) for tick, each in history.edits.items()}
    before(history, record)
    history.edits.update(edits)


@register("the roster of the epoch is not kept", "every node of the epoch has a part", 1, SupervisorCore, "open_epoch")
def _short_roster(before: Bug, self: Any, owners: Any, now_ns: int, members: Any = None) -> None:
    before(self, owners, now_ns, members)
    state, owning = self.state, {*owners.values()}
    state.members = tuple(name for name in state.members if name in owning)[: max(1, len(owning) - 1)]


@register("a lost commit is not said again", "commits are asked for again and kept", 1, SupervisorCore, "_on_want")
def _lost_commit(before: Bug, self: Any, want: Any, payload: bytes, now_ns: int) -> None:
    if want.kind != channels.COMMIT.name:
        before(self, want, payload, now_ns)


@register("a loss is told twice", "a commit tells of what is over by it, once", 1, core, "close_outages")
def _told_twice(before: Bug, recovered: Any, *when: Any) -> Any:
    return before(recovered, *when) and recovered[-2:]


MUTANTS: Final[tuple[Mutant, ...]] = tuple(register.mutants)
