"""The edits of an order: what adds, removes, pushes and sets, and the layout after them. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from typing import Annotated, Final

from msgspec import Meta

from foosim.common import limits
from foosim.common.errors import Malformed
from foosim.common.struct_types import Message, Name, Vector
from foosim.world.forms.forms import SLOTS_MAX
from foosim.world.layout import Layout

FIELD_MAX: Final = 3 * limits.NAME_LENGTH_MAX
"""Characters of a field: the names of a component, of a modifier of it, and of a slot, and two points."""


class Add(Message, frozen=True):
    """Add entity `name` of `model` at `position` (m, world frame) with `velocity` (m/s)."""

    name: Name
    model: Name
    position: Vector
    velocity: Vector


class Remove(Message, frozen=True):
    """Remove an entity that was added."""

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
    """Do to the network what `event` (JSON as in a deployment, without a time) says: order k's, from frame k+1 on."""

    event: Annotated[str, Meta(max_length=limits.EVENT_BYTES_MAX)]


Edit = Add | Remove | Push | Set | Disrupt
Edits = Annotated[list[Edit], Meta(max_length=limits.ENTITIES_MAX)]


def fitting_edits(layout: Layout, edits: Sequence[Edit]) -> list[Edit]:
    """Return the edits that do something to a world with this layout, in their order.

    An addition of a name that is taken, or of a model of which the world cannot have more, the removal of what was not
    added, a push of what is no free body and a field that an entity has not, or not of so many numbers, change nothing,
    and what happens to the network is the vHub's: a function of the order alone, the same for all who read it.
    """
    models = dict(layout.models)
    addable, declared = layout.declared.addable, layout.declared.names
    fitting: list[Edit] = []
    for edit in edits:
        if isinstance(edit, Disrupt):
            continue
        if isinstance(edit, Add):
            if edit.name in models or edit.model not in addable:
                continue
            models[edit.name] = edit.model
        elif isinstance(edit, Remove):
            if edit.name in declared or edit.name not in models:
                continue
            del models[edit.name]
        elif edit.name not in models:
            continue
        elif isinstance(edit, Set):
            if edit.name not in layout or layout[edit.name].counts.get(edit.field) != len(edit.numbers):
                continue
        elif not layout.would_be_free(edit.name, models[edit.name]):
            continue
        fitting.append(edit)
    return fitting


def layout_after(layout: Layout, edits: Sequence[Edit]) -> Layout:
    """Return the layout of frame k+1 when order k carries `edits`."""
    if not edits:
        return layout
    models = dict(layout.models)
    for edit in fitting_edits(layout, edits):
        if isinstance(edit, Add):
            models[edit.name] = edit.model
        elif isinstance(edit, Remove):
            del models[edit.name]
    return layout if models == layout.models else Layout(models, layout.declared)


def removed(layout: Layout, edits: Sequence[Edit]) -> frozenset[str]:
    """Return the names of what an order removes. What it adds under one of them is another entity."""
    if not edits:
        return frozenset()
    return frozenset(edit.name for edit in fitting_edits(layout, edits) if isinstance(edit, Remove))


def written(layout: Layout, numbers: Sequence[float], edits: Sequence[Edit]) -> list[float]:
    """Return the numbers of a frame with the fields that edits set."""
    found = [*numbers]
    for edit in edits:
        if isinstance(edit, Set) and edit.name in layout:
            at = layout[edit.name].offsets[edit.field]
            found[at : at + len(edit.numbers)] = edit.numbers
    return found


def check_edits(edits: Sequence[Edit]) -> None:
    """Raise `Malformed` for an edit with a number that is not finite: it would spoil a frame."""
    for change in edits:
        numbers: tuple[float, ...] = ()
        if isinstance(change, Add):
            numbers = (*change.position, *change.velocity)
        elif isinstance(change, Push):
            numbers = change.impulse
        elif isinstance(change, Set):
            numbers = tuple(change.numbers)
        if not all(isfinite(number) for number in numbers):
            raise Malformed(f"{type(change).__name__} with numbers that are not finite: {numbers}")
