"""One world, computed tick by tick in this process: the steps of a node, without its messages.

It has the forms, islands and engine of a node that owns every robot, so equal commands give the digests of a run.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from foosim.deployment.schema import Deployment
from foosim.node.physics.interface import AnyEngine
from foosim.node.physics.making import make_engine
from foosim.node.tick import Stepper, Work
from foosim.world.assembly.islands import Assignment, Share, reach_of
from foosim.world.edits import Edit
from foosim.world.frame import Frame
from foosim.world.layout import Entity, Layout
from foosim.world.robot_packets import Delivered, RobotPacket

NODE: Final = "n1"
"""The only node."""
Groups = tuple[tuple[Entity, ...], ...]


class SteppedWorld:
    """A world at a frame. `sense` and `step` by turns lead from frame to frame."""

    def __init__(self, deployment: Deployment, frame: Frame) -> None:
        self._engine: AnyEngine | None = None
        self._remembered: dict[int, float] = {}
        """What sensors remember of the frame: numbers of the next one, by place."""
        self._share: Share | None = None
        self._members: tuple[Groups, Groups] = ((), ())
        self._deployment, self.frame = deployment, frame
        self._stepper, self._assignment = self._made(deployment, frame.layout)

    def begin(self, deployment: Deployment, frame: Frame) -> None:
        """Go on from a frame, in the same deployment or one that differs in its seed."""
        self._deployment, self.frame = deployment, frame
        self._remembered, self._share = {}, None
        self._stepper, self._assignment = self._made(deployment, frame.layout)

    def _made(self, deployment: Deployment, layout: Layout) -> tuple[Stepper, Assignment]:
        if self._engine is None:
            self._engine = make_engine(deployment, layout)
        owners = {robot.name: NODE for robot in layout.robots}
        assignment = Assignment(layout, reach_of(deployment, layout), (NODE,), owners)
        return Stepper(deployment, layout), assignment

    def sense(self) -> list[RobotPacket]:
        """Return what the robots send at the frame, in (robot, index) order. Raises ComponentError."""
        frame, stepper = self.frame, self._stepper
        if stepper.sampling.is_silent(frame):
            self._remembered = {}
            return []
        packets, self._remembered = stepper.sense(frame, frame.layout.robots)
        return packets

    def step(self, delivered: Sequence[Delivered], edits: Sequence[Edit] = ()) -> Frame:
        """Compute the next frame from what reaches the robots at this one, in order, and what is edited before.

        Raises ComponentError.

        `sense` comes before: what the sensors remember is in the next frame.
        """
        frame, stepper = self.frame, self._stepper
        tick = frame.tick
        layout = frame.layout
        numbers, self._remembered = stepper.edited(frame, edits, self._remembered)
        share = self._assignment.shares(numbers)[NODE]
        start = numbers.copy() if delivered or stepper.waits else numbers
        outboxes = stepper.deliver(delivered, share.solved, numbers, tick, start)
        islands, movers = self._groups(share, layout)
        work = Work(tick, layout, islands, share.solved, numbers, outboxes, [] if start is numbers else start, movers)
        assert self._engine is not None, "closed"
        stepper.solve(self._engine, work)
        for place, number in self._remembered.items():
            numbers[place] = number
        self.frame = Frame(tick + 1, layout, None, outboxes, numbers=numbers)
        return self.frame

    def _groups(self, share: Share, layout: Layout) -> tuple[Groups, Groups]:
        """Return the entities of a share's islands, and those in the way of each; a share is often that of before."""
        if share is not self._share:
            entities = layout.entities
            islands, movers = (
                tuple([tuple([entities[index] for index in group]) for group in groups])
                for groups in (share.islands, share.movers)
            )
            self._share, self._members = share, (islands, movers)
        return self._members

    @property
    def quarantined(self) -> list[str]:
        """Who came into quarantine, and why, in words."""
        return self._stepper.quarantined

    def close(self) -> None:
        """Free the engine."""
        if self._engine is not None:
            self._engine.close()
            self._engine = None
