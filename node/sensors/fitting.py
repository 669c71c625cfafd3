"""Where a sensor sits, and what its noise is keyed by. Neighbours: the sensors, which are made with it."""

from __future__ import annotations

from dataclasses import dataclass

from foosim.protocol.layout import Entity, Layout
from foosim.protocol.world_spec import WorldSpec


@dataclass(frozen=True, slots=True)
class Fitting:
    """A robot of a deployment and layout, and the key of the draws of one of its channels."""

    spec: WorldSpec
    layout: Layout
    robot: Entity
    key: bytes
