"""MuJoCo."""

from __future__ import annotations

from typing import TYPE_CHECKING

from foosim.world.forms.registry import engine

if TYPE_CHECKING:
    from foosim.deployment.schema import Deployment
    from foosim.node.physics.interface import AnyEngine
    from foosim.world.layout import Layout


@engine("mujoco", meshes=True, islands=True, grasps=True)
class Mujoco:
    """Rigid bodies of any kind by the MuJoCo library, with scenery of any shape."""

    def make(self, deployment: Deployment, layout: Layout) -> AnyEngine:
        """Return an engine, built at once."""
        from foosim.node.physics.mujoco_islands import MujocoIslands

        return MujocoIslands(deployment, layout)
