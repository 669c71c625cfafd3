"""The engine of a node, and the solving of a tick's work.

Shared by the node's process and the rehearsal.
"""

from __future__ import annotations

from collections.abc import Callable
from hashlib import blake2b
from typing import Final

import numpy as np

from foosim.deployment.schema import Deployment
from foosim.node.core import NodeCore
from foosim.node.physics.interface import AnyEngine
from foosim.node.physics.making import make_engine
from foosim.node.tick import Stepper, Work
from foosim.world.assembly.world import initial_numbers
from foosim.world.components.view import ComponentError
from foosim.world.layout import Layout
from foosim.world.matter.mesh import Mesh

FINGERPRINT_TICKS: Final = 32


class Solver:
    """Builds the engine that a node's core needs, and solves its work."""

    def __init__(self, core: NodeCore, factory: Callable[[Deployment, Layout], AnyEngine] | None = None) -> None:
        """`factory` overrides the deployment's engine."""
        self._core = core
        self._factory = factory
        self._engine: AnyEngine | None = None
        self.fingerprint = b""
        """The digest of the fixed small run, empty before the engine is built, or a preset one."""

    # --- building ----------------------------------------------------------------------------------------------------

    def build(self) -> None:
        """Build the engine if it is wanted and not there, and report it to the core; it returns the fingerprint."""
        core = self._core
        if self._engine is not None or core.layout is None or core.failure:
            return
        try:
            engine = self._engine = self._make()
            if not self.fingerprint:
                self.fingerprint = engine_fingerprint(engine, core.stepper)
        except ComponentError as error:
            core.fail(error)
        else:
            core.engine_ready(self.fingerprint)

    def rebuild(self) -> None:
        """Replace the engine, and all that computes beside it, by new ones: they keep no state."""
        self.close()
        try:
            self._core.make_anew()
            self._engine = self._make()
        except ComponentError as error:
            self._core.fail(error)

    def _make(self) -> AnyEngine:
        deployment, layout = self._core.deployment, self._core.layout
        assert deployment is not None and layout is not None
        return (self._factory or make_engine)(deployment, layout)

    # --- solving -----------------------------------------------------------------------------------------------------

    def solve(self, work: Work) -> None:
        """Solve a tick's work and return it to the core."""
        try:
            assert self._engine is not None
            self._core.stepper.solve(self._engine, work)
        except ComponentError as error:
            self._core.fail(error)
        else:
            self._core.solved(work)

    def close(self) -> None:
        if self._engine is not None:
            self._engine.close()
            self._engine = None


def engine_fingerprint(engine: AnyEngine, stepper: Stepper) -> bytes:
    """Return the digest of a fixed small run: the excited world without its spares, 32 ticks.

    The meshes of the scenery, as they were read here, are part of it, and the version of an engine that has one.
    """
    deployment: Deployment = stepper.deployment
    layout = stepper.layout
    numbers = initial_numbers(deployment, layout)
    stepper.world.excite(numbers)
    bodies = tuple(entity for entity in layout.present(numbers) if entity.is_solved)
    for tick in range(FINGERPRINT_TICKS):
        work = Work(tick, layout, (bodies,), tuple(entity.index for entity in bodies), numbers, {})
        stepper.solve(engine, work)
    stepper.quarantined.clear()  # of no run
    meshes = [shape.geometry.digest for shape in deployment.scenery_shapes() if isinstance(shape.geometry, Mesh)]
    version = getattr(engine, "version", "").encode()
    return blake2b(np.array(numbers).tobytes() + b"".join(meshes) + version, digest_size=32).digest()
