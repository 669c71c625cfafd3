"""The contacts of a body's links in a tick: its field `touches` and the fields beside it."""

from __future__ import annotations

from collections.abc import Sequence
from math import fsum
from operator import itemgetter

from foosim.world.component_types.descriptions import NO_ENTITY, TOUCHES_MAX
from foosim.world.layout import Entity


class _Met:
    """The contact of a link with a partner: a bit for each substep with one, the impulses (N s), and the place in the
    first of these substeps where the impulse was the strongest."""

    __slots__ = ("impulses", "place", "strongest", "substeps")

    def __init__(self) -> None:
        self.impulses: list[float] = []
        self.place = self.strongest = 0.0
        self.substeps = 0


class TouchLog:
    """The contacts of one body in one tick.

    Any order of adding gives the same bits.
    """

    __slots__ = ("_met",)

    def __init__(self) -> None:
        self._met: dict[tuple[int, int], _Met] = {}

    def add(self, partner: int, link: int, place: float, impulse: float, substep: int) -> None:
        """Note a point of contact of a link with an entity, by their indices. `place` is in m, `impulse` in N s.

        Substeps are added in their order.
        """
        met = self._met.get((partner, link))
        if met is None:
            met = self._met[partner, link] = _Met()
        is_first = met.substeps in (0, 1 << substep)
        if is_first and (impulse, -place) > (met.strongest, -met.place):
            met.place, met.strongest = place, impulse
        met.impulses.append(impulse)
        met.substeps |= 1 << substep

    def write(self, entity: Entity, numbers: list[float], substeps: int) -> None:
        """Write the fields of the body, which have those of the tick before.

        Of too many contacts those with the greatest impulses are kept, in the order in which they began.
        """
        if not self._met and numbers[entity.offsets["touch_partners"]] == NO_ENTITY:
            return  # as it is there
        before = _lasting(entity, numbers, substeps)
        clear_touches(entity, numbers)
        began, found = 0, []
        for (partner, link), met in self._met.items():
            is_lasting = (float(partner), float(link)) in before
            began += (met.substeps & ~(met.substeps << 1 | is_lasting)).bit_count()
            first = (met.substeps & -met.substeps).bit_length() - 1
            found.append((-fsum(met.impulses), first, partner, link, met))
        kept = sorted(found, key=itemgetter(0, 2, 3))[:TOUCHES_MAX]
        at = entity.offsets
        numbers[at["touches"]] = float(began)
        for row, (impulse, first, partner, link, met) in enumerate(sorted(kept, key=itemgetter(1, 2, 3))):
            numbers[at["touch_partners"] + row] = float(partner)
            numbers[at["touch_links"] + row] = float(link)
            numbers[at["touch_places"] + row] = met.place
            numbers[at["touch_starts"] + row] = float(first)
            numbers[at["touch_ends"] + row] = float(met.substeps.bit_length() - 1)
            numbers[at["touch_impulses"] + row] = -impulse


def _lasting(entity: Entity, numbers: Sequence[float], substeps: int) -> list[tuple[float, float]]:
    """Return partner and link of the contacts in the last substep of the tick before."""
    partners, links, ends = (entity.offsets[name] for name in ("touch_partners", "touch_links", "touch_ends"))
    return [
        (numbers[partners + row], numbers[links + row])
        for row in range(TOUCHES_MAX)
        if numbers[partners + row] != NO_ENTITY and numbers[ends + row] == substeps - 1.0
    ]


def clear_touches(entity: Entity, numbers: list[float]) -> None:
    """Clear the log of a body with `touches`."""
    at = entity.offsets
    numbers[at["touches"]] = 0.0
    start = at["touch_partners"]
    numbers[start : start + TOUCHES_MAX] = [NO_ENTITY] * TOUCHES_MAX
    for name in ("touch_links", "touch_places", "touch_starts", "touch_ends", "touch_impulses"):
        numbers[at[name] : at[name] + TOUCHES_MAX] = [0.0] * TOUCHES_MAX
