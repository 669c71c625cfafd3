"""A rigid cylinder."""

from __future__ import annotations

from foosim.library.rigid.primitives import RIGID, Extent, ObjectSettings, RigidObject
from foosim.world.component_types.registry import model
from foosim.world.components.view import Mounting
from foosim.world.scene import Cylinder


class CylinderObject(ObjectSettings):
    """A cylinder of uniform density, whose axis is its own z."""

    radius: Extent
    length: Extent


@model("cylinder", CylinderObject, slots=RIGID, is_robot=False, is_rigid=True, tags=("object",))
def cylinder(settings: CylinderObject, at: Mounting) -> RigidObject:
    """A cylinder of uniform density."""
    return RigidObject(settings, at, Cylinder(settings.radius, settings.length))
