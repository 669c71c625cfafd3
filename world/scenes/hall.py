"""The hall: a floor, and four walls around it."""

from __future__ import annotations

from typing import Final

from foosim.world.forms.registry import scene
from foosim.world.forms.settings import SceneSettings
from foosim.world.matter.materials import CONCRETE
from foosim.world.parameters.hall import Hall, HallWalls, Side
from foosim.world.scene import Box, Colour, Shape, Vector

GREY: Final[Colour] = (0.62, 0.62, 0.60, 1.0)
PALE: Final[Colour] = (0.80, 0.80, 0.78, 1.0)
FLOOR_THICKNESS_M: Final = 0.2
NO_SURFACE: Final = ""
"""What rigid bodies do not feel: they are those of another kit, which has surfaces of its own."""


class HallSettings(SceneSettings):
    """A rectangular hall: `length` along x and `width` along y between its walls."""

    length: Side
    width: Side
    walls: HallWalls


@scene("hall", HallSettings)
def hall_scenery(hall: HallSettings | Hall) -> tuple[Shape, ...]:
    """A floor, which reaches under the walls, and the four walls around it."""
    x, y, thick, top = hall.length / 2, hall.width / 2, hall.walls.thickness, hall.walls.height
    long, wide = Box((x + thick, thick / 2, top / 2)), Box((thick / 2, y, top / 2))
    floor = Box((x + thick, y + thick, FLOOR_THICKNESS_M / 2))
    placed: list[tuple[Box, Colour, Vector]] = [(floor, GREY, (0.0, 0.0, -FLOOR_THICKNESS_M / 2))]
    placed += [(long, PALE, (0.0, side * (y + thick / 2), top / 2)) for side in (-1.0, 1.0)]
    placed += [(wide, PALE, (side * (x + thick / 2), 0.0, top / 2)) for side in (-1.0, 1.0)]
    return tuple(Shape(box, NO_SURFACE, colour, place, radio=CONCRETE, name="hall") for box, colour, place in placed)
