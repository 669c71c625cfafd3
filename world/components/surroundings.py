"""The surroundings of components: poses of links, near entities, rays, tags, contacts.

All of it follows from the frame; entities are in name order.
"""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

from foosim.world.components.entities import made_model
from foosim.world.components.view import SensingView, View
from foosim.world.fixed_scenery import fixed_shapes
from foosim.world.kinematics import forward_kinematics
from foosim.world.layout import WORLD, Entity, Layout
from foosim.world.rays.boxes import Floats
from foosim.world.rays.caster import Caster, Placement
from foosim.world.rays.casting import Hits
from foosim.world.scene import Body, Pose, Scene, Vector
from foosim.world.spec import WorldSpec


class Contacts(NamedTuple):
    """The contact log of a rigid body in the last tick: touches that began, impulse (N s), last substep or -1."""

    touches: int
    impulse: float
    last_substep: int


class Surroundings:
    """The entities of one layout, as components see them: a component builds it from its mounting.

    Places are those at the start of the tick, the same in all nodes. It keeps only data of deployment and layout.
    """

    def __init__(self, spec: WorldSpec, layout: Layout) -> None:
        self._spec, self._layout = spec, layout

    def tags(self, entity: Entity) -> frozenset[str]:
        """Return the tags of an entity: those of its model and of its settings."""
        settings = self._spec.settings_of(entity.name)
        return frozenset((*entity.kind.tags, *(() if settings is None else settings.tags)))

    def tagged(self, tag: str) -> list[Entity]:
        """Return the entities with a tag, absent ones included: these are far from all places."""
        return [entity for entity in self._layout.entities if tag in self.tags(entity)]

    def poses(self, view: View, entity: Entity) -> list[Pose]:
        """Return name, position (m) and orientation of each link of an entity, in the world frame; none without one."""
        body = self.bodies.get(entity.name)
        return [] if body is None else forward_kinematics(body, entity, view.start)

    def position(self, view: View, entity: Entity) -> Vector | None:
        """Return the place of the first link of an entity (m, world frame); None without links."""
        poses = self.poses(view, entity)
        return poses[0][1] if poses else None

    def near(self, view: View, place: Vector, range_m: float, tag: str = "") -> list[Entity]:
        """Return the entities whose first link is within a range of a place; with a tag, only entities with that."""
        found = []
        for entity in self._layout.entities if not tag else self.tagged(tag):
            position = self.position(view, entity)
            if position is not None:
                dx, dy, dz = position[0] - place[0], position[1] - place[1], position[2] - place[2]
                if dx * dx + dy * dy + dz * dz <= range_m * range_m:
                    found.append(entity)
        return found

    def rays(
        self, view: View, origins: Floats, directions: Floats, range_m: Floats | float, ignoring: Entity | None = None
    ) -> Hits:
        """Return the first hits of rays (`Placement.cast`) on scenery and bodies, the entity `ignoring` aside."""
        return self.placement(view).cast(origins, directions, range_m, None if ignoring is None else ignoring.index)

    def clearance(self, view: View, points: Floats, reach_m: Floats | float, ignoring: Entity | None = None) -> Floats:
        """Return distances from points to the nearest surface (`Placement.clearance`), the entity `ignoring` aside."""
        return self.placement(view).clearance(points, reach_m, None if ignoring is None else ignoring.index)

    def placement(self, view: View) -> Placement:
        """Return the ray caster with all things where they are at the start of the tick."""
        return self.caster.at(view.start, view.values if isinstance(view, SensingView) else None)

    @property
    def caster(self) -> Caster:
        """The ray caster of the layout, which all components of it share."""
        return self._layout.shared("caster", self._spec, lambda: Caster(self.scene, self._layout))

    @property
    def scene(self) -> Scene:
        """The bodies of the layout and the scenery, which all components of it share."""
        return self._layout.shared(
            "scene", self._spec, lambda: Scene(self.bodies, (*fixed_shapes(self._spec), *self._spec.scenery_shapes()))
        )

    @cached_property
    def bodies(self) -> dict[str, Body]:
        """The bodies of the layout by name, which all components of it share; they need no file of the scenery."""
        return self._layout.shared("bodies", self._spec, self._made_bodies)

    def _made_bodies(self) -> dict[str, Body]:
        spec, layout = self._spec, self._layout
        models = {one.name: made_model(spec, layout, one) for one in layout.entities if one.name != WORLD}
        return {name: body for name, model in models.items() if (body := model.body()) is not None}

    @staticmethod
    def contacts(view: View, entity: Entity) -> Contacts:
        """Return the contact log of a rigid body; empty for other entities."""
        at = entity.offsets.get("contacts")
        if at is None:
            return Contacts(0, 0.0, -1)
        touches, impulse, last = view.start[at : at + 3]
        return Contacts(int(touches), impulse, int(last))
