"""A rigid box, such as a crate."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from foosim.library.rigid.primitives import RIGID, Extent, ObjectSettings, RigidObject
from foosim.world.component_types.registry import model
from foosim.world.components.view import Mounting
from foosim.world.scene import Box


class BoxObject(ObjectSettings):
    """A box of uniform density: its lengths along its own x, y and z are `size`."""

    size: Annotated[list[Extent], Field(min_length=3, max_length=3)]


@model("box", BoxObject, slots=RIGID, is_robot=False, is_rigid=True, tags=("object",))
def box(settings: BoxObject, at: Mounting) -> RigidObject:
    """A box of uniform density."""
    a, b, c = settings.size
    return RigidObject(settings, at, Box((a / 2, b / 2, c / 2)))
