"""A rigid cylinder."""

from __future__ import annotations

from foosim.world.components.view import Mounting
from foosim.world.forms.registry import model
from foosim.world.parameters.primitives import RIGID, Extent, ObjectSettings, RigidObject
from foosim.world.scene import Cylinder


class CylinderObject(ObjectSettings):
    """A cylinder of uniform density, whose axis is its own z."""

    radius: Extent
    length: Extent


@model("cylinder", CylinderObject, slots=RIGID, is_robot=False, is_rigid=True, tags=("object",))
def cylinder(settings: CylinderObject, at: Mounting) -> RigidObject:
    """A cylinder of uniform density: I = m r^2 / 2 about its axis, m (3 r^2 + l^2) / 12 across."""
    square = settings.radius * settings.radius
    across = (3.0 * square + settings.length * settings.length) / 12.0
    return RigidObject(settings, at, Cylinder(settings.radius, settings.length), (across, across, square / 2.0))
