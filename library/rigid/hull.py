"""A rigid convex body of any shape, by its corners."""

from __future__ import annotations

from functools import lru_cache
from typing import Annotated, Final

from pydantic import AfterValidator, Field

from foosim.common import units
from foosim.common.errors import BadValue
from foosim.common.units import Quantity, custom_error
from foosim.library.rigid.primitives import RIGID, ObjectSettings, RigidObject
from foosim.world.component_types.registry import model
from foosim.world.components.view import Mounting
from foosim.world.matter.mesh import Mesh
from foosim.world.scene import Hull

CORNERS_MAX: Final = 255
Coordinate = Annotated[float, Quantity(units.LENGTH, "-1000 m", "1000 m")]
Corner = Annotated[list[Coordinate], Field(min_length=3, max_length=3)]


@lru_cache(maxsize=64)
def _hull(corners: tuple[tuple[float, ...], ...]) -> Mesh:
    import numpy as np  # only where bodies are built

    from foosim.world.bodies.hull import convex_hull

    return convex_hull(np.array(corners))


def _solid(corners: list[list[float]]) -> list[list[float]]:
    """Refuse corners that enclose nothing."""
    try:
        _hull(tuple(map(tuple, corners)))
    except BadValue as error:
        raise custom_error(BadValue(error.problem, f"{len(corners)} corners")) from None
    return corners


class HullObject(ObjectSettings):
    """A convex body of uniform density: the least one that holds its `corners`, each x, y, z in its own frame."""

    corners: Annotated[list[Corner], Field(min_length=4, max_length=CORNERS_MAX), AfterValidator(_solid)]


@model("hull", HullObject, slots=RIGID, is_robot=False, is_rigid=True, tags=("object",))
def hull(settings: HullObject, at: Mounting) -> RigidObject:
    """A convex body of uniform density."""
    return RigidObject(settings, at, Hull(_hull(tuple(map(tuple, settings.corners)))))
