"""The hall: `hall:` of a deployment has the walls of a hall and the properties of its rovers and stations."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Final

from foosim.common.finding import Finding
from foosim.library.mobile.hall_obstacles import obstacles_of, start_findings
from foosim.library.mobile.hall_settings import HALL, Hall, HallWalls, Side, hall_findings
from foosim.world.component_types.registry import kit, scene
from foosim.world.component_types.settings import SceneSettings
from foosim.world.components.base import Kit
from foosim.world.matter.materials import CONCRETE
from foosim.world.scene import Box, Colour, Shape, Vector
from foosim.world.spec import WorldSpec

if TYPE_CHECKING:
    from foosim.world.frame import Frame
    from foosim.world.layout import Entity


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


@kit(HALL, Hall)
class HallKit(Kit):
    """A hall with walls, in which rovers drive and stations charge them."""

    def __init__(self, section: Hall, spec: WorldSpec) -> None:
        self._hall, self._spec = section, spec

    def shapes(self) -> tuple[Shape, ...]:
        """Return floor and walls."""
        return hall_scenery(self._hall)

    def physics(self) -> None:
        """A hall has no rigid bodies of its own."""

    def findings(self) -> Iterator[Finding]:
        """Yield rovers and stations that are in something."""
        return start_findings(self._spec)

    def strays(self, frame: Frame) -> list[str]:
        """Return which rovers are in an obstacle, or in one another."""
        radius, obstacles = self._hall.rover.radius, obstacles_of(self._spec)
        rovers = [rover.name for rover in _present(frame)]
        places = [(name, frame.at(name, "position"), frame.at(name, "position", 1)) for name in rovers]
        found: list[str] = []
        for number, (name, x, y) in enumerate(places):
            found += [f"{name} is in {obstacle}" for obstacle in obstacles if not obstacle.is_clear(x, y, radius)]
            for other, there_x, there_y in places[:number]:
                if (x - there_x) * (x - there_x) + (y - there_y) * (y - there_y) < 4.0 * radius * radius:
                    found.append(f"{name} is in {other}")
        return found

    @staticmethod
    def check(section: Hall, spec: WorldSpec) -> Iterator[Finding]:
        """Yield parts of a rover that do not fit each other, or the hall."""
        return hall_findings(section)

    def status(self, frame: Frame) -> dict[str, Any]:
        """Return how many rovers there are and drive, and which has the least charge (a share)."""
        rovers = _present(frame)
        if not rovers:
            return {}
        capacity = self._hall.rover.battery.capacity
        least, name = min((frame.at(rover.name, "charge"), rover.name) for rover in rovers)
        drive = sum(any(frame.vector(rover.name, "wheel_speeds", 2)) for rover in rovers)
        return {"rovers": {"count": len(rovers), "drive": drive, "least": name, "charge": round(least / capacity, 4)}}

    @staticmethod
    def text(status: dict[str, Any]) -> str:
        """Return `20 rovers, 18 drive, rover07 has 34 % of its charge`."""
        if "rovers" not in status:
            return ""
        rovers = status["rovers"]
        count, drive, least, charge = (rovers[key] for key in ("count", "drive", "least", "charge"))
        return f"{count} rovers, {drive} drive, {least} has {charge:.0%} of its charge"


def _present(frame: Frame) -> list[Entity]:
    """Return the rovers that are in the world."""
    return [rover for rover in frame.layout.of("rover") if not rover.is_absent(frame.numbers)]
