"""Who takes part and who owns what, against a small model: nodes come, go, fall silent, are stopped, robots are moved.

The supervisor's real core is told what processes say, in any order; the model knows for each robot where it is at home
and for each node how far it has come, and nothing of rosters, returns or epochs.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from foosim.common import limits
from foosim.common.json_text import encode_json
from foosim.common.struct_types import Message
from foosim.common.units import Pace
from foosim.deployment.loader import apply_sets
from foosim.protocol import channels
from foosim.protocol.actions import Publish
from foosim.protocol.channels import SUPERVISOR, VHUB, Channel
from foosim.protocol.codec import decode, encode
from foosim.protocol.messages import Answer, Epoch, Heartbeat, Hello, Part, Ready, Request
from foosim.simulation.run import with_nodes
from foosim.supervisor.core import SupervisorCore
from foosim.supervisor.settings import RunSettings

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
NODES: Final = ("n1", "n2", "n3")
TEXT: Final = with_nodes(apply_sets(TABLE.read_text(), "t", ["engine=pure", "players={}"]), "t", len(NODES))
PRINT: Final = bytes(32)
ABSENT, KNOWN, MEMBER, LOST = "absent", "known", "member", "lost"
"""How far a node has come: nobody, let in by its hello, in the epoch, gone."""


class Membership(RuleBasedStateMachine):
    """The supervisor, three nodes and a vHub that stays."""

    def __init__(self) -> None:
        super().__init__()
        self.core = SupervisorCore(RunSettings("run", "t", TEXT, Pace("fast")), PRINT, 0)
        self.now_ns = 0
        self.epochs: list[Epoch] = []
        self.answers: list[Answer] = []
        self.requests = self.refused = 0
        # the model
        self.state = dict.fromkeys(NODES, ABSENT)
        self.boots = dict.fromkeys(NODES, 0)
        self.built = dict.fromkeys(NODES, False)
        self.stopped: set[str] = set()
        self.owner = self.core.state.deployment.owners()
        self.home = dict(self.owner)
        self.opened = 0

    @property
    def members(self) -> list[str]:
        return [node for node in NODES if self.state[node] == MEMBER]

    def tell(self, channel: Channel, name: str, message: Message) -> None:
        self.now_ns += 1
        self.core.receive(channel, name, encode(message), self.now_ns)
        self.hear()

    def hear(self) -> None:
        for action in self.core.actions:
            if isinstance(action, Publish) and action.channel is channels.EPOCH:
                epoch = decode(Epoch, action.payload)
                if not self.epochs or epoch != self.epochs[-1]:  # it is said again to who may have missed it
                    self.epochs.append(epoch)
            elif isinstance(action, Publish) and action.channel is channels.ANSWER:
                self.answers.append(decode(Answer, action.payload))
        self.core.actions.clear()

    def ask(self, verb: str, **arguments: str) -> bool:
        self.requests += 1
        request = Request("operator", f"r{self.requests}", verb, encode_json(arguments))
        self.tell(channels.REQUEST, "operator", request)
        return self.answers[-1].accepted

    # --- what the model says -----------------------------------------------------------------------------------------

    def begin_if_all_are_here(self) -> None:
        if self.opened == 0 and all(self.state[node] == KNOWN and self.built[node] for node in NODES):
            self.state = dict.fromkeys(NODES, MEMBER)
            self.opened = 1

    def enter(self, node: str) -> None:
        """A node takes part: what is at home with it comes back; alone it has everything."""
        alone = not self.members
        self.state[node] = MEMBER
        self.owner = {robot: node if alone or self.home[robot] == node else self.owner[robot] for robot in self.owner}
        self.opened += 1

    def depart(self, node: str) -> None:
        """A node is out: each of its robots goes to whoever then has the fewest, unless nobody is left."""
        was_member = self.state[node] == MEMBER
        self.state[node] = LOST
        if was_member and self.members:
            for robot in sorted(robot for robot, owner in self.owner.items() if owner == node):
                owned = list(self.owner.values())
                self.owner[robot] = min(self.members, key=lambda member: (owned.count(member), member))
            self.opened += 1

    # --- what happens ------------------------------------------------------------------------------------------------

    @initialize(everybody=st.sampled_from((True, True, False)))
    def the_hub_is_here(self, everybody: bool) -> None:
        self.tell(channels.HELLO, VHUB, Hello("vhub", VHUB, "b0", limits.PROTOCOL_VERSION, "", PRINT))
        self.tell(channels.READY, VHUB, Ready(VHUB, "b0", self.core.state.frame.layout.digest, PRINT, bytes(32)))
        for node in NODES if everybody else ():
            self.come(node)

    @rule(node=st.sampled_from(NODES))
    def come(self, node: str) -> None:
        """A process starts, says hello and builds the world."""
        self.hello(node, again=False)
        self.ready(node, of_another=False)

    @rule(node=st.sampled_from(NODES), again=st.booleans())
    def hello(self, node: str, again: bool) -> None:
        """A process says hello: the one that is there again, or another one of that name."""
        is_new = not again or self.boots[node] == 0
        boot = self.boots[node] + is_new
        self.tell(channels.HELLO, node, Hello("node", node, f"b{boot}", limits.PROTOCOL_VERSION, "", PRINT))
        if node not in self.stopped and (self.state[node] in (ABSENT, LOST)):
            self.boots[node], self.state[node], self.built[node] = boot, KNOWN, False

    @rule(node=st.sampled_from(NODES), of_another=st.booleans())
    def ready(self, node: str, of_another: bool) -> None:
        boot = "other" if of_another else f"b{self.boots[node]}"
        self.tell(channels.READY, node, Ready(node, boot, self.core.state.frame.layout.digest, PRINT, bytes(32)))
        if of_another or self.state[node] not in (KNOWN, MEMBER):
            return
        self.built[node] = True
        if self.opened and self.state[node] == KNOWN:
            self.enter(node)
        self.begin_if_all_are_here()

    @rule(node=st.sampled_from(NODES))
    def gone(self, node: str) -> None:
        self.now_ns += 1
        self.core.connection_closed(node, self.now_ns)
        self.hear()
        if self.state[node] in (KNOWN, MEMBER):
            self.depart(node)

    @rule(node=st.sampled_from(NODES))
    def heartbeat(self, node: str) -> None:
        """The last that was lost goes on by itself; others have to say hello."""
        self.tell(channels.HEARTBEAT, node, Heartbeat(node, 0, self.core.state.epoch, "", "", 0.0, b"{}"))
        is_alone = self.opened > 0 and self.state[node] == LOST and not self.members
        if is_alone and self.built[node] and node not in self.stopped:
            self.enter(node)

    @rule(robot=st.integers(0, 8), node=st.sampled_from(NODES))
    def move(self, robot: int, node: str) -> None:
        name = sorted(self.owner)[robot]
        accepted = self.ask("move", robot=name, node=node)
        assert accepted == (self.opened > 0 and node in self.members)
        if accepted:
            self.home[name] = node
            self.opened += self.owner[name] != node
            self.owner[name] = node

    @rule(node=st.sampled_from(NODES))
    def stop(self, node: str) -> None:
        accepted = self.ask("stop", node=node)
        assert accepted == (self.opened > 0 and (node in self.stopped or self.members != [node]))
        if accepted and node not in self.stopped:
            self.stopped.add(node)
            if self.state[node] != ABSENT:
                self.depart(node)

    @rule(node=st.sampled_from(NODES))
    def start(self, node: str) -> None:
        if self.ask("start", node=node):
            self.stopped.discard(node)

    @precondition(lambda self: self.opened > 0)
    @rule(node=st.sampled_from(NODES), behind=st.integers(0, 3))
    def a_part_of_who_is_not_in_the_epoch(self, node: str, behind: int) -> None:
        """A zombie's work is not taken, whatever epoch it names."""
        if node in self.members and behind == 0:
            return
        before = self.core.state.missing_nodes
        self.tell(
            channels.PART, node, Part(max(0, self.core.state.epoch - behind), 1, node, bytes(32), [], b"", b"", [])
        )
        assert self.core.state.missing_nodes == before
        self.refused = self.core.refused

    # --- what always holds -------------------------------------------------------------------------------------------

    @invariant()
    def the_epoch_says_what_the_model_says(self) -> None:
        assert self.core.state.epoch == self.opened and [epoch.epoch for epoch in self.epochs] == [
            *range(1, self.opened + 1)
        ]
        assert self.core.state.end is None
        if self.opened:
            assert sorted(self.core.state.members) == self.members
            assert self.core.state.owners == self.owner
        if self.members:
            epoch = self.epochs[-1]
            assert sorted(epoch.roster) == self.members and dict(epoch.owners) == self.owner
            assert set(self.owner.values()) <= set(self.members), "every robot has one owner, who takes part"
            assert (epoch.tick, epoch.digest) == (self.core.state.frame.tick, self.core.state.frame.digest)

    @invariant()
    def one_name_is_one_process(self) -> None:
        for node in NODES:
            process = self.core.state.roster.by_name.get(node)
            assert (process is None) == (self.state[node] == ABSENT)
            if process is not None:
                assert process.lost == (self.state[node] == LOST) and process.boot == f"b{self.boots[node]}"
        assert self.core.refused == self.refused and SUPERVISOR not in self.core.state.roster.by_name


TestMembership = Membership.TestCase
TestMembership.settings = settings(max_examples=60, stateful_step_count=40)
