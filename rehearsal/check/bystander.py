"""A robot that does nothing: beside it, every other one is what it is without it."""

from __future__ import annotations

from collections.abc import Sequence

from foosim.world.components.view import Mounting, WritableView
from foosim.world.forms.registry import model
from foosim.world.forms.settings import RobotSettings


class BystanderRobot(RobotSettings):
    """A robot that does nothing."""


@model("bystander", BystanderRobot, slots={"down": 1, "refused": 1}, has_body=False)
class Bystander:
    """A robot without a body, for the check of components."""

    def __init__(self, settings: BystanderRobot, at: Mounting) -> None:
        pass

    def body(self) -> None:
        """Nothing that radio waves or viewers would meet."""

    def place(self, view: WritableView) -> None:
        """It has no state of its own."""

    def is_plausible(self, numbers: Sequence[float], before: Sequence[float]) -> bool:
        """Nothing moves it."""
        return True
