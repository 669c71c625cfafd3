"""Where a sensor sits, and what its noise is keyed by."""

from __future__ import annotations

from dataclasses import dataclass

from foosim.world.layout import Entity, Layout
from foosim.world.spec import WorldSpec


@dataclass(frozen=True, slots=True)
class Fitting:
    """A robot of a deployment and layout, and the key of the draws of one of its channels."""

    spec: WorldSpec
    layout: Layout
    robot: Entity
    key: bytes
