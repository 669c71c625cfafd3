"""Wind: the velocity of the air around rigid bodies. It does not act on bodies that move by kinematics.

The engine `mujoco` computes its force on a body by MuJoCo's inertia box model of a passive medium (MuJoCo's
documentation, Computation, section "Fluid forces"): the force along each axis of the box that has the body's mass and
moments of inertia is -density / 2 x A |v| v - 3 pi x viscosity x D v, with v of the body relative to the air, A the
box's area across that axis and D the mean of its sides; likewise it damps how the body turns. No body
shelters another one. The speed of the air is in the frame, so it can be set during a run.
"""

from __future__ import annotations

from foosim.world.air import AIR_SPEED, AXES, WindSettings
from foosim.world.component_types.registry import rule
from foosim.world.components.base import Rule, slot
from foosim.world.components.entities import RuleMounting
from foosim.world.components.view import WritableView


@rule("wind", WindSettings, settable=dict.fromkeys(AXES, AIR_SPEED))
class Wind(Rule):
    """The velocity of the air (m/s), the same everywhere."""

    x, y, z = slot(), slot(), slot()

    def __init__(self, settings: WindSettings, at: RuleMounting) -> None:
        self._start = {axis: getattr(settings, axis) for axis in AXES}

    def place(self, view: WritableView) -> None:
        """Set it to its value at tick 0."""
        for axis, speed in self._start.items():
            view.write(getattr(self, axis), speed)

    def apply(self, view: WritableView) -> None:
        """It stays as it is."""
