"""Parts of the bodies of a hall's robots."""

from __future__ import annotations

from typing import Final, Literal

from foosim.world.matter.materials import PLASTIC
from foosim.world.scene import ORIGIN, Body, Colour, Cylinder, Link, Shape, Vector

DARK: Final[Colour] = (0.15, 0.15, 0.18, 1.0)
MAST_RADIUS_M: Final = 0.01


def standing(
    name: str, model: str, at: Vector, joint: Literal["free", "fixed"], shapes: tuple[Shape, ...], antenna_m: float
) -> Body:
    """Return a body of one link. It has no mass: no engine moves it."""
    link = Link(name, joint, shapes, 0.0, ORIGIN)
    return Body(name, model, at, (link,), (0.0, 0.0, antenna_m))


def mast(bottom: float, top: float, surface: str) -> tuple[Shape, ...]:
    """Return the mast of an antenna that is higher than the hull below it, if it is."""
    if top <= bottom:
        return ()
    pole = Cylinder(MAST_RADIUS_M, top - bottom)
    return (Shape(pole, surface, DARK, (0.0, 0.0, (top + bottom) / 2), radio=PLASTIC),)
