"""How large a rigid body may be: of a larger one Bullet drops shapes and links without a word.

A link has one compound of primitives, or one convex hull. Every further hull is a link of its own, fixed to it.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final

from foosim.world.matter.mesh import Mesh
from foosim.world.scene import Hull, Shape

PRIMITIVES_MAX: Final = 16
"""Boxes, spheres, cylinders and capsules of one link: those of a compound in Bullet."""
LINKS_MAX: Final = 127
"""Links of a body and their further convex hulls: Bullet has 128 with the base, which a fixed body has besides."""


def split_shapes(shapes: Sequence[Shape]) -> tuple[tuple[Shape, ...], tuple[Shape, ...]]:
    """Return the shapes of a link that Bullet can have as one, and those that are links of their own."""
    hulls = tuple([shape for shape in shapes if isinstance(shape.geometry, Hull | Mesh)])
    others = tuple([shape for shape in shapes if not isinstance(shape.geometry, Hull | Mesh)])
    return (others, hulls) if others else (hulls[:1], hulls[1:])


def size_problem(links: Iterable[Sequence[Shape]]) -> str:
    """Return what is too much in the links of a body, of which the shapes are given; empty if nothing is."""
    links_count = hulls_count = 0
    for shapes in links:
        first, further = split_shapes(shapes)
        if len(first) > PRIMITIVES_MAX:
            return (
                f"a link with {len(first)} boxes, spheres, cylinders and capsules; at most {PRIMITIVES_MAX} are valid, "
                "beside meshes"
            )
        links_count += 1
        hulls_count += len(further)
    if links_count + hulls_count > LINKS_MAX:
        beside = f" and {hulls_count} further convex hulls, which are links too" if hulls_count else ""
        return f"{links_count} links{beside}; at most {LINKS_MAX} are valid in all"
    return ""
