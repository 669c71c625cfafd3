"""The engines of a node: one for each layout that is wanted, and the solving of a tick's work with the right one.

Shared by the node's process and the rehearsal.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from hashlib import blake2b
from typing import Final

import numpy as np

from foosim.deployment.schema import Deployment
from foosim.node.core import NodeCore
from foosim.node.physics.interface import AnyEngine
from foosim.node.physics.making import build_in_steps, make_engine, prepare_spares
from foosim.node.tick import Stepper, Work
from foosim.world.assembly.world import initial_numbers
from foosim.world.components.view import ComponentError
from foosim.world.layout import Layout, build_layout
from foosim.world.matter.mesh import Mesh

FINGERPRINT_TICKS: Final = 32
ENGINES_KEPT: Final = 3
"""The layout of the tick, the one before (an epoch may go back to it), and the next one."""


class Solver:
    """Builds the engines that a node's core needs, and solves its work. The last used engines are kept."""

    def __init__(
        self, core: NodeCore, factory: Callable[[Deployment, Layout], AnyEngine] | None = None, fingerprint: bytes = b""
    ) -> None:
        """`factory` overrides the deployment's engine; `fingerprint` is that of another solver of this process."""
        self._core = core
        self._factory = factory
        self._engines: dict[bytes, AnyEngine] = {}
        """By layout, the one that was used last at the end."""
        self._told = 0
        """The number of the core's layouts whose engine has been reported."""
        self._building: tuple[Layout, Generator[None, None, AnyEngine]] | None = None
        self.fingerprint = fingerprint
        """The digest of the fixed small run, empty before the first engine is built."""

    # --- building ----------------------------------------------------------------------------------------------------

    def build_wanted(self) -> None:
        """Build an engine for every layout that is wanted and has none; the first one gives the fingerprint."""
        while self.build_some():
            continue

    def build_some(self) -> bool:
        """Do one step of building a needed engine; False when there is nothing to build."""
        if self._building is None:
            wanted = self._core.layouts_wanted
            if self._told == len(wanted):
                return False
            while len(self._engines) >= ENGINES_KEPT:
                self._engines.pop(next(iter(self._engines))).close()
            self._building = wanted[self._told], self._steps(wanted[self._told])
        layout, steps = self._building
        try:
            next(steps)
        except StopIteration as end:
            self._building = None
            self._take(layout, end.value)
        except ComponentError as error:
            self._building = None
            self._told += 1
            self._core.fail(error)
        return True

    @property
    def is_building(self) -> bool:
        return self._building is not None

    def _steps(self, layout: Layout) -> Generator[None, None, AnyEngine]:
        deployment = self._core.deployment
        assert deployment is not None
        if self._factory is not None:
            yield
            return self._factory(deployment, layout)
        if not self.fingerprint:
            prepare_spares(deployment, layout)
        return (yield from build_in_steps(deployment, layout))

    def _take(self, layout: Layout, engine: AnyEngine) -> None:
        """Keep a new engine and report it to the core."""
        self._engines[layout.digest] = engine
        self._told += 1
        try:
            stepper = self._core.stepper(layout)
            if not self.fingerprint:
                self.fingerprint = engine_fingerprint(engine, stepper)
        except ComponentError as error:
            self._core.fail(error)
            return
        self._core.engine_ready(layout, self.fingerprint)

    def rebuild(self) -> None:
        """Replace every engine, and all that computes beside it, by new ones: nothing that matters is lost."""
        try:
            self._core.make_anew()
            for layout in self._core.layouts_wanted:
                old = self._engines.pop(layout.digest, None)
                if old is not None:
                    old.close()
                    self._engines[layout.digest] = self._make(layout)
        except ComponentError as error:
            self._core.fail(error)

    def _make(self, layout: Layout) -> AnyEngine:
        """Build an engine at once."""
        deployment = self._core.deployment
        assert deployment is not None
        return (self._factory or make_engine)(deployment, layout)

    # --- solving -----------------------------------------------------------------------------------------------------

    def engine_for(self, layout: Layout) -> AnyEngine:
        """Return the engine of a layout; one that went, or never came, is built at once."""
        engine = self._engines.pop(layout.digest, None) or self._make(layout)
        self._engines[layout.digest] = engine
        return engine

    def solve(self, work: Work) -> None:
        """Solve a tick's work and give it back to the core."""
        try:
            engine = self.engine_for(work.layout)
            self._core.stepper(work.layout).solve(engine, work)
        except ComponentError as error:
            self._core.fail(error)
        else:
            self._core.solved(work)

    def close(self) -> None:
        for engine in self._engines.values():
            engine.close()
        self._engines.clear()


def engine_fingerprint(engine: AnyEngine, stepper: Stepper) -> bytes:
    """Return the digest of a fixed small run: the stirred world, 32 ticks.

    It is the same for every layout: what was added to the deployment's world stays parked. The meshes of the scenery,
    as they were read here, are part of it, and the version of an engine that has one.
    """
    deployment: Deployment = stepper.deployment
    layout = stepper.layout
    numbers = initial_numbers(deployment, layout)
    stepper.world.stir(numbers)
    base = build_layout(deployment)
    declared = [entity for entity in layout.entities if entity.name in base]
    bodies = tuple(entity for entity in declared if entity.is_solved)
    for tick in range(FINGERPRINT_TICKS):
        work = Work(tick, layout, (bodies,), tuple(entity.index for entity in bodies), numbers, {})
        stepper.solve(engine, work)
    stepper.quarantined.clear()  # of a run that is none
    content = [number for entity in declared for number in numbers[entity.start : entity.stop]]
    meshes = [shape.geometry.digest for shape in deployment.scenery_shapes() if isinstance(shape.geometry, Mesh)]
    version = getattr(engine, "version", "").encode()
    return blake2b(np.array(content).tobytes() + b"".join(meshes) + version, digest_size=32).digest()
