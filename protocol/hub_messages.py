"""The messages by which a restarted vHub and the supervisor agree on the position from which the run continues."""

from __future__ import annotations

from foosim.common.struct_types import Counter, Digest, Message, Name, Numbers, Text


class ResumeState(Message, frozen=True):
    """The vHub's position: its highest epoch, the bytes of its last commit (empty before the first), the
    chain over the frames up to it, and the last tick whose deliveries are `final`.

    `supervisor` is the boot of the supervisor that it answers. A vHub that `waits` continues from a journal, and closes
    no tick before its `ResumeGrant`. With `lost_machine` its machine was booted after its journal was begun: the last
    records may not have reached the disk. `capture` is the path of its capture, empty without one.
    """

    name: Name
    boot: Name
    supervisor: Name
    epoch: Counter
    commit: Numbers
    chain: Digest
    final: Counter
    waits: bool
    lost_machine: bool
    capture: Text


class ResumeGrant(Message, frozen=True):
    """The supervisor lets the vHub of this `boot` continue, in `epoch` or a later one."""

    name: Name
    boot: Name
    epoch: Counter
