"""What differs between kinds of world in the tick of a node, and the one place where it is chosen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

from foosim.world.components.fitted import FittedActuator
from foosim.world.layout import Entity, Layout
from foosim.world.scenes.hall_world import HallWorld
from foosim.world.scenes.table_world import TableWorld
from foosim.world.spec import WorldSpec


class World(Protocol):
    """One kind of world, for one deployment and layout."""

    @property
    def actuators(self) -> Mapping[int, tuple[FittedActuator, ...]]:
        """What moves each robot that has actuators, by the entity's index."""

    def apply_rules(self, numbers: list[float], layout: Layout) -> None:
        """Edit a frame's numbers by the rules of the world, with all their memory in the frame."""

    def plausible(self, entity: Entity, numbers: Sequence[float], before: Sequence[float]) -> bool:
        """Whether an entity's new, finite state is in the world, within its speed limit and its reach."""

    def stir(self, numbers: list[float]) -> None:
        """Set a world at rest in motion, for the fixed small run that tells engines apart."""


def world_of(spec: WorldSpec, layout: Layout) -> World:
    """Return the deployment's kind of world."""
    return HallWorld(spec, layout) if spec.is_hall else TableWorld(spec, layout)
