"""The physics of rigid bodies: gravity, contacts of surfaces, and settings of the solver."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Final

from pydantic import Field

from foosim.common import units
from foosim.common.spec_base import Coefficient, Gravity, Restitution, SpecBase, default
from foosim.common.units import Quantity


@dataclass(frozen=True, slots=True)
class Contact:
    """The values of a pair of surfaces: restitution, friction, rolling friction as a length (m).

    Contacts with a `silent` surface are not in the contact logs.
    """

    restitution: float
    friction: float
    rolling_friction: float = 0.0
    silent: bool = False


@dataclass(frozen=True, slots=True)
class Side:
    """A side of contacts: restitution and friction of a pair are the products of both sides'.

    Rolling friction (a length, m) of a pair is each side's own times the other's friction, added. Contacts with a
    `silent` surface are not in the contact logs.
    """

    restitution: float
    friction: float
    rolling_friction: float = 0.0
    silent: bool = False


@dataclass(frozen=True, slots=True)
class Physics:
    """The physics of rigid bodies: gravity (m/s2), the sides of surfaces by their names, the solver's iterations and
    error reduction of contacts (`contact_erp`).

    `surfaces` and `between_free` are for engines of spheres alone: the pairs of a free body with each surface, and with
    another free body. `density` (kg/m3) and `viscosity` (Pa s) are those of the medium, 0 without one.
    """

    gravity: float
    surfaces: Mapping[str, Contact]
    between_free: Contact
    solver_iterations: int
    contact_erp: float
    sides: Mapping[str, Side] = field(default_factory=dict)
    density: float = 0.0
    viscosity: float = 0.0


RollingLength = Annotated[float, Quantity(units.LENGTH, "0 m", "1 m")]


class SurfaceSettings(SpecBase):
    """A surface in contacts: `friction` and `restitution` of a pair are the products of both sides'.

    `rolling_friction` is a length: the moment that brakes a body that rolls is this times the normal force, times the
    other side's friction.
    """

    friction: Coefficient = 0.8
    restitution: Restitution = 0.0
    rolling_friction: RollingLength = default("0 m")


class PhysicsSettings(SpecBase):
    """The physics of all rigid bodies of a world: gravity (standard gravity by default, ISO 80000-3), and the greatest
    count of iterations over the contacts and joints of a substep: a solve that is cut short may throw bodies about.
    `contact_erp` is the share of an overlap that a substep corrects.
    """

    gravity: Gravity = default("9.80665 m/s2")
    solver_iterations: Annotated[int, Field(ge=1, le=1000)] = 200
    contact_erp: Annotated[float, Field(ge=0, le=1)] = 0.05


DEFAULT: Final = "default"
FRICTIONLESS: Final = "frictionless"
"""The surface of parts that roll or slide freely: of balls in casters."""
BASIC: Final = ("default", "floor", "walls", FRICTIONLESS)
"""Surfaces that each world has; those of these names in a deployment replace them."""


def physics_from(settings: PhysicsSettings | None, surfaces: Mapping[str, SurfaceSettings]) -> Physics:
    """Return the physics of rigid bodies in a world without a kit that defines it."""
    felt = PhysicsSettings.model_validate({}) if settings is None else settings
    plain, smooth = SurfaceSettings.model_validate({}), SurfaceSettings.model_validate({"friction": 0})
    known = {name: smooth if name == FRICTIONLESS else plain for name in BASIC} | dict(surfaces)
    sides = {name: Side(one.restitution, one.friction, one.rolling_friction) for name, one in known.items()}
    nothing = Contact(0.0, 0.0)
    return Physics(felt.gravity, {}, nothing, felt.solver_iterations, felt.contact_erp, sides)
