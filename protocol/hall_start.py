"""Where rovers start: in the hall, and not in anything else.

That takes geometry, so it is looked at when all single fields are right. Neighbours: `deployment_file` (which asks),
`references` (everything else between the parts of a deployment), `obstacles`.
"""

from __future__ import annotations

from collections.abc import Iterator

from foosim.protocol.deployment import Deployment, RoverRobot
from foosim.protocol.obstacles import Circle, named_obstacles
from foosim.protocol.references import Finding


def start_findings(deployment: Deployment) -> Iterator[Finding]:
    """Yield the rovers that start in an obstacle or in one another; meshes count once their files are there."""
    if not deployment.is_hall:
        return
    radius = deployment.hall.rover.radius
    taken = list(named_obstacles(deployment))
    for name, robot in deployment.robots.items():
        if not isinstance(robot, RoverRobot):
            continue
        for what, thing in taken:
            if not thing.is_clear(robot.x, robot.y, radius):
                yield Finding(("robots", name, "x"), f"the rover starts in {what}", f"{robot.x:g} m, {robot.y:g} m")
                break
        taken.append((f"the rover {name}", Circle(robot.x, robot.y, radius)))
