"""The engine of a deployment, by its name in the registry. Its implementation is imported when it is built."""

from __future__ import annotations

from collections.abc import Sequence

from foosim.common.errors import Failed
from foosim.deployment.schema import Deployment
from foosim.node.physics.interface import AnyEngine
from foosim.world.component_types import registry
from foosim.world.layout import Entity, Layout


class NoEngine:
    """The engine of a layout without rigid bodies."""

    def load(self, entities: Sequence[Entity], state: Sequence[float]) -> None:
        """Nothing is loaded."""
        assert not entities, entities

    def command(self, entities: Sequence[Entity], commands: Sequence[Sequence[tuple[float, ...]]]) -> None:
        """There are no motors."""

    def step(self, substeps: int) -> None:
        """Nothing moves."""

    def read(self, entities: Sequence[Entity], state: list[float]) -> None:
        """Nothing has moved."""

    def close(self) -> None:
        """It holds nothing."""


def has_rigid(layout: Layout) -> bool:
    """Whether a layout has bodies for an engine."""
    return any(entity.is_rigid for entity in layout.entities)


def engine_of(deployment: Deployment, layout: Layout) -> AnyEngine:
    """Return the engine that a deployment names, built at once. Raises Failed for one that this machine lacks."""
    if lack := deployment.engine_type.lack:
        raise Failed(f"{lack}: {deployment.engine_type.instead}")
    engine: AnyEngine = registry.class_at(deployment.engine_type.path)(deployment, layout)
    return engine


def make_engine(deployment: Deployment, layout: Layout) -> AnyEngine:
    """Return the engine of a layout's rigid bodies, built at once."""
    if not has_rigid(layout):
        return NoEngine()
    return engine_of(deployment, layout)
