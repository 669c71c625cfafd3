"""Bugs of nodes, of what they share with their peers, and of clients."""

from __future__ import annotations

from itertools import count
from typing import Any, Final

from foosim.client.core import ClientCore
from foosim.common.batched.noise import NoiseKeys
from foosim.node import tick as step
from foosim.node.core import NodeCore
from foosim.node.inputs import Inputs
from foosim.node.tick import Stepper
from foosim.protocol import channels
from foosim.protocol.handshake import Member
from foosim.world.assembly.islands import Assignment
from foosim.world.assembly.world import World
from tests.gate.planting import Mutant, Planting, Register

register = Register()


@register("node takes old epochs", "a node drops orders and parts of older epochs", 3)
def _old_epochs(planting: Planting) -> None:
    def fenced(self: Any, channel: Any, message: Any, payload: bytes) -> bool:
        return message.epoch >= self.epoch and bool(before(self, channel, message, payload))

    before: Any = planting.swap(NodeCore, "_fenced", fenced)


@register("node takes new epochs early", "messages of a newer epoch are held until the epoch comes", 111)
def _new_epochs(planting: Planting) -> None:
    def fenced(self: Any, channel: Any, message: Any, payload: bytes) -> bool:
        return message.epoch <= self.epoch and bool(before(self, channel, message, payload))

    before: Any = planting.swap(NodeCore, "_fenced", fenced)


@register("node does not compare input digests", "a node collects parts with its own input digest only", 4)
def _any_digest(planting: Planting) -> None:
    planting.swap(NodeCore, "_take_part", lambda self, barrier, part: barrier.add(part))


@register("node does not ask again", "who has had no progress asks again (node)", 2)
def _patient_node(planting: Planting) -> None:
    planting.swap(NodeCore, "_request_missing", lambda self, now_ns: self._retry.requested(now_ns))


@register("node does not answer who asks", "senders keep what is not yet committed (node)", 2)
def _mute_node(planting: Planting) -> None:
    planting.swap(NodeCore, "_on_want", lambda self, want, payload, now_ns: None)


@register("node does not sample again", "any owner computes the samples again from Commit(k)", 2)
def _samples_once(planting: Planting) -> None:
    planting.swap(NodeCore, "_sample_again", lambda self, tick: None)


@register("zombie does not notice", "back again, a lost node is a newcomer", 4)
def _zombie(planting: Planting) -> None:
    planting.swap(NodeCore, "_begin_anew", lambda self, epoch: None)


@register("node keeps its own frame", "a node takes its own frame c only if D(c) fits", 2)
def _own_frame(planting: Planting) -> None:
    def on_epoch(self: Any, epoch: Any, payload: bytes, now_ns: int) -> None:
        newest = self.frame
        before(self, epoch, payload, now_ns)
        if self._awaited_epoch is epoch and newest is not None and self.name in epoch.roster:
            self._resume(newest, now_ns)

    before: Any = planting.swap(NodeCore, "_on_epoch", on_epoch)


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


@register("node deals shares its own way", "exactly one solver for each entity at each tick", 1)
def _own_shares(planting: Planting) -> None:
    def make_term(self: Any) -> Any:
        term = before(self)
        if self.name != self.roster[0]:
            object.__setattr__(term.assignment, "roster", (self.name, *self.roster))
        return term

    before: Any = planting.swap(NodeCore, "_make_term", make_term)


@register("noise from a running stream", "draws are keyed by tick, never taken from a running stream", 1)
def _running_noise(planting: Planting) -> None:
    numbers = count()

    def normal(self: Any, counter: int, width: int, slot: int = 0) -> Any:
        return before(self, next(numbers), width, slot)

    before: Any = planting.swap(NoiseKeys, "normal", normal)


@register("no quarantine", "a result that cannot be is not taken", 5)
def _no_quarantine(planting: Planting) -> None:
    planting.swap(World, "problem", lambda self, entity, numbers, before, tick: "")


@register("commands go to who solved last", "deliveries apply in their order at their tick", 1)
def _twice_delivered(planting: Planting) -> None:
    def deliver(self: Any, packets: Any, *work: Any) -> Any:
        kept = getattr(self, "kept_packets", [])
        self.kept_packets = list(packets)
        return before(self, kept if kept and not packets else packets, *work)

    before: Any = planting.swap(Stepper, "deliver", deliver)


@register("solver knows who it is", "`step` knows neither node, owner nor epoch", 1)
def _knowing_step(planting: Planting) -> None:
    def shares(self: Any, numbers: Any, *values: Any) -> Any:
        if len(self.roster) < 3:
            numbers[0] += 1e-9
        return before(self, numbers, *values)

    before: Any = planting.swap(Assignment, "shares", shares)


@register("outboxes are not emptied", "an outbox holds what is sent at the next tick, once", 1)
def _full_outbox(planting: Planting) -> None:
    def deliver(self: Any, packets: Any, *work: Any) -> Any:
        outboxes = before(self, packets, *work)
        kept = getattr(self, "kept_outboxes", {})
        self.kept_outboxes = outboxes
        return outboxes or kept

    before: Any = planting.swap(step.Stepper, "deliver", deliver)


@register("ready is said once", "hello and ready are said again until they are answered", 2)
def _ready_once(planting: Planting) -> None:
    def wake(self: Any, now_ns: int, heartbeat: Any) -> None:
        said, self.is_ready = self.is_ready, False
        before(self, now_ns, heartbeat)
        self.is_ready = self.is_ready or said

    before: Any = planting.swap(Member, "wake", wake)


@register("client answers a Go anew", "a Go that comes again gets the same bytes again", 1)
def _two_dones(planting: Planting) -> None:
    def on_go(self: Any, go: Any) -> None:
        if go.number == self._done_number:
            self.go = go
        else:
            before(self, go)

    before: Any = planting.swap(ClientCore, "_on_go", on_go)


@register("client numbers from one", "the sequence number counts per source over all channels", 1)
def _numbers_from_one(planting: Planting) -> None:
    def numbered(self: Any, packets: Any, stamp_ns: int) -> Any:
        self._sequence = 0 if self._answered == 5 else self._sequence
        return before(self, packets, stamp_ns)

    before: Any = planting.swap(ClientCore, "_numbered", numbered)


@register("inputs are kept for ever", "what a process keeps is bounded (node)", 3)
def _kept_inputs(planting: Planting) -> None:
    planting.swap(Inputs, "forget", lambda self, tick: None)


MUTANTS: Final[tuple[Mutant, ...]] = tuple(register.mutants)
