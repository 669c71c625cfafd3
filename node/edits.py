"""What an order does to frame k before it is solved: add, remove, push, freeze. Pure, evaluated by every node alike.

Neighbours: `rules` edits after the order; `step` goes on from the edited numbers.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite

from foosim.protocol.deployment import Deployment
from foosim.protocol.errors import Malformed
from foosim.protocol.frame import Frame, fitting_edits, layout_after
from foosim.protocol.layout import Entity, Layout
from foosim.protocol.messages import Add, Edit, Freeze, Push, Thaw
from foosim.protocol.start import place_ball


def edit(frame: Frame, edits: Sequence[Edit], deployment: Deployment) -> tuple[Layout, list[float]]:
    """Return layout and numbers of the edited frame; the order's edits apply in their order."""
    layout = layout_after(frame.layout, edits)
    numbers = frame.numbers.copy() if layout is frame.layout else _moved(frame, layout)
    for change in fitting_edits(frame.layout, edits) if edits else ():
        if isinstance(change, Add) and change.name in layout:
            place_ball(numbers, layout[change.name], change.position, change.velocity)
        elif isinstance(change, Push) and change.name in layout:
            _push(numbers, layout, change, deployment.table.ball.mass)
        elif isinstance(change, Freeze | Thaw):
            _take_out(numbers, layout[change.name], isinstance(change, Freeze))
    return layout, numbers


def check_edits(edits: Sequence[Edit]) -> None:
    """Raise `Malformed` for an edit with a number that is not finite: it would spoil a frame."""
    for change in edits:
        numbers: tuple[float, ...] = ()
        if isinstance(change, Add):
            numbers = (*change.position, *change.velocity)
        elif isinstance(change, Push):
            numbers = change.impulse
        if not all(isfinite(number) for number in numbers):
            raise Malformed(f"{type(change).__name__} with numbers that are not finite: {numbers}")


def _moved(frame: Frame, layout: Layout) -> list[float]:
    """Return a frame's numbers in another layout; entities that are new there are zero."""
    numbers = [0.0] * layout.size
    for entity in layout.entities:
        if entity.name in frame.layout:
            old = frame.layout[entity.name]
            numbers[entity.start : entity.stop] = frame.numbers[old.start : old.stop]
    return numbers


def _push(numbers: list[float], layout: Layout, push: Push, mass: float) -> None:
    """Change the velocity by impulse / mass."""
    start = layout[push.name].offsets["linear_velocity"]
    for axis, impulse in enumerate(push.impulse):
        numbers[start + axis] += impulse / mass


def _take_out(numbers: list[float], robot: Entity, is_down: bool) -> None:
    """Mark a robot as out of service or back in it; what it wants from now on is to be where it is, or to stand."""
    numbers[robot.offsets["down"]] = float(is_down)
    wanted = robot.offsets.get("wanted")
    if wanted is not None:
        position = robot.offsets.get("joint_positions")
        numbers[wanted : wanted + 2] = [0.0, 0.0] if position is None else numbers[position : position + 2]
