"""What the rigid bodies of a world feel: gravity, and what free bodies feel of each surface."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


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
    """What a surface brings to its contacts: restitution and friction of a pair are the products of both sides'.

    Rolling friction (a length, m) of a pair is each side's own times the other's friction, added. Contacts with a
    `silent` surface are not in the contact logs.
    """

    restitution: float
    friction: float
    rolling_friction: float = 0.0
    silent: bool = False


@dataclass(frozen=True, slots=True)
class Physics:
    """What rigid bodies feel: gravity (m/s2), the sides of surfaces by their names, the solver's iterations and error
    reduction of contacts (`contact_erp`).

    `surfaces` and `between_free` are for engines of spheres alone: what a free body feels of each surface, and of
    another free body.
    """

    gravity: float
    surfaces: Mapping[str, Contact]
    between_free: Contact
    solver_iterations: int
    contact_erp: float
    sides: Mapping[str, Side] = field(default_factory=dict)
