"""The scene of a world, whichever kind it is."""

from __future__ import annotations

from foosim.world.layout import Layout
from foosim.world.scene import Scene
from foosim.world.scenes.football_table import table_scene
from foosim.world.scenes.warehouse import hall_scene
from foosim.world.spec import WorldSpec


def build_scene(spec: WorldSpec, layout: Layout) -> Scene:
    """Return the scene of a layout's bodies in the deployment's world."""
    return hall_scene(spec, layout) if spec.is_hall else table_scene(spec, layout)
