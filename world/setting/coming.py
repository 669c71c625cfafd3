"""Entities that can come into a world and leave it, by the name in a command."""

from __future__ import annotations

import re
from collections.abc import Sequence
from operator import itemgetter
from typing import Final

from foosim.common.errors import Refused, UnknownName
from foosim.world.layout import Entity, Layout

_NUMBERED: Final = re.compile(r"(?P<fleet>.+)-(?P<number>[0-9]+)")


def absent_named(layout: Layout, numbers: Sequence[float], name: str) -> Entity:
    """Return the absent entity of this name, or the first absent one of the fleet of this name.

    Raises Refused where nothing of that name is absent.
    """
    if name in layout and layout[name].is_absent(numbers):
        return layout[name]
    fleet = sorted(_numbered(layout, name), key=itemgetter(0))
    absent = [entity for _, entity in fleet if entity.is_absent(numbers)]
    if absent:
        return absent[0]
    if fleet:
        spares, one = sum(entity.name in layout.spares for _, entity in fleet), fleet[0][1]
        key = f"section {one.kind.kit}" if one.kind.kit else f"{'robots' if one.is_robot else 'objects'}.{name}"
        why = f"all {len(fleet)} of the deployment are in the world, and {key} declares {spares} spares"
        raise Refused(f"no {name} is left to add: {why}")
    if name not in layout:
        stems = {found["fleet"] for entity in layout.entities if (found := _NUMBERED.fullmatch(entity.name))}
        known = [entity.name for entity in layout.entities if entity.can_leave]
        raise Refused(UnknownName("no entity to add", name, [*known, *sorted(stems)]).what)
    raise Refused(f"{name} is in the world already" if layout[name].can_leave else _always(name))


def _numbered(layout: Layout, name: str) -> list[tuple[int, Entity]]:
    found = [(_NUMBERED.fullmatch(entity.name), entity) for entity in layout.entities if entity.can_leave]
    return [(int(match["number"]), entity) for match, entity in found if match is not None and match["fleet"] == name]


def check_present(layout: Layout, numbers: Sequence[float], name: str) -> None:
    """Raise Refused for an entity that cannot be removed: it is absent, or always in the world."""
    if name not in layout:
        known = [entity.name for entity in layout.entities if entity.can_leave and not entity.is_absent(numbers)]
        raise Refused(UnknownName("nothing to remove", name, known).what)
    if not layout[name].can_leave:
        raise Refused(_always(name))
    if layout[name].is_absent(numbers):
        raise Refused(f"{name} is absent already")


def _always(name: str) -> str:
    return f"{name} is always in the world: fixed entities and entities of a kit neither come nor go"
