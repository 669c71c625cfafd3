"""Re-simulation of a world from orders and deliveries alone, on any number of nodes; used by `verify`.

The nodes have the cores, parts and engines of a run; messages from the capture replace the supervisor and the vHub.
"""

from __future__ import annotations

from collections.abc import Sequence

from foosim.deployment.schema import Deployment
from foosim.node.core import NodeCore
from foosim.node.engines_pool import Solver
from foosim.node.physics.interface import EngineFactory
from foosim.protocol import channels
from foosim.protocol.actions import Publish
from foosim.protocol.asset_transfer import piece_of
from foosim.protocol.codec import encode
from foosim.protocol.fingerprint import library_fingerprint
from foosim.protocol.messages import Build, Commit, Deliveries, Epoch, Order
from foosim.runtime.roles.bus import Bus
from foosim.world.assembly.initial_state import first_frame
from foosim.world.edits import Edit
from foosim.world.frame import Frame
from foosim.world.robot_packets import Delivered, RobotPacket
from foosim.world.start import Start

SOURCE = "capture"


class Replica:
    """Nodes of a deployment, advanced tick by tick. `frame` is the present frame."""

    def __init__(
        self,
        text: str,
        name: str,
        deployment: Deployment,
        factory: EngineFactory | None = None,
        start: Start | None = None,
    ) -> None:
        self.frame: Frame = first_frame(deployment, start)
        self._deployment = deployment
        self._bus = Bus()
        self._nodes: dict[str, tuple[NodeCore, Solver]] = {}
        for node in sorted(deployment.nodes):
            core = NodeCore(node, "boot", library_fingerprint(), 0)
            self._nodes[node] = core, Solver(core, factory)
            self._bus.subscribe(node, channels.NODE_READS)
        self._bus.subscribe(SOURCE, ((channels.FETCH, False),))
        for node in self._nodes:
            origin = None if start is None else start.origin
            build = Build(node, "boot", "first", SOURCE, name, text, "fast", origin)
            self._publish(channels.BUILD, node, encode(build))
        self._settle()
        self._epoch = 0
        self._begin(self.frame)

    def _begin(self, frame: Frame) -> None:
        """Continue from a frame, in a new epoch."""
        self.frame = frame
        self._epoch += 1
        who = sorted(self._nodes), sorted(self._deployment.owners().items()), b""
        self._publish(channels.EPOCH, SOURCE, encode(Epoch(self._epoch, frame.tick, frame.digest, *who)))
        commit = Commit(
            self._epoch, frame.tick, frame.digest, frame.values.tobytes(), frame.outbox_items, [], last=False
        )
        for node in self._nodes:
            self._publish(channels.COMMIT, node, encode(commit))
        self._settle()

    def set_back(self, frame: Frame) -> None:
        """Continue from another frame of the same run. The nodes' records of its ticks stay valid."""
        self._begin(frame)

    @property
    def arithmetic(self) -> bytes:
        """The digest of the fixed small run of this machine's engine: captures with another one may differ."""
        core, _ = next(iter(self._nodes.values()))
        return core.member.simulation

    def step(self, edits: Sequence[Edit], delivered: Sequence[Delivered]) -> Frame:
        """Compute the next frame from this tick's order and deliveries."""
        tick = self.frame.tick
        self._publish(channels.ORDER, SOURCE, encode(Order(self._epoch, tick, list(edits))))
        self._publish(channels.DELIVERIES, SOURCE, encode(Deliveries(tick, list(delivered))))
        self._settle()
        core, _ = next(iter(self._nodes.values()))
        assert core.frame is not None and core.frame.tick == tick + 1, "every node has its inputs"
        self.frame = core.frame
        return self.frame

    def sense(self) -> list[RobotPacket]:
        """Return the packets that all robots send at the frame, in (robot, index) order."""
        core, _ = next(iter(self._nodes.values()))
        packets, _ = core.stepper.sense(self.frame, self.frame.layout.robots)
        return packets

    def rebuild_engines(self) -> None:
        """Replace all engines with new ones."""
        for _, solver in self._nodes.values():
            solver.rebuild()

    def close(self) -> None:
        for _, solver in self._nodes.values():
            solver.close()

    def _publish(self, channel: channels.Channel, name: str, payload: bytes) -> None:
        self._bus.put(SOURCE, channel, name, payload, 0)

    def _settle(self) -> None:
        """Run the nodes in turn until none has a message to send."""
        while not self._bus.is_empty:
            _, _, receiver, channel, name, payload = self._bus.pop()
            if receiver == SOURCE:
                piece = piece_of(self._deployment, channels.read(channel, name, payload))
                self._publish(channels.PIECE, piece.name, encode(piece))
                continue
            core, solver = self._nodes[receiver]
            core.receive(channel, name, payload, 0)
            core.wake(0)
            solver.build()
            core.advance(0)
            while core.work is not None:
                solver.solve(core.work)
                core.advance(0)
            for action in core.actions:
                if isinstance(action, Publish):
                    self._bus.put(receiver, action.channel, action.name, action.payload, 0)
            core.actions.clear()
