"""The scenery that the kits and the scene of a deployment bring."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from foosim.world.components.base import Kit
from foosim.world.components.view import called
from foosim.world.forms import registry
from foosim.world.scene import Shape
from foosim.world.spec import WorldSpec


def kits_of(spec: WorldSpec) -> Iterator[tuple[str, Kit]]:
    """Yield the kits of a world, made from their sections, by name in name order."""
    for name, section in sorted(spec.kits.items()):
        yield name, called(f"kit {name}", "", 0, registry.find("kit", name).factory, section, spec)


def fixed_shapes(spec: WorldSpec) -> tuple[Shape, ...]:
    """Return the scenery of kits and scene, which never moves."""
    shapes = [shape for name, kit in kits_of(spec) for shape in called(f"kit {name}", "", 0, kit.shapes)]
    return *shapes, *scene_shapes(spec)


def scene_shapes(spec: WorldSpec) -> Sequence[Shape]:
    """Return the scenery of the scene. Raises ComponentError."""
    if spec.scene is None:
        return ()
    scene = registry.find("scene", spec.scene.kind)
    return called(f"scene {spec.scene.kind}", "", 0, lambda settings: tuple(scene.factory(settings)), spec.scene)
