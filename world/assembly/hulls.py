"""Which bodies of a world have shapes that an engine makes of somebody's numbers: convex hulls."""

from __future__ import annotations

from foosim.world.assembly.world import build_scene
from foosim.world.layout import Entity, Layout
from foosim.world.scene import Hull
from foosim.world.spec import WorldSpec


def with_hulls(spec: WorldSpec, layout: Layout) -> list[Entity]:
    """Return the rigid bodies that have convex hulls, in name order; of those with the same hulls the first one."""
    rigid = [entity for entity in layout.entities if entity.is_rigid]
    if not rigid:
        return []
    bodies = build_scene(spec, layout).bodies
    found: dict[tuple[Hull, ...], Entity] = {}
    for entity in rigid:
        shapes = [shape.geometry for link in bodies[entity.name].links for shape in link.shapes]
        hulls = tuple([geometry for geometry in shapes if isinstance(geometry, Hull)])
        if hulls:
            found.setdefault(hulls, entity)
    return list(found.values())
