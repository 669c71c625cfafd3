"""Players of the living world: they give, preempt and cancel jobs, close and open grippers, at times of their own."""

from __future__ import annotations

from collections.abc import Mapping
from random import Random
from typing import Any, Final

from foosim.client.jobs import Job, Jobs
from foosim.client.player import Commands, Player, Samples
from foosim.deployment.schema import Deployment

GO: Final = "go"
GRIPPER: Final = "gripper"
JOINTS: Final = "joints"
AT_ONCE: Final = 0.05
"""How probably something is done with one robot in one turn."""


class Sender(Player):
    """Commands each of its robots at drawn times; its memory begins anew with its process."""

    def __init__(self, deployment: Deployment, parameters: Mapping[str, Any]) -> None:
        name = parameters["name"]
        self._draw = Random(f"{deployment.seed} {name}")
        self._can = {robot: [*deployment.robots[robot].actuators] for robot in deployment.players[name].robots}
        self._jobs = {robot: Jobs(deployment, name, robot, GO) for robot, can in self._can.items() if GO in can}
        self._called: dict[str, Job] = {}

    def act(self, tick: int, samples: Samples) -> Commands:
        """Return what is due of its jobs, and what it does with grippers and joints."""
        found: dict[str, dict[str, Any]] = {}
        for robot in self.robots:
            can, its = self._can[robot], dict[str, Any]()
            if GRIPPER in can and self._draw.random() < AT_ONCE:
                its[GRIPPER] = {"closed": float(self._draw.random() < 0.7)}
            if JOINTS in can and self._draw.random() < AT_ONCE:
                its[JOINTS] = (self._draw.uniform(0.0, 0.2), self._draw.uniform(0.0, 0.05))
            if GO in can:
                its |= self._go(robot, tick, samples)
            if its:
                found[robot] = its
        return found

    def _go(self, robot: str, tick: int, samples: Samples) -> dict[str, Any]:
        """Begin a job, or cancel the one before; return what is due."""
        jobs, called = self._jobs[robot], self._called.get(robot)
        jobs.hear(samples)
        if self._draw.random() < AT_ONCE:
            if called is not None and self._draw.random() < 0.3:
                called.cancel()
            else:
                self._called[robot] = self._call(jobs)
        command = jobs.due(tick)
        return {} if command is None else {GO: command}

    def _call(self, jobs: Jobs) -> Job:
        x, y = self._draw.uniform(-3.0, 3.0), self._draw.uniform(-2.0, 3.0)
        return jobs.call(x, y, 1.0, 0.0) if jobs.robot == "craft" else jobs.call(x=x, y=y)
