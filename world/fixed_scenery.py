"""The scenery of a deployment's kits and scene."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from foosim.world.scene import Shape
from foosim.world.spec import WorldSpec


def kits_of(spec: WorldSpec) -> Iterator[tuple[str, Any]]:
    """Yield the kits of a world, by name in name order."""
    for name, section in sorted(spec.kits.items()):
        yield name, spec.kit_types[name].factory(section, spec)


def fixed_shapes(spec: WorldSpec) -> tuple[Shape, ...]:
    """Return the scenery of kits and scene, which never moves."""
    return *(shape for _, kit in kits_of(spec) for shape in kit.shapes()), *scene_shapes(spec)


def scene_shapes(spec: WorldSpec) -> tuple[Shape, ...]:
    """Return the scenery of the scene."""
    return () if spec.scene is None else tuple(spec.scene.component_type.factory(spec.scene))
