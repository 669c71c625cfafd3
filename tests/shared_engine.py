"""The engine of a layout whose bodies do not couple, as what it is: all that it solves in a tick share a solve."""

from __future__ import annotations

from foosim.deployment.schema import Deployment
from foosim.node.physics.interface import Engine, IslandEngine
from foosim.node.physics.making import make_engine
from foosim.world.layout import Layout


def make_shared_engine(deployment: Deployment, layout: Layout) -> Engine:
    """Make one, built at once."""
    made = make_engine(deployment, layout)
    assert not isinstance(made, IslandEngine), layout.names
    return made
