"""One world, computed tick by tick in this process: the steps of nodes, without their messages.

It is what `Simulation` steps, and what verify, what-if and the console compute a capture's frames with. It has the
components, islands and engines of nodes, so equal inputs give the digests of a run.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Final, TypeAlias

import numpy as np

from foosim.deployment.schema import Deployment
from foosim.node.engines_pool import engine_fingerprint
from foosim.node.physics.interface import AnyEngine
from foosim.node.physics.making import make_engine
from foosim.node.tick import Stepper, Term, Work
from foosim.world.edits import Edit
from foosim.world.frame import Frame
from foosim.world.layout import Layout
from foosim.world.robot_packets import Delivered, RobotPacket

MakeEngine: TypeAlias = Callable[[Deployment, Layout], AnyEngine]
ONE_NODE: Final = "n1"


def deal_robots(deployment: Deployment, nodes: int) -> dict[str, list[str]]:
    """Return the robots of n1 to nN, dealt in turn: first rigid ones, then others, each in name order."""
    rigid = sorted(name for name, robot in deployment.robots.items() if robot.component_type.is_rigid)
    others = sorted(set(deployment.robots) - set(rigid))
    dealt: dict[str, list[str]] = {f"n{number + 1}": [] for number in range(nodes)}
    for place, name in enumerate([*rigid, *others]):
        dealt[f"n{place % nodes + 1}"].append(name)
    return dealt


class SteppedWorld:
    """A world at a frame. `sense` and `step` by turns lead from frame to frame."""

    def __init__(
        self,
        deployment: Deployment,
        frame: Frame,
        robots: Mapping[str, Sequence[str]] | None = None,
        make: MakeEngine = make_engine,
    ) -> None:
        """`robots` are each node's, by default all of one; `make` makes the engine of each node."""
        nodes = robots or {ONE_NODE: list(deployment.robots)}
        self._roster = sorted(nodes)
        self._owners = {robot: node for node, its in nodes.items() for robot in its}
        self._engines = [make(deployment, frame.layout) for _ in nodes]
        self.begin(deployment, frame)

    def begin(self, deployment: Deployment, frame: Frame) -> None:
        """Continue from a frame, in the same deployment or one that differs in its seed."""
        steppers = [Stepper(deployment, frame.layout) for _ in self._roster]
        self._terms = [
            Term(stepper, node, self._roster, self._owners)
            for stepper, node in zip(steppers, self._roster, strict=True)
        ]
        self.go_to(frame)

    def go_to(self, frame: Frame) -> None:
        """Continue from another frame of the same deployment."""
        self.frame = frame
        self._remembered: list[dict[int, float]] | None = None
        """What each node's sensors remember of the frame: numbers of the next one, by place. None: not sensed yet."""

    def sense(self) -> list[RobotPacket]:
        """Return what the robots send at the frame, in (robot, index) order. Raises ComponentError."""
        frame = self.frame
        self._remembered = [{} for _ in self._terms]
        if self._terms[0].stepper.sampling.is_silent(frame):
            return []
        packets: list[RobotPacket] = []
        for place, term in enumerate(self._terms):
            sent, self._remembered[place] = term.stepper.sense(frame, term.mine)
            packets += sent
        if len(self._terms) > 1:
            packets.sort(key=lambda packet: (packet.robot, packet.index))
        return packets

    def step(self, delivered: Sequence[Delivered], edits: Sequence[Edit] = ()) -> Frame:
        """Compute the next frame from the robots' packets and the edits at this one, in order.

        Raises ComponentError.
        """
        if self._remembered is None:
            self.sense()
        assert self._remembered is not None
        works: list[Work] = []
        for term, engine, sensed in zip(self._terms, self._engines, self._remembered, strict=True):
            work, remembered = term.work(self.frame, edits, delivered, sensed)
            term.stepper.solve(engine, work)
            for place, number in remembered.items():
                work.numbers[place] = number
            works.append(work)
        self.go_to(self._joined(works))
        return self.frame

    def _joined(self, works: Sequence[Work]) -> Frame:
        """Return the next frame, of which each node has solved its share and written its robots' slots."""
        tick, layout = self.frame.tick + 1, self.frame.layout
        if len(works) == 1:
            return Frame(tick, layout, None, works[0].outboxes, numbers=works[0].numbers)
        slots = self._terms[0].slots
        values = np.empty(layout.size)
        slots.whole(tuple((node, work.solved) for node, work in zip(self._roster, works, strict=True)))  # each once
        for node, work in zip(self._roster, works, strict=True):
            numbers = np.array(work.numbers)
            for places in (slots.solver(work.solved), slots.owner(node)):
                values[places] = numbers[places]
        return Frame(tick, layout, values, {index: box for work in works for index, box in work.outboxes.items()})

    @property
    def quarantined(self) -> list[str]:
        """Who came into quarantine, and why, in words."""
        return [line for term in self._terms for line in term.stepper.quarantined]

    def arithmetic(self) -> bytes:
        """Return the digest of the fixed small run of this machine's engine: captures with another one may differ."""
        return engine_fingerprint(self._engines[0], self._terms[0].stepper)

    def close(self) -> None:
        """Free the engines."""
        for engine in self._engines:
            engine.close()
        self._engines = []
