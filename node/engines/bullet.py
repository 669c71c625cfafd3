"""Bullet, through pybullet."""

from __future__ import annotations

from typing import TYPE_CHECKING

from foosim.world.forms.registry import engine

if TYPE_CHECKING:
    from foosim.deployment.schema import Deployment
    from foosim.node.physics.interface import AnyEngine
    from foosim.world.layout import Layout


@engine("bullet", meshes=True)
class Bullet:
    """Bodies whose joints do not couple, by the Bullet library, with scenery of any shape."""

    def make(self, deployment: Deployment, layout: Layout) -> AnyEngine:
        """Return an engine, built at once."""
        from foosim.node.physics.bullet_engine import BulletEngine

        return BulletEngine(deployment, layout)
