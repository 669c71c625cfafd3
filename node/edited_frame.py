"""The edits of a frame before it is solved. Pure, and evaluated by every node alike."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from foosim.world.assembly.grippers import grippers_of, release
from foosim.world.assembly.world import body_of
from foosim.world.component_types.descriptions import DOWN, INACTIVE, NO_ENTITY
from foosim.world.components.fitted import actuators_of
from foosim.world.components.view import WritableView, called
from foosim.world.edits import Add, Edit, Push, Remove, Set, counters, fitting_edits, write
from foosim.world.frame import Frame
from foosim.world.layout import Entity, Layout, switches_of
from foosim.world.spec import WorldSpec


def edit(frame: Frame, edits: Sequence[Edit], spec: WorldSpec) -> tuple[list[float], list[Entity]]:
    """Return the numbers of the edited frame, and the entities that came or left; edits apply in their order."""
    layout, numbers = frame.layout, frame.numbers.copy()
    moved = []
    for change in fitting_edits(layout, numbers, edits):
        assert isinstance(change, Add | Remove | Push | Set), "the network is the vHub's"
        entity = layout[change.name]
        switched = 0 if INACTIVE not in entity.offsets else int(numbers[entity.offsets[INACTIVE]])
        write(layout, numbers, change)
        if isinstance(change, Push):
            _push(numbers, layout, change, spec)
        elif isinstance(change, Set):
            if entity.is_robot and change.field in (DOWN, INACTIVE):
                those = -1 if change.field == DOWN else switched ^ int(change.numbers[0])
                _hold(WritableView(frame.tick, numbers), numbers, spec, layout, entity, those)
            elif change.field == "position":
                release(grippers_of(spec, layout), numbers, entity)
        else:
            moved.append(entity)
            for place in layout.references:
                if numbers[place] == entity.index and not entity.start <= place < entity.stop:
                    numbers[place] = NO_ENTITY
    return numbers, moved


def kept(sensed: Mapping[int, float], moved: Iterable[Entity]) -> dict[int, float]:
    """Return the sensors' new slots of a frame, by place, without robots that came or left; counters continue."""
    gone = {at for robot in moved for at in {*range(robot.split, robot.stop)}.difference(counters(robot))}
    return {at: number for at, number in sensed.items() if at not in gone}


def _push(numbers: list[float], layout: Layout, push: Push, spec: WorldSpec) -> None:
    """Change the velocity of a free body by impulse / mass."""
    entity = layout[push.name]
    start, mass = entity.offsets["linear_velocity"], body_of(spec, layout, entity).links[0].mass
    for axis, impulse in enumerate(push.impulse):
        numbers[start + axis] += impulse / mass


def _hold(view: WritableView, numbers: list[float], spec: WorldSpec, layout: Layout, robot: Entity, those: int) -> None:
    """Let actuators that go out of service, or come back, hold a robot at its place: `those` are their bits."""
    bits = switches_of(spec.robots[robot.name])
    for one in actuators_of(spec, layout, robot):
        if not bits[one.channel] & those:
            continue
        called(f"actuator {one.channel}", robot.name, view.tick, one.actuator.hold, view)
        if one.jobs is not None:
            one.jobs.drop(view)
        for field, at in robot.offsets.items():
            if field.startswith(f"{one.channel}.") and field.count(".") > 1:  # of a modifier: outdated
                numbers[at : at + robot.counts[field]] = [0.0] * robot.counts[field]
