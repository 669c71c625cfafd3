"""Checks that rovers start, and stations are, inside the hall and outside of obstacles.

That takes geometry, so it is looked at when all single fields are right.
"""

from __future__ import annotations

from collections.abc import Iterator

from foosim.common.finding import Finding
from foosim.world.robots.rover import RoverRobot, StationRobot
from foosim.world.scenes.obstacles import Circle, Obstacle, named_obstacles
from foosim.world.spec import WorldSpec


def start_findings(spec: WorldSpec) -> Iterator[Finding]:
    """Yield the rovers and stations that are in an obstacle, in one another or outside of the hall.

    Meshes count once their files are there.
    """
    if not spec.is_hall:
        return
    hall = spec.hall
    taken = list(named_obstacles(spec))
    for name, robot in spec.robots.items():
        if isinstance(robot, StationRobot):
            circle = robot.x, robot.y, hall.station.radius
            others = [entry for entry in taken if entry[0] != f"the station {name}"]
            yield from _misplaced(spec, name, "the station stands", circle, others)
    for name, robot in spec.robots.items():
        if isinstance(robot, RoverRobot):
            circle = robot.x, robot.y, hall.rover.radius
            yield from _misplaced(spec, name, "the rover starts", circle, taken)
            taken.append((f"the rover {name}", Circle(*circle)))


def _misplaced(
    spec: WorldSpec,
    name: str,
    subject: str,
    circle: tuple[float, float, float],
    taken: list[tuple[str, Obstacle]],
) -> Iterator[Finding]:
    """Yield what is wrong with the place of a robot, as a circle (m): the first thing that it is in."""
    x, y, _ = circle
    half_x, half_y = spec.hall.length / 2, spec.hall.width / 2
    met = next((f"in {what}" for what, thing in taken if not thing.is_clear(*circle)), None)
    if met is None and (abs(x) > half_x or abs(y) > half_y):
        met = f"outside of the hall: valid are x from {-half_x:g} to {half_x:g} m, y from {-half_y:g} to {half_y:g} m"
    if met is not None:
        yield Finding(("robots", name, "x"), f"{subject} {met}", f"{x:g} m, {y:g} m")
