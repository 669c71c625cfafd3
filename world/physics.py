"""What the rigid bodies of a world feel: gravity, and what free bodies feel of each surface."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


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
class Physics:
    """The parameters of the rigid bodies: gravity (m/s2), what a free body feels of each surface by its name, and of
    another free body; and the solver's iterations and error reduction of contacts (`contact_erp`)."""

    gravity: float
    surfaces: Mapping[str, Contact]
    between_free: Contact
    solver_iterations: int
    contact_erp: float
