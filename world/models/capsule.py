"""A rigid capsule: a cylinder with round ends."""

from __future__ import annotations

from foosim.world.components.view import Mounting
from foosim.world.forms.registry import model
from foosim.world.parameters.primitives import RIGID, Extent, ObjectSettings, RigidObject
from foosim.world.scene import Capsule


class CapsuleObject(ObjectSettings):
    """A capsule of uniform density, whose axis is its own z; `length` is that between the middles of its ends."""

    radius: Extent
    length: Extent


@model("capsule", CapsuleObject, slots=RIGID, is_robot=False, is_rigid=True, tags=("object",))
def capsule(settings: CapsuleObject, at: Mounting) -> RigidObject:
    """A capsule of uniform density: a cylinder and two half spheres, whose centres of mass lie 3/8 r beyond its ends.

    The shares of the mass follow from the volumes, pi r^2 l and 4/3 pi r^3; the half spheres' moments are moved by the
    parallel axis theorem: about an end's middle 2/5 m r^2, so across 2/5 m r^2 + m (l^2 / 4 + 3/8 l r).
    """
    radius, length = settings.radius, settings.length
    square = radius * radius
    tube = length / (length + 4.0 / 3.0 * radius)
    ends = 1.0 - tube
    across = tube * (3.0 * square + length * length) / 12.0
    across += ends * (0.4 * square + length * length / 4.0 + 0.375 * length * radius)
    along = tube * square / 2.0 + ends * 0.4 * square
    return RigidObject(settings, at, Capsule(radius, length), (across, across, along))
