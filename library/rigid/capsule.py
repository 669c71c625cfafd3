"""A rigid capsule: a cylinder with round ends."""

from __future__ import annotations

from foosim.library.rigid.primitives import RIGID, Extent, ObjectSettings, RigidObject
from foosim.world.component_types.registry import model
from foosim.world.components.view import Mounting
from foosim.world.scene import Capsule


class CapsuleObject(ObjectSettings):
    """A capsule of uniform density, whose axis is its own z; `length` is that between the middles of its ends."""

    radius: Extent
    length: Extent


@model("capsule", CapsuleObject, slots=RIGID, is_robot=False, is_rigid=True, tags=("object",))
def capsule(settings: CapsuleObject, at: Mounting) -> RigidObject:
    """A capsule of uniform density."""
    return RigidObject(settings, at, Capsule(settings.radius, settings.length))
