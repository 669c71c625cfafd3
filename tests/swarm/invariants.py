"""Checks the laws on every journal record and message of a rehearsal, and raises at the first breach.

The checker keeps its own history, from records and messages alone, and checks each new one against it: the permitted
writer, finality, and journal before publication. A stepped world computes each committed tick again. At the end the
journals are folded and compared with the state of their writers.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping

from msgspec.structs import replace

from foosim.common import limits
from foosim.deployment.schema import Deployment
from foosim.protocol import channels
from foosim.protocol.barrier import edits_content, input_digest_of
from foosim.protocol.codec import decode, decode_any, encode
from foosim.protocol.messages import Answer, Commit, Deliveries, Done, Down, Epoch, Go, Order, Part, Recovered
from foosim.simulation.settings import Traced
from foosim.simulation.stepped_world import SteppedWorld
from foosim.simulation.system import System
from foosim.supervisor.records import CommitRecord, OrderedRecord, RecoveredRecord, RequestRecord
from foosim.supervisor.records import Record as SupervisorRecord
from foosim.supervisor.records import fold as fold_supervisor
from foosim.vhub.state.records import Closing, Fold, HubRecord, TickRecord
from foosim.world.assembly.initial_state import initial_frame
from foosim.world.edits import Edit
from foosim.world.frame import CHAIN_START, chain_next
from tests.swarm.living_laws import LivingLaws
from tests.swarm.packet_invariants import PacketLaws, hold
from tests.swarm.world_bounds import strays


class Laws:
    """Checks a run; raises Broken at the first breach. `ticks` counts those that it saw complete."""

    def __init__(self, world: SteppedWorld, deployment: Deployment) -> None:
        self.ticks = 0
        self.packets = PacketLaws(deployment)
        self.epoch = 0
        self.flipped: Collection[str] = ()
        """Nodes whose memory a fault has changed."""
        self._world = world
        self._deployment = deployment
        self._living = LivingLaws(deployment, world.frame.layout)
        self._chains = {0: CHAIN_START}
        """By tick, over all frames up to it."""
        self._digests = {0: initial_frame(deployment).digest}
        self._rosters: dict[int, list[str]] = {}
        self._epochs: set[bytes] = set()
        self._commits: dict[int, bytes] = {}
        self._parts: dict[tuple[int, int], dict[str, tuple[bytes, Part]]] = {}
        """By (epoch, tick) and node: its part, of which there may be one only."""
        self._ordered: dict[int, list[Edit]] = {}
        """Edits of journalled requests, by tick."""
        self._orders: dict[int, bytes] = {}
        self._said_epoch: dict[str, int] = {}
        """The newest epoch of which each node has published a part."""
        self._stopped: list[str] = []
        self._answers: dict[tuple[str, str], bytes] = {}
        self._chosen = deployment.owners()
        """The owner of each robot by the deployment or the last move."""
        self._untold: list[Recovered] = []
        """Journalled losses and returns that no commit has reported."""
        self._told: dict[int, list[Recovered]] = {}
        """Losses and returns that each commit has reported, by tick."""
        self._captured_told: set[int] = set()
        """The ticks whose losses and returns are in the capture."""
        self._journals: dict[str, list[bytes]] = {channels.SUPERVISOR: [], channels.VHUB: []}
        self._readers: Mapping[tuple[str, str], Callable[[Traced], None]] = {
            ("journal", channels.SUPERVISOR): self._supervisor_writes,
            ("journal", channels.VHUB): self._hub_writes,
            ("publish", channels.PART.name): self._part,
            ("publish", channels.ORDER.name): self._order,
            ("publish", channels.COMMIT.name): self._commit,
            ("publish", channels.EPOCH.name): self._epoch_said,
            ("publish", channels.DELIVERIES.name): self._deliveries,
            ("publish", channels.ANSWER.name): self._answer,
            ("publish", channels.DOWN.name): self._down,
            ("publish", channels.UP.name): self._up,
        }

    @property
    def committed(self) -> int:
        return next(reversed(self._commits), -1)  # they arrive in order

    def see(self, traced: Traced) -> None:
        """Check one action of a process."""
        reader = self._readers.get((traced.what, traced.channel or traced.process))
        if reader is not None:
            reader(traced)

    # --- journals --------------------------------------------------------------------------------------------------

    def _supervisor_writes(self, traced: Traced) -> None:
        self._journals[channels.SUPERVISOR].append(traced.payload)
        record = decode_any(SupervisorRecord, traced.payload)
        if isinstance(record, CommitRecord):
            self._commits_one(record.commit, decode(Commit, record.commit))
        elif isinstance(record, Epoch):
            self._begins(record, traced.payload)
        elif isinstance(record, OrderedRecord):
            self._ordered.setdefault(record.tick, []).extend(record.edits)
        elif isinstance(record, RecoveredRecord):
            self._untold.append(record.entry.message())
        elif isinstance(record, RequestRecord):
            key = record.answer.sender, record.answer.id
            hold(key not in self._answers, f"request {key} is carried out twice")
            hold(not record.edits or record.tick > max(self._orders, default=-1), f"{key} changes what is released")
            self._answers[key] = encode(record.answer)
            self._ordered.setdefault(record.tick, []).extend(record.edits)
            self._stopped = record.control.stopped
            robot, does, _ = f"{record.answer.text}  ".split(" ", 2)
            if record.answer.accepted and does in ("moved", "is") and robot in self._chosen:
                self._chosen[robot] = record.owners[robot]

    def _commits_one(self, raw: bytes, commit: Commit) -> None:
        """Laws 3 and 4: the next tick, of the current epoch, from one part of each member, with one input digest."""
        tick, epoch = commit.tick, commit.epoch
        hold(tick == self.committed + 1, f"commit {tick} after {self.committed}")
        hold(epoch == self.epoch, f"commit {tick} of epoch {epoch} in epoch {self.epoch}")
        self._commits[tick] = raw
        self._tells(commit)
        if tick == 0:
            hold(commit.digest == self._digests[0], "frame 0 is not that of the deployment")
            return
        self._digests[tick] = commit.digest
        self._chains[tick] = chain_next(self._chains[tick - 1], commit.digest)
        parts = self._parts.get((epoch, tick), {})
        hold(sorted(parts) == self._rosters[epoch], f"commit {tick}: parts of {sorted(parts)} in epoch {epoch}")
        hold(edits_content(commit.edits) == self._orders.get(tick - 1), f"commit {tick} with edits that no order had")
        digest = self._input_digest(tick, commit.edits)
        strange = [node for node, (_, part) in parts.items() if part.input_digest != digest]
        hold(not strange, f"commit {tick} is made of parts of {strange}, with another input digest")
        self._check_ahead(tick + 1)
        solved = sorted(index for _, part in parts.values() for index in part.solved)
        hold(solved == list(range(len(solved))), f"tick {tick}: entities {solved} are solved")
        for old in [key for key in self._parts if key[1] <= tick]:
            self._parts.pop(old)

    def _tells(self, commit: Commit) -> None:
        """The next commit reports each loss and return, once, in the order of the journal."""
        told = [replace(entry, outage_ns=-1) for entry in commit.recovered]
        hold(told == self._untold, f"commit {commit.tick} reports {told}, the journal has {self._untold}")
        self._untold.clear()
        if commit.recovered:
            self._told[commit.tick] = commit.recovered

    def _input_digest(self, tick: int, edits: list[Edit]) -> bytes:
        """Return the input digest that all parts of frame `tick` must have."""
        delivered = self.packets.said.get(tick - 1)
        hold(delivered is not None, f"frame {tick} before the deliveries of the tick before")
        return input_digest_of(self._digests[tick - 1], edits, delivered or b"")

    def _check_ahead(self, tick: int) -> None:
        """A node ahead of the commits has the frame that is committed later, unless its memory was changed."""
        for each in [parts for (_, ahead), parts in self._parts.items() if ahead == tick]:
            for node, (_, part) in each.items():
                expected = self._input_digest(tick, self._ordered.get(tick - 1, []))
                right = node in self.flipped or part.input_digest == expected
                hold(right, f"{node} continues from another frame {tick - 1} than the committed one")

    def _begins(self, epoch: Epoch, raw: bytes) -> None:
        hold(epoch.epoch > self.epoch, f"epoch {epoch.epoch} after {self.epoch}")
        hold(epoch.tick == max(self.committed, 0), f"epoch {epoch.epoch} does not start at the last commit")
        hold(epoch.digest == self._digests[epoch.tick], f"epoch {epoch.epoch} starts from another frame")
        owners = dict(epoch.owners)
        hold(owners.keys() == self._deployment.robots.keys(), f"epoch {epoch.epoch} has not all robots")
        hold(not {*epoch.roster} & {*self._stopped}, f"epoch {epoch.epoch} is with a node that is stopped")
        hold({*owners.values()} <= {*epoch.roster}, f"epoch {epoch.epoch}: an owner takes no part")
        self.epoch = epoch.epoch
        self._rosters[epoch.epoch] = sorted(epoch.roster)
        self._epochs.add(raw)

    def _hub_writes(self, traced: Traced) -> None:
        self._journals[channels.VHUB].append(traced.payload)
        record = decode_any(HubRecord, traced.payload)
        if isinstance(record, TickRecord):
            hold(record.commit == self._commits.get(record.tick), f"the vHub closes tick {record.tick} uncommitted")
            self.packets.closes(record, self._digests[record.tick])

    # --- messages --------------------------------------------------------------------------------------------------

    def _part(self, traced: Traced) -> None:
        part = decode(Part, traced.payload)
        hold(part.node in self._rosters.get(part.epoch, ()), f"{part.node} has no part in epoch {part.epoch}")
        hold(part.epoch >= self._said_epoch.get(part.node, 0), f"{part.node} goes back to epoch {part.epoch}")
        self._said_epoch[part.node] = part.epoch
        if part.tick <= self.committed:
            return
        said = self._parts.setdefault((part.epoch, part.tick), {}).setdefault(part.node, (traced.payload, part))
        hold(said[0] == traced.payload, f"{part.node} has two parts {part.tick} in epoch {part.epoch}")

    def _order(self, traced: Traced) -> None:
        """Law 3: order k is equal in every epoch, and the edits of requests are journalled before."""
        order = decode(Order, traced.payload)
        hold(order.epoch == self.epoch, f"order {order.tick} of epoch {order.epoch} in epoch {self.epoch}")
        last = order.tick + order.following
        hold(last <= max(self.committed, 0) + limits.RELEASE_AHEAD, f"order {last} is released at {self.committed}")
        for tick in range(order.tick, last + 1):
            edits = edits_content(order.edits if tick == order.tick else [])
            hold(edits == edits_content(self._ordered.get(tick, [])), f"order {tick} is not what was journalled")
            hold(edits == self._orders.setdefault(tick, edits), f"order {tick} has changed")

    def _commit(self, traced: Traced) -> None:
        tick = decode(Commit, traced.payload).tick
        hold(traced.payload == self._commits.get(tick), f"commit {tick} is not published as journalled")

    def _epoch_said(self, traced: Traced) -> None:
        hold(traced.payload in self._epochs, "epoch is published before it is journalled")

    def _deliveries(self, traced: Traced) -> None:
        self.packets.delivers(decode(Deliveries, traced.payload), traced.payload)

    def _answer(self, traced: Traced) -> None:
        """The same request, the same answer."""
        answer = decode(Answer, traced.payload)
        key = answer.sender, answer.id
        if answer.result == b"{}":  # any other answer is a status, which changes
            hold(self._answers.get(key) == traced.payload, f"{key} is answered, but not journalled or differently")

    def _down(self, traced: Traced) -> None:
        down = decode_any(Go | Down, traced.payload)
        hold(down.tick <= self.committed, f"downlink of tick {down.tick}, of which {self.committed} is committed")
        self.packets.downlink(traced.name, down, traced.payload)

    def _up(self, traced: Traced) -> None:
        up = decode_any(channels.UP.message, traced.payload)
        if isinstance(up, Done):
            self.packets.answers(up, traced.payload)

    # --- results ---------------------------------------------------------------------------------------------------

    def close(self, closing: Closing) -> None:
        """Compute the tick again from its inputs: the frame must be bit-identical."""
        frame = closing.frame
        self.packets.fates(closing)
        told = self._told.get(frame.tick, [])
        self._captured_told.add(frame.tick)
        hold(closing.recovered == told, f"tick {frame.tick} is captured with {closing.recovered}, not with {told}")
        if frame.tick != self._world.frame.tick + 1:
            return  # frame 0, or the last one of a run that ended before all was closed
        before = self._world.frame
        again = self._world.step(closing.delivered, closing.edits)
        hold(again.digest == closing.digest, f"frame {frame.tick} is not the one that its inputs give")
        hold(closing.digest == self._digests[frame.tick], f"frame {frame.tick} is not the committed one")
        self.packets.senses(again, self._world)
        self._living.check(closing, before)
        stray = strays(self._deployment, again)
        hold(not stray, f"at tick {frame.tick} {', '.join(stray)}")
        self.ticks = frame.tick

    def end(self, system: System, nodes: int) -> None:
        """After healing: all processes are back, all requests are answered, and the folded journals equal the state."""
        supervisor = system.supervisor
        hold(supervisor.state.chain == self._chains[self.committed], "the chain is not that of the committed frames")
        members = [f"n{number}" for number in range(1, nodes + 1)]
        hold(list(supervisor.state.members) == members, f"healed, only {', '.join(supervisor.state.members)} take part")
        strayed = {robot: owner for robot, owner in supervisor.state.owners.items() if owner != self._chosen[robot]}
        hold(not strayed, f"healed, {strayed} are not where they belong")
        asked = [identity for identity in system.people.verbs if identity not in system.answers]
        hold(not asked, f"{asked} are not answered")
        untold = self._told.keys() - self._captured_told
        hold(not untold, f"losses and returns of ticks {sorted(untold)} are not in the capture")
        kept, frame = fold_supervisor(self._deployment, self._journals[channels.SUPERVISOR])
        hold(
            kept.chain == self._chains[self.committed] and frame.digest == supervisor.state.frame.digest,
            "another chain is folded",
        )
        hold(kept.epoch == supervisor.state.epoch_payload, "another epoch is folded")
        hold(kept.owners == supervisor.state.owners and not kept.edits, "other owners or edits are folded")
        state = system.hub.state
        assert state is not None
        fold = Fold(self._deployment, self._journals[channels.VHUB])
        hold([*fold] != [] and fold.state.snapshot() == state.snapshot(), "the vHub's journal gives another state")
        self.packets.end(system)
