"""Bugs of a run that goes on as a branch: what is void counts, or what is not is forgotten."""

from __future__ import annotations

from typing import Any, Final

from msgspec.structs import replace

from foosim.client.core import ClientCore
from foosim.node.inputs import Inputs
from foosim.protocol.hub_messages import ResumeGrant
from foosim.supervisor.failover import Rollback
from foosim.supervisor.state import RunState
from foosim.vhub.core import HubCore
from tests.gate.planting import Mutant, Planting, Register

register = Register()


@register("node keeps deliveries of before a branch", "a branch voids the deliveries behind its tick", 3)
def _keeps(planting: Planting) -> None:
    def begin(self: Any, epoch: Any) -> bool:
        kept = dict(self._deliveries)
        is_branch = bool(before(self, epoch))
        self._deliveries.update(kept)
        return is_branch

    before: Any = planting.swap(Inputs, "begin", begin)


@register("node takes deliveries of another branch", "deliveries count in their branch (node)", 61)
def _takes(planting: Planting) -> None:
    def take(self: Any, deliveries: Any, payload: bytes, own_tick: int) -> bool:
        return bool(before(self, replace(deliveries, branch=self._branch), payload, own_tick))

    before: Any = planting.swap(Inputs, "take_deliveries", take)


@register("supervisor begins no branch", "what the vHub has lost with its machine is void", 3)
def _none(planting: Planting) -> None:
    planting.swap(Rollback, "is_behind", lambda self, standing: False)


@register("a branch forgets what was asked for", "requests keep their ticks in a branch", 3)
def _forgets(planting: Planting) -> None:
    planting.swap(RunState, "reorder_from", lambda self, tick: self.coming_edits.clear())


@register("vHub does not wait", "a vHub that goes on from a journal closes nothing until it may", 3)
def _does_not_wait(planting: Planting) -> None:
    def go_on(self: Any, past: Any, now_ns: int) -> None:
        before(self, past, now_ns)
        if self.handshake.waits:
            self._readers[ResumeGrant] = lambda proceed, payload, now_ns: None
            self.handshake.granted_from = 0
            self._enter()

    before: Any = planting.swap(HubCore, "_go_on", go_on)


@register("client is not set back", "a client goes on from the branch's tick", 3)
def _goes_on(planting: Planting) -> None:
    def set_back(self: Any, welcome: Any) -> None:
        self.branch = welcome.branch

    planting.swap(ClientCore, "_set_back", set_back)


@register("client takes downlinks of before a branch", "what is said to clients counts in its branch", 54)
def _hears(planting: Planting) -> None:
    planting.swap(ClientCore, "_is_present", lambda self, message: True)


@register("client takes any welcome", "a welcome answers one hello", 221)
def _any_welcome(planting: Planting) -> None:
    def on_welcome(self: Any, welcome: Any) -> None:
        before(self, replace(welcome, returns=self._gone))

    before: Any = planting.swap(ClientCore, "_on_welcome", on_welcome)


MUTANTS: Final[tuple[Mutant, ...]] = tuple(register.mutants)
