"""Actuators of robots: the meaning of a command's bytes, and the motors' set-points.

One file each. To add one: a file with a class like those here, made by its kind of world (`node.world`).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol


class Actuator(Protocol):
    """What the tick of a node asks of an actuator. `channel` is that of its commands."""

    channel: str

    def accept(self, payload: bytes, numbers: list[float]) -> bool:
        """Take a command into the actuator's memory, which is in the frame; False when it is refused."""

    def command(self, numbers: Sequence[float]) -> tuple[tuple[float, float], tuple[float, float]]:
        """Return (target speed, greatest force or acceleration) of each of two motors, in SI units."""
