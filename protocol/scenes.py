"""The scene of a world, whichever kind it is.

Neighbours: `table_scene` and `hall_scene`, one of which makes it; `scene` (what a scene is).
"""

from __future__ import annotations

from foosim.protocol.hall_scene import hall_scene
from foosim.protocol.layout import Layout
from foosim.protocol.scene import Scene
from foosim.protocol.table_scene import table_scene
from foosim.protocol.world_spec import WorldSpec


def build_scene(spec: WorldSpec, layout: Layout) -> Scene:
    """Return the scene of a layout's bodies in the deployment's world."""
    return hall_scene(spec, layout) if spec.is_hall else table_scene(spec, layout)
