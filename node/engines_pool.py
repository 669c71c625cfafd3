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
from foosim.world.assembly.world import build_scene, initial_numbers
from foosim.world.components.view import ComponentError
from foosim.world.layout import Layout
from foosim.world.matter.mesh import Mesh
from foosim.world.scene import Hull

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
        self.meshes = b""
        """The digest of the meshes that were read and of the hulls around them."""

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
            self.meshes = self.meshes or blake2b(meshes_read(core.stepper), digest_size=32).digest()
        except ComponentError as error:
            core.fail(error)
        else:
            core.member.meshes = self.meshes
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

    The meshes and hulls, as they were read here, are part of it, and the version of an engine that has one.
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
    version = getattr(engine, "version", "").encode()
    return blake2b(np.array(numbers).tobytes() + meshes_read(stepper) + version, digest_size=32).digest()


def meshes_read(stepper: Stepper) -> bytes:
    """Return the digests of the scenery's meshes, as they were read here, and of the hulls of bodies around theirs."""
    scene = build_scene(stepper.deployment, stepper.layout)
    links = [link for body in scene.bodies.values() for link in body.links]
    shapes = [shape.geometry for shape in (*scene.scenery, *[shape for link in links for shape in link.shapes])]
    found = [shape.mesh if isinstance(shape, Hull) else shape for shape in shapes if isinstance(shape, Hull | Mesh)]
    return b"".join([mesh.digest for mesh in found])
