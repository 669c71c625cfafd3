"""The edits of an order: adding, removing, pushing, setting, and the numbers that they write. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from math import isfinite
from typing import Annotated, Final
from zlib import crc32

from msgspec import Meta

from foosim.common import limits
from foosim.common.errors import Malformed
from foosim.common.struct_types import Message, Name, Vector
from foosim.world.component_types.descriptions import ABSENT, DOWN, NO_ENTITY, SAMPLES, SLOTS_MAX
from foosim.world.component_types.jobs import NUMBERS, STATES, JobState
from foosim.world.layout import Entity, Layout

FIELD_MAX: Final = 3 * limits.NAME_LENGTH_MAX
"""Characters of a field: the names of a component, of a modifier of it, and of a slot, and two points."""

PARKED_Z_M: Final = -1e6
PARKED_APART_M: Final = 100.0
PARKED_MAX: Final = 1 << 16
"""An absent entity is so far below the world that no component finds it there, at a place by its name: the same in any
world, and rarely that of another entity."""


class Add(Message, frozen=True):
    """Put an absent entity into the world: its slots become `numbers`."""

    name: Name
    numbers: Annotated[list[float], Meta(max_length=SLOTS_MAX)]


class Remove(Message, frozen=True):
    """Take an entity out of the world: it is absent."""

    name: Name


class Push(Message, frozen=True):
    """Give a free body an `impulse` (N s, world frame) at its centre of mass."""

    name: Name
    impulse: Vector


class Set(Message, frozen=True):
    """Write the numbers of a field of an entity.

    A robot whose `down` is 1 is out of service: it holds still, senses nothing, and no packet reaches it.
    """

    name: Name
    field: Annotated[str, Meta(min_length=1, max_length=FIELD_MAX)]
    numbers: Annotated[list[float], Meta(max_length=SLOTS_MAX)]


class Disrupt(Message, frozen=True):
    """Apply `event` (JSON as in a deployment, without a time) to the network: that of order k from frame k+1 on."""

    event: Annotated[str, Meta(max_length=limits.EVENT_BYTES_MAX)]


Edit = Add | Remove | Push | Set | Disrupt
Edits = Annotated[list[Edit], Meta(max_length=limits.ENTITIES_MAX)]


def fitting_edits(layout: Layout, numbers: Sequence[float], edits: Iterable[Edit]) -> Iterator[Edit]:
    """Yield the edits with an effect on a frame with these numbers, in their order: each fits the numbers after the
    earlier ones, if the caller applies them one after the other.

    No effect have: adding a present entity, any other edit of an absent one, pushing another entity than a free body,
    setting an unknown field or another count of numbers. Events of the network are the vHub's.
    """
    for edit in edits:
        if isinstance(edit, Disrupt) or edit.name not in layout:
            continue
        entity = layout[edit.name]
        if entity.is_absent(numbers) is not isinstance(edit, Add):
            continue
        if isinstance(edit, Add):
            is_fitting = entity.can_leave and len(edit.numbers) == entity.stop - entity.start
        elif isinstance(edit, Remove):
            is_fitting = entity.can_leave
        elif isinstance(edit, Set):
            is_fitting = entity.counts.get(edit.field) == len(edit.numbers)
        else:
            is_fitting = entity.is_free
        if is_fitting:
            yield edit


def written(layout: Layout, numbers: Sequence[float], edits: Iterable[Edit]) -> list[float]:
    """Return the numbers of a frame after edits, without pushes and without effects of an edit on other entities."""
    found = [*numbers]
    for edit in fitting_edits(layout, found, edits):
        write(layout, found, edit)
    return found


def write(layout: Layout, numbers: list[float], edit: Edit) -> None:
    """Write the numbers of a fitting edit to its entity's own slots."""
    if isinstance(edit, Disrupt | Push):
        return
    entity = layout[edit.name]
    if isinstance(edit, Set):
        at = entity.offsets[edit.field]
        numbers[at : at + len(edit.numbers)] = edit.numbers
        return
    counted = [(at, numbers[at]) for at in counters(entity)] + _jobs_known(entity, numbers)
    numbers[entity.start : entity.stop] = parked(layout, entity) if isinstance(edit, Remove) else edit.numbers
    for at, number in counted:
        numbers[at] = number


def _jobs_known(entity: Entity, numbers: Sequence[float]) -> list[tuple[int, float]]:
    """Return places and numbers of the jobs of a robot that comes or leaves: none of them begins again, and one that
    runs has failed."""
    found: list[tuple[int, float]] = []
    for field, at in entity.offsets.items():
        if at < entity.split and field.endswith((f".{NUMBERS}", f".{STATES}")):
            known = numbers[at : at + entity.counts[field]]
            if field.endswith(STATES):
                known = [float(JobState.FAILED) if state == JobState.RUNNING else state for state in known]
            found += enumerate(known, at)
    return found


def counters(entity: Entity) -> list[int]:
    """Return the places of the counters of an entity's samples: noise is drawn by them, so they never begin anew."""
    return [at for field, at in entity.offsets.items() if at >= entity.split and field.endswith(f".{SAMPLES}")]


def parked(layout: Layout, entity: Entity) -> list[float]:
    """Return the numbers of an entity that is absent."""
    found = [0.0] * (entity.stop - entity.start)
    for field, first, values in (
        (ABSENT, 0, (1.0,)),
        (DOWN, 0, (1.0,)),
        ("position", 0, (PARKED_APART_M * (1 + crc32(entity.name.encode()) % PARKED_MAX), 0.0, PARKED_Z_M)),
        ("orientation", 3, (1.0,)),
        ("contacts", 2, (-1.0,)),
    ):
        if field in entity.offsets:
            at = entity.offsets[field] - entity.start + first
            found[at : at + len(values)] = values
    for at in layout.references:
        if entity.start <= at < entity.stop:
            found[at - entity.start] = NO_ENTITY
    return found


def check_edits(edits: Sequence[Edit]) -> None:
    """Raise `Malformed` for an edit with a non-finite number: it would spoil a frame."""
    for change in edits:
        numbers: tuple[float, ...] = ()
        if isinstance(change, Push):
            numbers = change.impulse
        elif isinstance(change, Add | Set):
            numbers = tuple(change.numbers)
        if not all(isfinite(number) for number in numbers):
            raise Malformed(f"{type(change).__name__} with non-finite numbers: {numbers}")
