"""How a frame is edited before it is solved. Pure, and evaluated by every node alike."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any

from foosim.world.assembly.world import body_of, model_of
from foosim.world.components.fitted import actuators_of
from foosim.world.components.view import WritableView, called
from foosim.world.edits import Add, Edit, Push, Set, fitting_edits, layout_after, removed
from foosim.world.forms.forms import DOWN, NO_ENTITY
from foosim.world.frame import Frame
from foosim.world.layout import Entity, Layout
from foosim.world.spec import WorldSpec


def edit(frame: Frame, edits: Sequence[Edit], spec: WorldSpec) -> tuple[Layout, list[float]]:
    """Return layout and numbers of the edited frame; the order's edits apply in their order."""
    if not edits:
        return frame.layout, frame.numbers.copy()
    layout, gone = layout_after(frame.layout, edits), removed(frame.layout, edits)
    numbers = frame.numbers.copy() if layout is frame.layout and not gone else _moved(frame, layout, gone)
    view = WritableView(frame.tick, numbers)
    for change in fitting_edits(frame.layout, edits):
        if isinstance(change, Add) and change.name in layout:
            made: Any = model_of(spec, layout, layout[change.name])
            what = f"model {change.model}"
            called(what, change.name, view.tick, made.place_at, view, change.position, change.velocity)
        elif isinstance(change, Push) and change.name in layout:
            _push(numbers, layout, change, spec)
        elif isinstance(change, Set) and change.name in layout:
            entity = layout[change.name]
            at = entity.offsets[change.field]
            numbers[at : at + len(change.numbers)] = change.numbers
            if change.field == DOWN and entity.is_robot:
                _hold(view, numbers, spec, layout, entity)
    return layout, numbers


def _moved(frame: Frame, layout: Layout, gone: Collection[str]) -> list[float]:
    """Return a frame's numbers in another layout; entities that are new there are zero, as under a name of one gone.

    References follow their entities; those to entities that are gone become -1.
    """
    numbers = [0.0] * layout.size
    for entity in layout.entities:
        if entity.name in frame.layout and entity.name not in gone:
            old = frame.layout[entity.name]
            numbers[entity.start : entity.stop] = frame.numbers[old.start : old.stop]
        else:
            for place in layout.references:
                if entity.start <= place < entity.stop:
                    numbers[place] = NO_ENTITY
    for place in layout.references:
        numbers[place] = moved_reference(numbers[place], frame.layout, layout, gone)
    return numbers


def moved_reference(reference: float, old: Layout, new: Layout, gone: Collection[str]) -> float:
    """Return a reference to an entity in another layout, -1 where the entity is gone."""
    if not 0.0 <= reference < len(old.entities):
        return NO_ENTITY
    name = old.entities[int(reference)].name
    return float(new[name].index) if name in new and name not in gone else NO_ENTITY


def _push(numbers: list[float], layout: Layout, push: Push, spec: WorldSpec) -> None:
    """Change the velocity of a free body by impulse / mass."""
    entity = layout[push.name]
    start, mass = entity.offsets["linear_velocity"], body_of(spec, layout, entity).links[0].mass
    for axis, impulse in enumerate(push.impulse):
        numbers[start + axis] += impulse / mass


def _hold(view: WritableView, numbers: list[float], spec: WorldSpec, layout: Layout, robot: Entity) -> None:
    """Have the actuators of a robot that goes out of service, or comes back, hold it where it is."""
    for one in actuators_of(spec, layout, robot):
        called(f"actuator {one.channel}", robot.name, view.tick, one.actuator.hold, view)
        for field, at in robot.offsets.items():
            if field.startswith(f"{one.channel}.") and field.count(".") > 1:  # a modifier's: what waits is out of date
                numbers[at : at + robot.counts[field]] = [0.0] * robot.counts[field]
