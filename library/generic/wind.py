"""Wind: the air that rigid bodies are in, and how fast it goes. What moves by kinematics does not feel it.

The engine `mujoco` computes what it does to a body, by MuJoCo's inertia box model of a passive medium (MuJoCo's
documentation, Computation, section "Fluid forces"): the force along each axis of the box that has the body's mass and
moments of inertia is -density / 2 x A |v| v - 3 pi x viscosity x D v, with v of the body relative to the air, A the
box's area across that axis and D the mean of its sides; likewise it damps how the body turns. A body behind another one
is not sheltered. How fast the air goes is in the frame, so it can be set while the world goes on.
"""

from __future__ import annotations

from foosim.world.air import AIR_SPEED, AXES, WindSettings
from foosim.world.components.base import Rule
from foosim.world.components.entities import RuleMounting
from foosim.world.components.view import WritableView
from foosim.world.forms.registry import rule


@rule("wind", WindSettings, slots=dict.fromkeys(AXES, 1), settable=dict.fromkeys(AXES, AIR_SPEED))
class Wind(Rule):
    """How fast the air goes (m/s), the same everywhere."""

    def __init__(self, settings: WindSettings, at: RuleMounting) -> None:
        self._start = {axis: getattr(settings, axis) for axis in AXES}
        self._at = at

    def place(self, view: WritableView) -> None:
        """Set it to what it is at tick 0."""
        for axis, speed in self._start.items():
            view.write(self._at.slot(axis), speed)

    def apply(self, view: WritableView) -> None:
        """It stays as it is."""
