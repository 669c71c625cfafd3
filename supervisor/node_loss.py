"""Loss, stop and return of nodes: the next epoch, and the owner of each robot in it.

A run that loses a node continues from its last commit with a new epoch. The remaining members
adopt the robots of the lost node and give them back when it returns. Without any node the run waits.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from typing import Final

from foosim.supervisor.roster import IN_FLIGHT_NS, Process, refuse
from foosim.supervisor.state import RunState
from foosim.world.component_types.descriptions import DOWN
from foosim.world.edits import Edit, Set

FROZEN: Final = 2.0
"""What `down` holds of a robot that the loss of its node took out of service; 1 where an operator or an event did."""


class NodeLoss:
    """Reassigns robots when a node is lost, stopped, or joins."""

    def __init__(
        self,
        state: RunState,
        open_epoch: Callable[[dict[str, str], int, Iterable[str]], None],
        finish: Callable[[str], None],
    ) -> None:
        """`open_epoch` opens one for owners, the time and members, `finish` ends the run as failed."""
        self._state = state
        self._open_epoch = open_epoch
        self._finish = finish

    def lose(self, name: str, reason: str, now_ns: int) -> None:
        """Continue without a lost node, or end the run, as the deployment configures."""
        state = self._state
        process = state.roster.by_name.get(name)
        if process is not None:
            state.roster.lose(process)
        if not state.is_open:
            state.log("warning", f"lost node {name}: {reason}; the run waits for it")
            return
        if self._ends_run(name):
            self._finish(f"lost {name}: {reason}")
            return
        if name not in state.members:
            return
        members = [member for member in state.members if member != name]
        state.note_recovery("node", name, reason)
        if members:
            self._freeze_of(name)
            self.open(self.adopted([name], members), members, now_ns)
            state.log("warning", f"lost node {name}: {reason}; continues from tick {state.frame.tick} without it")
        else:
            state.hold()
            state.log("error", f"lost node {name}: {reason}; no node is left, the run waits for one")

    def begin(self, here: Collection[str], missing: Collection[str], now_ns: int) -> None:
        """Begin a resumed run with the nodes that are here; the missing ones are lost."""
        state = self._state
        for name in missing:
            reason = "it has not come back to the supervisor"
            if self._ends_run(name):
                self._finish(f"lost {name}: {reason}")
                return
            state.note_recovery("node", name, reason)
            self._freeze_of(name)
        if here:
            self.open(self.adopted({*state.owners.values()} - {*here}, here), here, now_ns)
        else:
            state.hold()

    def stop(self, name: str, now_ns: int) -> None:
        """Stop a node by request: its robots move to the other members first."""
        state = self._state
        if name in state.members:
            members = [member for member in state.members if member != name]
            self.open(self.adopted([name], members), members, now_ns)
        process = state.roster.by_name.get(name)
        if process is not None:
            state.roster.lose(process)
            process.closed_ns = now_ns  # also when the node is started again, this process is not
            state.actions += refuse(process.role, name, process.boot, "stopped by request")

    def join(self, process: Process, now_ns: int) -> None:
        """Let a node that has built the world take part from the last commit on, with the robots that were its own."""
        state, name = self._state, process.name
        owners = dict(state.owners)
        if not state.members:  # it adopts the robots of all others until they return
            state.returns = {**owners, **state.returns}
            owners = dict.fromkeys(owners, name)
        owners.update((robot, name) for robot, node in state.returns.items() if node == name)
        away = {robot: node for robot, node in state.returns.items() if node != name}
        was_lost = any(entry.what == "node" and entry.name == name for entry in state.recovered)
        state.note_recovery("join", name, "back" if was_lost else "started")
        if self._freezes:
            if not state.members:
                self._freeze(away)
            self._thaw(robot for robot in sorted(owners) if owners[robot] == name and robot not in away)
        self.open(owners, [*state.members, name], now_ns)
        state.returns = away
        state.journal(state.control())
        state.log("info", f"node {name} takes part from tick {state.frame.tick}")

    def on_heartbeat(self, process: Process, now_ns: int) -> None:
        """A lost node sends heartbeats. An epoch without it shows that, but there is none when it was the last member.

        Then it joins again, if it had built the world and its arithmetic was compared.
        """
        state = self._state
        if not state.is_open and now_ns > process.closed_ns + IN_FLIGHT_NS:
            process.lost = False  # its connection was cut; it repeats that it is ready until it gets an epoch
        runs = state.is_open and state.end is None
        if runs and not state.members and process.ready and process.name not in state.roster.stopped:
            process.lost = False
            self.join(process, now_ns)

    def moved(self, robot: str) -> None:
        """An operator chose the owner of a robot: it does not go back to another node, and runs."""
        state = self._state
        if state.returns.pop(robot, None) is not None and self._freezes:
            self._thaw([robot])

    def open(self, owners: dict[str, str], members: Collection[str], now_ns: int) -> None:
        """Open an epoch.

        The robots that go back later are journalled before it, so that a crash in between forgets none; the caller
        removes the returned ones afterwards.
        """
        state = self._state
        state.account.moves += sum(state.owners[robot] != owner for robot, owner in owners.items())
        state.journal(state.control())
        self._open_epoch(owners, now_ns, members)

    def adopted(self, lost: Collection[str], members: Collection[str]) -> dict[str, str]:
        """Return the owners without some nodes: each of their robots goes to the member that then has the fewest, ties
        by name. The state keeps to which node each of them goes back."""
        owners = dict(self._state.owners)
        for robot in sorted(owners):
            if owners[robot] in lost:
                self._state.returns.setdefault(robot, owners[robot])
                owners[robot] = fewest(owners, members)
        return owners

    @property
    def _freezes(self) -> bool:
        return self._state.deployment.on_node_loss == "freeze"

    def _ends_run(self, name: str) -> bool:
        """Whether the run ends without a node."""
        deployment = self._state.deployment
        return deployment.nodes[name].required or deployment.on_node_loss == "stop"

    def _freeze_of(self, lost: str) -> None:
        """Where configured, take the robots of a lost node out of service."""
        if self._freezes:
            self._freeze(robot for robot, owner in self._state.owners.items() if owner == lost)

    def _freeze(self, robots: Iterable[str]) -> None:
        """Take robots out of service from the last commit on, except robots that are out of service already."""
        down = self._down()
        edits: list[Edit] = [Set(robot, DOWN, [FROZEN]) for robot in sorted(robots) if down[robot] == 0.0]
        self._state.order(self._state.frame.tick, edits)

    def _thaw(self, robots: Iterable[str]) -> None:
        """Put robots back into service that the loss of a node had taken out of it."""
        down = self._down()
        edits: list[Edit] = [Set(robot, DOWN, [0.0]) for robot in sorted(robots) if down[robot] == FROZEN]
        self._state.order(self._state.released, edits)

    def _down(self) -> dict[str, float]:
        """Return what each robot's slot `down` will hold after all edits that are ordered."""
        numbers = self._state.coming_numbers()
        return {robot.name: numbers[robot.offsets[DOWN]] for robot in self._state.frame.layout.robots}


def fewest(owners: Mapping[str, str], members: Collection[str]) -> str:
    """Return the member that owns the fewest robots, the first by name among equals."""
    count = dict.fromkeys(sorted(members), 0)
    for owner in owners.values():
        if owner in count:
            count[owner] += 1
    return min(count, key=lambda name: (count[name], name))
