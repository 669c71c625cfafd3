"""The physics of a deployment's rigid bodies, by its kits, scene and surfaces, and the problems of these."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import Final

from foosim.common.finding import Finding, Location
from foosim.common.names import nearest_quoted
from foosim.world.fixed_scenery import kits_of, scene_shapes
from foosim.world.matter.physics import Physics, physics_from
from foosim.world.spec import WorldSpec

RESTITUTION_NS: Final = 10_000_000
"""The longest substep with a rebound within 5 %; at 40 ms it has 3 % too much energy, at 100 ms 18 %."""
NO_SURFACE: Final = ""
"""The surface of scenery without contacts."""


def physics_of(spec: WorldSpec) -> Physics:
    """Return the physics of rigid bodies: that of a kit, else by the deployment's physics and surfaces."""
    found = [physics for _, kit in kits_of(spec) if (physics := kit.physics()) is not None]
    assert len(found) <= 1, f"{len(found)} kits define the physics of rigid bodies"
    return found[0] if found else physics_from(spec.physics, spec.surfaces)


def gravity_of(spec: WorldSpec) -> float:
    """Return the acceleration of gravity (m/s2)."""
    return physics_of(spec).gravity


def findings_of(spec: WorldSpec) -> Iterator[Finding]:
    """Yield problems of the world as a whole: the physics of rigid bodies, and places.

    Meshes count once their files are there.
    """
    felt = [name for name, kit in kits_of(spec) if kit.physics() is not None]
    for name in felt[1:]:
        yield Finding((name,), f"defines the physics of rigid bodies, as {felt[0]} does already", name, at="key")
    if felt:
        for key in ("physics", "surfaces"):
            if getattr(spec, key):
                yield Finding((key,), f"the physics of rigid bodies, which {felt[0]} defines already", key, at="key")
    if len(felt) <= 1:
        yield from _unfelt(spec, has_rigid=bool(felt) or _has_rigid(spec))
    if not felt and _has_rigid(spec):
        yield from _too_long(spec)
    for _, kit in kits_of(spec):
        yield from kit.findings()


def _has_rigid(spec: WorldSpec) -> bool:
    return any(one.component_type.is_rigid for one in (*spec.robots.values(), *spec.objects.values()))


def _too_long(spec: WorldSpec) -> Iterator[Finding]:
    """Yield a problem of substeps too long for restitution: in one substep a contact begins and ends."""
    least = -(-spec.tick_ns // RESTITUTION_NS)
    bouncy = [name for name, surface in spec.surfaces.items() if surface.restitution > 0.0]
    if bouncy and spec.substeps < least:
        what = f"too few for the restitution of the surface {bouncy[0]}, which is right in substeps of at most 10 ms"
        yield Finding(("substeps",), f"{what} (valid from {least} on)", spec.substeps)


def _unfelt(spec: WorldSpec, *, has_rigid: bool) -> Iterator[Finding]:
    """Yield the unknown surfaces of scenery and bodies.

    Without rigid bodies these are the surfaces that `scenery` names.
    """
    felt = physics_of(spec)
    made: list[tuple[Location, str, list[str], Collection[str]]] = []
    scenery = felt.surfaces or felt.sides
    for name, kit in kits_of(spec) if has_rigid else ():
        made.append(((name,), f"kit {name}", [shape.surface for shape in kit.shapes()], scenery))
    if spec.scene is not None and has_rigid:
        surfaces = [shape.surface for shape in scene_shapes(spec)]
        made.append((("scene", "kind"), f"scene {spec.scene.kind}", surfaces, scenery))
    for name, thing in spec.scenery.items():
        made.append((("scenery", name, "surface"), f"scenery {name}", [thing.surface], scenery))
    for section, entities in (("objects", spec.objects), ("robots", spec.robots)) if has_rigid else ():
        for name, one in entities.items():
            for place, surface in one.felt_surfaces.items():
                made.append(((section, name, *place), f"{one.model} {name}", [surface], felt.sides))
    for location, what, surfaces, known in made:
        for surface in dict.fromkeys(surfaces):
            if surface != NO_SURFACE and surface not in known:
                valid = f"there are: {', '.join(sorted(known))}; and '' without contacts"
                nearest = nearest_quoted(surface, known)
                yield Finding(location, f"{what} has an unknown surface ({valid})", surface, nearest)
