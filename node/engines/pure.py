"""The pure engine, in Python alone."""

from __future__ import annotations

from typing import TYPE_CHECKING

from foosim.world.forms.registry import engine

if TYPE_CHECKING:
    from foosim.deployment.schema import Deployment
    from foosim.node.physics.interface import Engine
    from foosim.world.layout import Layout


@engine("pure", meshes=False)
class Pure:
    """Spheres and shafts in plain Python, with scenery of boxes and cylinders: quick, for tests."""

    def make(self, deployment: Deployment, layout: Layout) -> Engine:
        """Return an engine, built at once."""
        from foosim.node.physics.pure_engine import PureEngine

        return PureEngine(deployment, layout)
