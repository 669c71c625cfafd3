"""The scenery that the kits and the scene of a deployment bring."""

from __future__ import annotations

from collections.abc import Iterator

from foosim.world.scene import Shape
from foosim.world.spec import WorldSpec


def kits_of(spec: WorldSpec) -> Iterator[tuple[str, object]]:
    """Yield the kits of a world, made from their sections, by name in name order."""
    for name, section in sorted(spec.kits.items()):
        yield name, spec.kit_types[name].made(section, spec)


def fixed_shapes(spec: WorldSpec) -> tuple[Shape, ...]:
    """Return the scenery of kits and scene, which never moves."""
    shapes = [shape for _, kit in kits_of(spec) for shape in kit.shapes()]  # type: ignore[attr-defined]
    if spec.scene is not None:
        shapes += spec.scene.component_type.made(spec.scene)
    return tuple(shapes)
