"""The pure engine, in Python alone."""

from __future__ import annotations

from collections.abc import Generator
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

    def in_steps(self, deployment: Deployment, layout: Layout) -> Generator[None, None, Engine]:
        """Build an engine in one step, which is short."""
        yield
        return self.make(deployment, layout)

    def prepare_spares(self, count: int) -> None:
        """Nothing that it needs takes long."""
