"""Descriptions of edits of a run's world: entities that were added, removed, pushed, set, robots that were moved."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

from foosim.capture.rows import EditRow, EpochRow
from foosim.world.forms.forms import DOWN
from foosim.world.setting.settable import WITH_A_PLACE


def edit_text(edit: EditRow) -> str:
    """Return a description of a requested edit; empty for other edits."""
    if edit.kind == "push":
        return f"push {edit.name} by {_vector(edit.impulse)} N s"
    if edit.kind == "set":
        return _set_text(edit)
    return {"add": f"{edit.name} was added", "remove": f"{edit.name} was removed"}.get(edit.kind, "")


def _set_text(edit: EditRow) -> str:
    """Return a description of a field that is set; empty for what comes with a place."""
    if edit.field == DOWN:
        return f"{edit.name} is {'in' if edit.numbers == [0.0] else 'out of'} service"
    if edit.field == "position":
        return f"put {edit.name} at {_vector(edit.numbers)} m"
    return "" if edit.field in WITH_A_PLACE else f"set {edit.name} {edit.field} to {_vector(edit.numbers)}"


def _vector(numbers: Sequence[float]) -> str:
    return ", ".join(f"{number:g}" for number in numbers)


def moves(epochs: Sequence[EpochRow]) -> Iterator[tuple[int, str]]:
    """Yield (tick, text) of each robot that was moved from one node to another while both took part.

    What another node adopts when its own is lost, and what goes back, is told by the recoveries.
    """
    for before, epoch in pairwise(epochs):
        owned = {owner.robot: owner.node for owner in before.owners}
        for owner in epoch.owners:
            node = owned.get(owner.robot, owner.node)
            if node != owner.node and node in epoch.roster and owner.node in before.roster:
                yield epoch.tick, f"move {owner.robot} from {node} to {owner.node}"
