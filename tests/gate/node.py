"""Bugs of nodes, of what they share with their peers, and of clients."""

from __future__ import annotations

from itertools import count
from typing import Any, Final

from foosim.client.core import ClientCore
from foosim.common.batched.noise import NoiseKeys
from foosim.node.core import NodeCore
from foosim.node.inputs import Inputs
from foosim.node.tick import Stepper
from foosim.protocol import channels
from foosim.protocol.handshake import Member
from foosim.world.assembly.islands import Assignment
from foosim.world.assembly.world import World
from tests.gate.planting import Bug, Mutant, Planting, Register, nothing

register = Register()


@register("node takes old epochs", "a node drops orders and parts of older epochs", 3, NodeCore, "_fenced")
def _old_epochs(before: Bug, self: Any, channel: Any, message: Any, payload: bytes) -> bool:
    return message.epoch >= self.epoch and bool(before(self, channel, message, payload))


@register("node takes new epochs early", "messages of a newer epoch are held until it comes", 111, NodeCore, "_fenced")
def _new_epochs(before: Bug, self: Any, channel: Any, message: Any, payload: bytes) -> bool:
    return message.epoch <= self.epoch and bool(before(self, channel, message, payload))


@register(
    "node does not compare input digests", "a node collects parts with its own input digest", 4, NodeCore, "_take_part"
)
def _any_digest(before: Bug, self: Any, barrier: Any, part: Any) -> Any:
    return barrier.add(part)


@register("node does not ask again", "who has had no progress asks again (node)", 2, NodeCore, "_request_missing")
def _patient_node(before: Bug, self: Any, now_ns: int) -> None:
    self._retry.requested(now_ns)


register("node does not answer who asks", "senders keep what is not yet committed", 2, NodeCore, "_on_want")(nothing)
register("node does not sample again", "any owner samples again from Commit(k)", 2, NodeCore, "_sample_again")(nothing)
register("zombie does not notice", "back again, a lost node is a newcomer", 4, NodeCore, "_begin_anew")(nothing)


@register("node keeps its own frame", "a node takes its own frame c only if D(c) fits", 2, NodeCore, "_on_epoch")
def _own_frame(before: Bug, self: Any, epoch: Any, payload: bytes, now_ns: int) -> None:
    newest = self.frame
    before(self, epoch, payload, now_ns)
    if self._awaited_epoch is epoch and newest is not None and self.name in epoch.roster:
        self._resume(newest, now_ns)


@register("node keeps parts of the old epoch", "a new epoch computes its ticks from its own parts", 1)
def _old_parts(planting: Planting) -> None:
    def on_epoch(self: Any, epoch: Any, payload: bytes, now_ns: int) -> None:
        sent = dict(self._sent_parts)
        before(self, epoch, payload, now_ns)
        if self.epoch == epoch.epoch:
            self._sent_parts.update(sent)

    def solved(self: Any, work: Any) -> None:
        kept = self._sent_parts.get(work.tick + 1)
        done(self, work)
        if kept is not None:
            self.actions[-1] = type(self.actions[-1])(channels.PART, self.name, kept)

    before: Any = planting.swap(NodeCore, "_on_epoch", on_epoch)
    done = planting.swap(NodeCore, "solved", solved)


@register("node deals shares its own way", "exactly one solver for each entity at each tick", 1, NodeCore, "_make_term")
def _own_shares(before: Bug, self: Any) -> Any:
    term = before(self)
    if self.name != self.roster[0]:
        object.__setattr__(term.assignment, "roster", (self.name, *self.roster))
    return term


NUMBERS: Final = count()


@register("noise from a running stream", "draws are keyed by tick, not taken from a stream", 1, NoiseKeys, "normal")
def _running_noise(before: Bug, self: Any, counter: int, width: int, slot: int = 0) -> Any:
    return before(self, next(NUMBERS), width, slot)


@register("no quarantine", "a result that cannot be is not taken", 5, World, "problem")
def _no_quarantine(before: Bug, *given: object) -> str:
    return ""


@register("commands go to who solved last", "deliveries apply in their order at their tick", 1, Stepper, "deliver")
def _twice_delivered(before: Bug, self: Any, packets: Any, *work: Any) -> Any:
    kept = getattr(self, "kept_packets", [])
    self.kept_packets = list(packets)
    return before(self, kept if kept and not packets else packets, *work)


@register("solver knows who it is", "`step` knows neither node, owner nor epoch", 1, Assignment, "shares")
def _knowing_step(before: Bug, self: Any, numbers: Any, *values: Any) -> Any:
    if len(self.roster) < 3:
        numbers[0] += 1e-9
    return before(self, numbers, *values)


@register("outboxes are not emptied", "an outbox holds what is sent at the next tick, once", 1, Stepper, "deliver")
def _full_outbox(before: Bug, self: Any, packets: Any, *work: Any) -> Any:
    outboxes = before(self, packets, *work)
    kept = getattr(self, "kept_outboxes", {})
    self.kept_outboxes = outboxes
    return outboxes or kept


@register("ready is said once", "hello and ready are said again until they are answered", 2, Member, "wake")
def _ready_once(before: Bug, self: Any, now_ns: int, heartbeat: Any) -> None:
    said, self.is_ready = self.is_ready, False
    before(self, now_ns, heartbeat)
    self.is_ready = self.is_ready or said


@register("client answers a Go anew", "a Go that comes again gets the same bytes again", 1, ClientCore, "_on_go")
def _two_dones(before: Bug, self: Any, go: Any) -> None:
    if go.number == self._done_number:
        self.go = go
    else:
        before(self, go)


@register("client numbers from one", "the sequence number counts over all channels", 1, ClientCore, "_numbered")
def _numbers_from_one(before: Bug, self: Any, packets: Any, stamp_ns: int) -> Any:
    self._sequence = 0 if self._answered == 5 else self._sequence
    return before(self, packets, stamp_ns)


register("inputs are kept for ever", "what a process keeps is bounded (node)", 3, Inputs, "forget")(nothing)

MUTANTS: Final[tuple[Mutant, ...]] = tuple(register.mutants)
