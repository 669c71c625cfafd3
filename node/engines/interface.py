"""The interface of a physics engine to a node: load, command, step, read.

An engine holds the bodies of one layout and the scenery, and remembers nothing that matters: every tick starts with a
complete load of what is solved, from the frame. What is not loaded is parked, out of everybody's way. A change of
layout builds another engine.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

from foosim.deployment.schema import Deployment
from foosim.world.layout import Entity, Layout


class Engine(Protocol):
    """One physics engine with the bodies of `layout`. `state` is always the whole frame's numbers, in layout order."""

    def load(self, entities: Sequence[Entity], state: Sequence[float]) -> None:
        """Wipe what the engine remembers and set these bodies (those with a body) to their state; park all others."""

    def command(self, entities: Sequence[Entity], commands: Sequence[Sequence[tuple[float, float]]]) -> None:
        """Set the motors of these robots: for each joint the target speed and the greatest force (SI units)."""

    def step(self, substeps: int) -> None:
        """Advance the loaded bodies by `substeps` substeps and log their contacts."""

    def read(self, entities: Sequence[Entity], state: list[float]) -> None:
        """Write position, velocity and the tick's contact log of these bodies into `state`."""

    def close(self) -> None:
        """Free what the engine holds. It is not used afterwards."""


EngineFactory = Callable[[Deployment, Layout], Engine]
