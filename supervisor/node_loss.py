"""Nodes that are lost and nodes that come: the next epoch, who owns what in it, and the account of it.

A run that loses a node goes on from its last commit with a new epoch (design, section 5). The lost node's robots are
adopted by those that are left, and go back to it when it returns. While no node is left the world stands still.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING

from foosim.protocol.actions import Journal
from foosim.protocol.codec import encode
from foosim.supervisor.account import Recovered, close_outages
from foosim.supervisor.records import RecoveredRecord
from foosim.supervisor.roster import Process
from foosim.supervisor.vhub_loss import SAID_NS
from foosim.world.edits import Edit, Freeze, Thaw

if TYPE_CHECKING:
    from foosim.supervisor.core import SupervisorCore


class Recovery:
    """Decides what follows when a node is lost or comes."""

    def __init__(self, core: SupervisorCore) -> None:
        self.recovered: list[Recovered] = []
        self._core = core
        self.returns: dict[str, str] = {}
        """Robots that were adopted: the node that they go back to."""

    def lose(self, name: str, reason: str, now_ns: int) -> None:
        """A node is lost: go on without it, or end the run where the deployment says so."""
        core = self._core
        process = core.roster.by_name.get(name)
        if process is not None:
            core.roster.lose(process)
        if not core.is_open:
            core.say("warning", f"lost node {name}: {reason}; the run waits for it")
            return
        if self._ends_run(name):
            core.finish(f"lost {name}: {reason}", failed=True)
            return
        if name not in core.members:
            return
        members = [member for member in core.members if member != name]
        self.note("node", name, reason)
        if members:
            self._freeze(name)
            self.open(self.adopted([name], members), members, now_ns)
            core.say("warning", f"lost node {name}: {reason}; goes on from tick {core.frame.tick} without it")
        else:
            core.hold()
            core.say("error", f"lost node {name}: {reason}; no node is left, the run waits for one")

    def begin(self, here: Collection[str], missing: Collection[str], now_ns: int) -> None:
        """A supervisor that was started again begins with the nodes that are here; the missing ones are lost."""
        core = self._core
        for name in missing:
            reason = "it has not come back to the supervisor"
            if self._ends_run(name):
                core.finish(f"lost {name}: {reason}", failed=True)
                return
            self.note("node", name, reason)
            self._freeze(name)
        if here:
            self.open(self.adopted({*core.owners.values()} - {*here}, here), here, now_ns)
        else:
            core.hold()

    def stop(self, name: str, now_ns: int) -> None:
        """Somebody stops a node: its robots move away, then it is told."""
        core = self._core
        if name in core.members:
            members = [member for member in core.members if member != name]
            self.open(self.adopted([name], members), members, now_ns)
        process = core.roster.by_name.get(name)
        if process is not None:
            core.roster.lose(process)
            core.handshake.refuse(process.role, name, process.boot, "stopped by request")

    def join(self, process: Process, now_ns: int) -> None:
        """A node that has built the world takes part from the last commit on, with the robots that were its own."""
        core, name = self._core, process.name
        owners = dict(core.owners)
        if not core.members:  # nobody else is here: what is theirs is adopted until they return
            self.returns = {**owners, **self.returns}
            owners = dict.fromkeys(owners, name)
        owners.update((robot, name) for robot, node in self.returns.items() if node == name)
        away = {robot: node for robot, node in self.returns.items() if node != name}
        self.note("join", name, "back" if self._was_lost(name) else "started")
        if self._freezes:
            frozen: list[Edit] = [Freeze(robot) for robot in sorted(away)]
            core.requests.order(core.frame.tick, [] if core.members else frozen)
            back = [robot for robot in sorted(owners) if owners[robot] == name and robot not in away]
            core.requests.order(core.released, [Thaw(robot) for robot in back])
        self.open(owners, [*core.members, name], now_ns)
        self.returns = away
        core.actions.append(Journal(encode(core.control())))
        core.say("info", f"node {name} takes part from tick {core.frame.tick}")

    def hear(self, process: Process, now_ns: int) -> None:
        """A lost node is heard of. An epoch without it tells it so, but there is none when it was the last one.

        Then it goes on in the next one, if it had built the world and its arithmetic was compared.
        """
        core = self._core
        if not core.is_open and now_ns > process.gone_ns + SAID_NS:
            process.lost = False  # its connection was cut; it says that it is ready until it is told of an epoch
        runs = core.is_open and core.end is None
        if runs and not core.members and process.ready and process.name not in core.roster.stopped:
            process.lost = False
            self.join(process, now_ns)

    def moved(self, robot: str) -> None:
        """Somebody chose an owner for a robot: that one stays, and runs it."""
        if self.returns.pop(robot, None) is not None and self._freezes:
            self._core.requests.order(self._core.released, [Thaw(robot)])

    def committed(self, before_ns: int, now_ns: int, tick: int) -> list[Recovered]:
        """Frame `tick` is committed, the one before was at `before_ns`: return what is over, as the world goes on."""
        return close_outages(self.recovered, before_ns, now_ns, tick)

    def as_json(self) -> list[dict[str, object]]:
        """Return the account for people and scripts; the outage of what is not over is null."""
        return [
            {
                "what": entry.what,
                "name": entry.name,
                "reason": entry.reason,
                "tick": entry.tick,
                "epoch": entry.epoch,
                "outage_ms": None if entry.outage_ns < 0 else round(entry.outage_ns / 1e6, 3),
            }
            for entry in self.recovered
        ]

    @property
    def _freezes(self) -> bool:
        return self._core.deployment.on_node_loss == "freeze"

    def _ends_run(self, name: str) -> bool:
        """Whether the run cannot go on without a node."""
        deployment = self._core.deployment
        return deployment.nodes[name].required or deployment.on_node_loss == "stop"

    def note(self, what: str, name: str, reason: str, epoch: int | None = None, tick: int | None = None) -> Recovered:
        """Note a loss or a return: at the last commit, from the next epoch on, unless others are named."""
        core = self._core
        at = core.frame.tick if tick is None else tick
        entry = Recovered(what, name, reason, at, core.epoch + 1 if epoch is None else epoch)
        self.recovered.append(entry)
        core.actions.append(Journal(encode(RecoveredRecord(entry))))
        return entry

    def _was_lost(self, name: str) -> bool:
        return any(entry.what == "node" and entry.name == name for entry in self.recovered)

    def open(self, owners: dict[str, str], members: Collection[str], now_ns: int) -> None:
        """Open an epoch. Which robots go back later is written before it: who ends in between forgets none.

        So those that are back in it are struck off behind it.
        """
        core = self._core
        core.account.moves += sum(core.owners[robot] != owner for robot, owner in owners.items())
        core.actions.append(Journal(encode(core.control())))
        core.open_epoch(owners, now_ns, members)
        core.requests.layout_ready(now_ns)

    def _freeze(self, lost: str) -> None:
        """Where the deployment says so, take the robots of a lost node out of service from the last commit on."""
        core = self._core
        if self._freezes:
            frozen: list[Edit] = [Freeze(robot) for robot, owner in sorted(core.owners.items()) if owner == lost]
            core.requests.order(core.frame.tick, frozen)

    def adopted(self, lost: Collection[str], members: Collection[str]) -> dict[str, str]:
        """Return the owners without some nodes: each of their robots goes to whoever then has the fewest, ties by name.

        It is noted that they go back to their nodes.
        """
        owners = dict(self._core.owners)
        for robot in sorted(owners):
            if owners[robot] in lost:
                self.returns.setdefault(robot, owners[robot])
                owners[robot] = fewest(owners, members)
        return owners


def fewest(owners: Mapping[str, str], members: Collection[str]) -> str:
    """Return the member that owns the fewest robots, the first by name among equals."""
    count = dict.fromkeys(sorted(members), 0)
    for owner in owners.values():
        if owner in count:
            count[owner] += 1
    return min(count, key=lambda name: (count[name], name))
