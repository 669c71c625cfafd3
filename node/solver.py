"""The engines of a node: one for each layout that is wanted, and the solving of a tick's work with the right one.

Shared by the node's process and the rehearsal. Neighbours: `core` hands out work, `engines` has the engines.
"""

from __future__ import annotations

from hashlib import blake2b

import numpy as np

from foosim.node.core import NodeCore
from foosim.node.engines import ENGINES
from foosim.node.engines.interface import Engine, EngineFactory
from foosim.node.step import Stepper, Work
from foosim.protocol.deployment import Deployment
from foosim.protocol.layout import Layout
from foosim.protocol.start import initial_numbers

FINGERPRINT_TICKS = 32


class Solver:
    """Builds what a node's core wants and solves its work."""

    def __init__(self, core: NodeCore, factory: EngineFactory | None = None) -> None:
        """`factory` overrides the deployment's engine."""
        self._core = core
        self._factory = factory
        self._engines: dict[bytes, Engine] = {}
        self._fingerprint = b""

    def build_wanted(self) -> None:
        """Build an engine for every layout that is wanted and has none; the first one gives the fingerprint."""
        for layout in self._core.layouts_wanted:
            if layout.digest not in self._engines:
                engine = self._engines[layout.digest] = self._make(layout)
                if not self._fingerprint:
                    self._fingerprint = engine_fingerprint(engine, self._core.stepper(layout))
                self._core.engine_ready(layout, self._fingerprint)

    def rebuild(self) -> None:
        """Replace every engine by a new one: nothing that matters is lost."""
        for layout in self._core.layouts_wanted:
            old = self._engines.pop(layout.digest, None)
            if old is not None:
                old.close()
                self._engines[layout.digest] = self._make(layout)

    def solve(self, work: Work) -> None:
        """Solve a tick's work and give it back to the core."""
        self._core.stepper(work.layout).solve(self._engines[work.layout.digest], work)
        self._core.solved(work)

    def close(self) -> None:
        for engine in self._engines.values():
            engine.close()
        self._engines.clear()

    def _make(self, layout: Layout) -> Engine:
        deployment = self._core.deployment
        assert deployment is not None
        return (self._factory or ENGINES[deployment.engine])(deployment, layout)


def engine_fingerprint(engine: Engine, stepper: Stepper) -> bytes:
    """Return the digest of a fixed small run: a kicked ball among turning rods, 32 ticks."""
    deployment: Deployment = stepper.deployment
    layout = stepper.layout
    numbers = initial_numbers(deployment, layout)
    ball = layout["ball"].offsets["linear_velocity"]
    numbers[ball : ball + 3] = [1.0, 0.3, 0.0]
    for rod in layout.rods:
        numbers[rod.offsets["wanted"] + 1] = 1.0
    bodies = tuple(entity for entity in layout.entities if entity.has_body)
    for tick in range(FINGERPRINT_TICKS):
        work = Work(tick, layout, (bodies,), tuple(entity.index for entity in bodies), numbers, {})
        stepper.solve(engine, work)
    return blake2b(np.array(numbers).tobytes(), digest_size=32).digest()
