"""A rigid sphere."""

from __future__ import annotations

from foosim.library.rigid.primitives import RIGID, Extent, ObjectSettings, RigidObject
from foosim.world.component_types.registry import model
from foosim.world.components.view import Mounting
from foosim.world.scene import Sphere


class SphereObject(ObjectSettings):
    """A sphere of uniform density."""

    radius: Extent


@model("sphere", SphereObject, slots=RIGID, is_robot=False, is_rigid=True, tags=("object",))
def sphere(settings: SphereObject, at: Mounting) -> RigidObject:
    """A sphere of uniform density."""
    return RigidObject(settings, at, Sphere(settings.radius))
