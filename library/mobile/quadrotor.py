"""A quadrotor: a rigid body that four rotors lift."""

from __future__ import annotations

from typing import Final

from foosim.library.mobile.rotors import QuadrotorRobot
from foosim.library.rigid.primitives import RIGID
from foosim.world.component_types.registry import model
from foosim.world.components.base import Model
from foosim.world.components.view import WritableView
from foosim.world.matter.materials import PLASTIC
from foosim.world.scene import ORIGIN, Body, Box, Colour, Cylinder, Link, Shape

GREY: Final[Colour] = (0.30, 0.32, 0.36, 1.0)
RED: Final[Colour] = (0.80, 0.20, 0.15, 1.0)


@model(
    "quadrotor",
    QuadrotorRobot,
    slots=RIGID,
    is_rigid=True,
    actuators={"rotors": {"kind": "rotor_speeds"}},
    tags=("flying",),
)
class Quadrotor(Model):
    """A frame with four discs, x ahead, z up: a rigid body."""

    def body(self) -> Body:
        """Return the middle and the discs of its rotors."""
        settings, name = self.settings, self.at.robot.name
        side, height = settings.side, settings.height
        middle = Shape(Box((side / 2, side / 2, height / 2)), settings.surface, GREY, radio=PLASTIC)
        disc = Cylinder(settings.rotor_radius, 0.2 * height)
        shapes = [middle]
        for x, y, _ in settings.rotor_places():
            colour = RED if x > 0.0 else GREY
            shapes.append(Shape(disc, settings.surface, colour, (x, y, 0.4 * height), radio=PLASTIC))
        link = Link(name, "free", tuple(shapes), settings.mass, settings.moments)
        return Body(name, "quadrotor", ORIGIN, (link,), speed_limit=settings.speed_limit)

    def place(self, view: WritableView) -> None:
        """Set it to its start, at rest."""
        at = self.at
        view.write(at.slot("position"), *self.settings.at.position)
        view.write(at.slot("orientation"), *self.settings.at.orientation)
        view.write(at.slot("contacts"), 0.0, 0.0, -1.0)
