"""The messages by which a vHub that was started again and the supervisor agree on where the run stands."""

from __future__ import annotations

from foosim.common.struct_types import Counter, Digest, Message, Name, Numbers, Text
from foosim.world.initial_state import Added


class ResumeState(Message, frozen=True):
    """How far the vHub has come: the highest epoch that it knows, its last commit as it came (empty before the first),
    the chain over the frames up to it, its layout beside the deployment's, and the last tick whose deliveries are
    `final`.

    It is for the supervisor that was started as `supervisor`. A vHub that `waits` goes on from a journal, and closes
    nothing until it has its `ResumeGrant`. The journal of one that `lost_machine` was written before its machine was
    started the last time: what came last may not have reached the disk. `capture` is its capture, empty without one.
    """

    name: Name
    boot: Name
    supervisor: Name
    epoch: Counter
    commit: Numbers
    chain: Digest
    added: Added
    final: Counter
    waits: bool
    lost_machine: bool
    capture: Text


class ResumeGrant(Message, frozen=True):
    """The supervisor knows where the vHub that was started as `boot` stands: it goes on, in `epoch` or a later one."""

    name: Name
    boot: Name
    epoch: Counter
