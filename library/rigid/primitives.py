"""Rigid objects of one shape: their settings, and the common part of their models."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Final

from pydantic import Field

from foosim.common import units
from foosim.common.finding import Location
from foosim.common.spec_base import Name, default
from foosim.common.units import Quantity
from foosim.world.bodies.inertia import principal_of, solid
from foosim.world.component_types.descriptions import BODY, CONTACTS, PARTNERS, RESTING
from foosim.world.component_types.settings import EntitySettings
from foosim.world.components.base import Model
from foosim.world.components.view import Mounting, WritableView
from foosim.world.matter.materials import UNKNOWN, Radio
from foosim.world.matter.physics import DEFAULT
from foosim.world.placing import At
from foosim.world.scene import ORIGIN, Body, Geometry, Link, Shape, moved, multiply, rotate
from foosim.world.scenery import Material

ObjectMass = Annotated[float, Quantity(units.MASS, "1 mg", "1000000 kg")]
Extent = Annotated[float, Quantity(units.LENGTH, "0.1 mm", "1000 m")]
SpeedLimit = Annotated[float, Quantity(units.SPEED, "1 mm/s", "10000 m/s")]

RIGID: Final = {**BODY, **CONTACTS, **PARTNERS, **RESTING, "quarantined": 1}
"""The fields of a free rigid body."""


class ObjectSettings(EntitySettings):
    """A rigid object: where it is at tick 0 (its middle), its mass, the surface that others feel, its looks.

    `speed_limit` is how fast any part of it usually is. Bodies within twice the way that this is in a tick are solved
    together, so a limit that is near what happens makes a world cheap; a faster body is solved with those farther away.
    """

    at: At = Field(default_factory=lambda: At.model_validate({}))
    mass: ObjectMass
    surface: Name = DEFAULT
    speed_limit: SpeedLimit = default("10 m/s")
    material: Material = Field(default_factory=Material)
    radio: Radio | None = None

    @property
    def felt_surfaces(self) -> Mapping[Location, str]:
        """The surface of all its shapes."""
        return {("surface",): self.surface}


class RigidObject(Model):
    """An entity of one shape and a uniform density, in the frames of one layout."""

    def __init__(self, settings: ObjectSettings, at: Mounting, geometry: Geometry) -> None:
        self._settings, self._at, self._geometry = settings, at, geometry
        whole = solid(geometry, settings.mass)
        self._centre, (self._moments, self._axes) = whole.centre, principal_of(whole.tensor)

    def body(self) -> Body:
        """Return the shape."""
        settings, name = self._settings, self._at.robot.name
        radio = UNKNOWN if settings.radio is None else settings.radio
        shape = Shape(self._geometry, settings.surface, settings.material.colour, radio=radio)
        link = Link(
            name, "free", (shape,), settings.mass, self._moments, centre_of_mass=self._centre, principal=self._axes
        )
        return Body(name, settings.model, ORIGIN, (link,), speed_limit=settings.speed_limit)

    def place(self, view: WritableView) -> None:
        """Set it to its start, at rest."""
        at, pose = self._at, self._settings.at
        view.write(at.slot("position"), *moved(pose.position, rotate(pose.orientation, self._centre), 1.0))
        view.write(at.slot("orientation"), *multiply(pose.orientation, self._axes))
        view.write(at.slot("contacts"), 0.0, 0.0, -1.0)

    def excite(self, view: WritableView) -> None:
        """Push and turn it, for the run that compares engines."""
        view.write(self._at.slot("linear_velocity"), 0.3, 0.2, 0.1)
        view.write(self._at.slot("angular_velocity"), 0.5, -0.3, 1.0)
