"""Nodes that are lost and nodes that come: the next epoch, who owns what in it, and the account of it.

A run that loses a node goes on from its last commit with a new epoch (design, section 5). The lost node's robots are
adopted by those that are left, and go back to it when it returns. While no node is left the world stands still.
Neighbours: `watch` finds who is lost, `roster` knows who is here, `core` opens epochs.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from foosim.supervisor.roster import Process

if TYPE_CHECKING:
    from foosim.supervisor.core import SupervisorCore


@dataclass(slots=True)
class Recovered:
    """One loss or return. `outage_ns` is the wall time without a commit, -1 while there is none behind it."""

    what: str
    name: str
    reason: str
    tick: int
    epoch: int
    outage_ns: int = -1


class Recovery:
    """Decides what follows when a node is lost or comes."""

    def __init__(self, core: SupervisorCore) -> None:
        self.recovered: list[Recovered] = []
        self._core = core
        self._returns: dict[str, str] = {}
        """Robots that were adopted: the node that they go back to."""

    def lose(self, name: str, reason: str, now_ns: int) -> None:
        """A node is lost: go on without it, or end the run where the deployment says so."""
        core = self._core
        process = core.roster.by_name.get(name)
        if process is not None:
            core.roster.lose(process)
        if core.epoch == 0:
            core.say("warning", f"lost node {name}: {reason}; the run has not started, and waits for it")
            return
        deployment = core.deployment
        if deployment.nodes[name].required or deployment.on_node_loss == "stop":
            core.finish(f"lost {name}: {reason}", failed=True)
            return
        if name not in core.members:
            return
        members = [member for member in core.members if member != name]
        self._note("node", name, reason)
        if members:
            self._open(self._adopted(name, members), members, now_ns)
            core.say("warning", f"lost node {name}: {reason}; goes on from tick {core.frame.tick} without it")
        else:
            core.hold()
            core.say("error", f"lost node {name}: {reason}; no node is left, the run waits for one")

    def stop(self, name: str, now_ns: int) -> None:
        """Somebody stops a node: its robots move away, then it is told."""
        core = self._core
        core.roster.stopped.add(name)
        if name in core.members:
            members = [member for member in core.members if member != name]
            self._open(self._adopted(name, members), members, now_ns)
        process = core.roster.by_name.get(name)
        if process is not None:
            core.roster.lose(process)
            core.handshake.refuse(process.role, name, process.boot, "stopped by request")

    def join(self, process: Process, now_ns: int) -> None:
        """A node that has built the world takes part from the last commit on, with the robots that were its own."""
        core, name = self._core, process.name
        owners = dict(core.owners)
        if not core.members:  # nobody else is here: what is theirs is adopted until they return
            self._returns = {**owners, **self._returns}
            owners = dict.fromkeys(owners, name)
        owners.update((robot, name) for robot, node in self._returns.items() if node == name)
        self._returns = {robot: node for robot, node in self._returns.items() if node != name}
        self._note("join", name, "back" if self._was_lost(name) else "started")
        self._open(owners, [*core.members, name], now_ns)
        core.say("info", f"node {name} takes part from tick {core.frame.tick}")

    def hear(self, process: Process, now_ns: int) -> None:
        """A lost node is heard of. An epoch without it tells it so, but there is none when it was the last one.

        Then it goes on in the next one, if it had built the world and its arithmetic was compared.
        """
        core = self._core
        runs = core.epoch > 0 and core.end is None
        if runs and not core.members and process.ready and process.name not in core.roster.stopped:
            process.lost = False
            self.join(process, now_ns)

    def moved(self, robot: str) -> None:
        """Somebody chose an owner for a robot: that one stays."""
        self._returns.pop(robot, None)

    def committed(self, before_ns: int, now_ns: int) -> None:
        """A frame is committed, the one before it was at `before_ns`: the world goes on again."""
        for entry in reversed(self.recovered):
            if entry.what == "vhub":
                continue
            if entry.outage_ns >= 0:
                return
            entry.outage_ns = max(0, now_ns - before_ns)

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

    def _note(self, what: str, name: str, reason: str) -> None:
        core = self._core
        self.recovered.append(Recovered(what, name, reason, core.frame.tick, core.epoch + 1))

    def _was_lost(self, name: str) -> bool:
        return any(entry.what == "node" and entry.name == name for entry in self.recovered)

    def _open(self, owners: dict[str, str], members: Collection[str], now_ns: int) -> None:
        core = self._core
        core.account.moves += sum(core.owners[robot] != owner for robot, owner in owners.items())
        core.open_epoch(owners, now_ns, members)
        core.requests.layout_ready(now_ns)

    def _adopted(self, lost: str, members: Collection[str]) -> dict[str, str]:
        """Return the owners without a node: each of its robots goes to whoever then has the fewest, ties by name."""
        owners = dict(self._core.owners)
        for robot in sorted(owners):
            if owners[robot] == lost:
                self._returns.setdefault(robot, lost)
                owners[robot] = fewest(owners, members)
        return owners


def fewest(owners: Mapping[str, str], members: Collection[str]) -> str:
    """Return the member that owns the fewest robots, the first by name among equals."""
    count = dict.fromkeys(sorted(members), 0)
    for owner in owners.values():
        if owner in count:
            count[owner] += 1
    return min(count, key=lambda name: (count[name], name))
