"""The scene of a world, whichever kind it is.

Neighbours: `table_scene` and `hall_scene`, one of which makes it; `scene` (what a scene is).
"""

from __future__ import annotations

from foosim.protocol.deployment import Deployment
from foosim.protocol.hall_scene import hall_scene
from foosim.protocol.layout import Layout
from foosim.protocol.scene import Scene
from foosim.protocol.table_scene import table_scene


def build_scene(deployment: Deployment, layout: Layout) -> Scene:
    """Return the scene of a layout's bodies in the deployment's world."""
    return hall_scene(deployment, layout) if deployment.is_hall else table_scene(deployment, layout)
