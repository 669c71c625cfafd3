"""Bounds of a world's entities, checked in every frame, for each kind of world."""

from __future__ import annotations

from foosim.deployment.schema import Deployment
from foosim.world.frame import Frame
from foosim.world.scenes.obstacles import obstacles_of


def strays(deployment: Deployment, frame: Frame) -> list[str]:
    """Return descriptions of the entities of a frame that are out of bounds."""
    return _stray_rovers(deployment, frame) if deployment.is_hall else _stray_balls(deployment, frame)


def _stray_balls(deployment: Deployment, frame: Frame) -> list[str]:
    """Entities outside of quarantine are in the world and within the model's speed limit."""
    table = deployment.table
    margin, limit = table.rules.out_margin, table.ball.speed_limit
    found = []
    for ball in frame.layout.balls:
        if frame.at(ball.name, "quarantined") == 0.0:
            x, y, _ = frame.vector(ball.name, "position", 3)
            speed = sum(value * value for value in frame.vector(ball.name, "linear_velocity", 3))
            inside = abs(x) <= table.field.length / 2 + margin and abs(y) <= table.field.width / 2 + margin
            if not (inside and speed <= limit * limit):
                found.append(f"{ball.name} is out of its bounds")
    return found


def _stray_rovers(deployment: Deployment, frame: Frame) -> list[str]:
    """No rover is in quarantine, in an obstacle, or in another one."""
    radius, capacity = deployment.hall.rover.radius, deployment.hall.rover.battery.capacity
    obstacles = obstacles_of(deployment)
    places = [
        (rover.name, frame.at(rover.name, "position"), frame.at(rover.name, "position", 1))
        for rover in frame.layout.rovers
    ]
    found: list[str] = []
    for number, (name, x, y) in enumerate(places):
        if frame.at(name, "quarantined") != 0.0 or not 0.0 <= frame.at(name, "charge") <= capacity:
            found.append(f"{name} is in quarantine, or has a charge that it cannot have")
        found += [f"{name} is in {obstacle}" for obstacle in obstacles if not obstacle.is_clear(x, y, radius)]
        for other, there_x, there_y in places[:number]:
            if (x - there_x) * (x - there_x) + (y - there_y) * (y - there_y) < 4.0 * radius * radius:
                found.append(f"{name} is in {other}")
    return found
