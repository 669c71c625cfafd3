"""Robots put at once where commands of their actuators `teleport` have them."""

from __future__ import annotations

from foosim.library.generic.teleport import TeleportSettings
from foosim.world.component_types.descriptions import ROBOTS
from foosim.world.component_types.registry import rule
from foosim.world.component_types.settings import RuleSettings
from foosim.world.components.base import Rule
from foosim.world.components.entities import RuleMounting
from foosim.world.components.view import WritableView
from foosim.world.scene import turn

MODELS = ("differential_drive", "holonomic", "rotorcraft")


class TeleportedSettings(RuleSettings):
    """Puts robots at once at the poses of their actuators of the kind `teleport`, whatever is there."""


@rule("teleported", TeleportedSettings, each={ROBOTS: {"done": 1}}, writes=MODELS)
class Teleported(Rule):
    """Puts robots there in the tick after that of a command; `done` is the number of those so far, of each robot."""

    def __init__(self, settings: TeleportedSettings, at: RuleMounting) -> None:
        self._robots = [
            (
                [at.of(robot, f"{channel}.{slot}") for slot in ("count", "target")],
                at.of(robot, "done"),
                [at.of(robot, field) for field in ("position", "orientation", "heading")],
            )
            for robot in at.layout.robots
            if robot.model in MODELS
            for channel, its in at.spec.robots[robot.name].actuators.items()
            if isinstance(its, TeleportSettings)
        ]

    def apply(self, view: WritableView) -> None:
        """Put those there that had a command."""
        for (count, target), done, (position, orientation, heading) in self._robots:
            (commands,) = view.read(count)
            if view.read(done)[0] != commands:
                x, y, z, yaw = view.read(target)
                view.write(position, x, y, z)
                view.write(orientation, *turn((0.0, 0.0, 1.0), yaw))
                view.write(heading, yaw)
                view.write(done, commands)
