"""Which actuators take jobs of operators: those of whose jobs a sensor of the robot tells."""

from __future__ import annotations

from typing import Any

from foosim.client.commands import CommandEncoder
from foosim.deployment.schema import Deployment
from foosim.world.sensors.job import JobSettings


def jobs_of(deployment: Deployment, robot: str) -> dict[str, str]:
    """Return the actuators of a robot of whose jobs a sensor tells, each with that sensor's channel."""
    sensors = sorted(deployment.robots[robot].sensors.items(), reverse=True)  # of several the first by name tells
    return {its.actuator: channel for channel, its in sensors if isinstance(its, JobSettings)}


def jobs_content(deployment: Deployment, entity: str) -> list[dict[str, Any]]:
    """Return them as pages read it, with the names of their commands' numbers; none of what is no robot."""
    if entity not in deployment.robots:
        return []
    encoder = CommandEncoder(deployment)
    return [
        {"actuator": actuator, "numbers": [field.name for field in encoder.actuator(entity, actuator).fields]}
        for actuator in sorted(jobs_of(deployment, entity))
    ]
