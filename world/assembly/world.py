"""A deployment's world in the frames of one layout: its models, rules, motions and actuators."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from math import isfinite
from typing import Any, Final, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from foosim.common.keyed_random import draw_key
from foosim.world.assembly.event_times import events_by_tick
from foosim.world.component_types.descriptions import NO_ENTITY, overrides
from foosim.world.component_types.failures import ContractError, failure_of
from foosim.world.components.base import EntityRule, Model, Motion, Rule
from foosim.world.components.drives import FREE, NO_DRIVES, Drives, Motor, Wrench, added
from foosim.world.components.entities import Marked, MarkKind, MotionMounting, Motors, RuleMounting, mounting_of
from foosim.world.components.fitted import BoundActuator, actuators_of
from foosim.world.components.view import (
    ComponentError,
    Mounting,
    View,
    WritableView,
    called,
    component_error,
    has_together,
    some_together,
)
from foosim.world.components.watching import guarded, guarded_actuator
from foosim.world.edits import parked
from foosim.world.fixed_scenery import fixed_shapes, kits_of
from foosim.world.frame import Frame
from foosim.world.layout import WORLD, Entity, Layout
from foosim.world.scene import Body, Scene
from foosim.world.spec import WorldSpec

NO_FORCE: Final = (0.0, 0.0)
"""The set-point of the motor of a joint without a drive."""
NO_STATUS: Final = "no status of"
NO_TEXT: Final = "no text of"
FAILED: Final = "failed"
"""The kind of the mark of a rule whose own marks failed."""
FAILED_LOOK: Final = MarkKind("lost", "components that failed")
EVENT: Final = "event"
EVENT_LOOK: Final = MarkKind("away", "events of the world", is_cut=True)
TOGETHER_MIN: Final = 32
"""The least count of actuators that are called together: fewer take less time one after the other."""


_Alike: TypeAlias = tuple[type[Motion], type[Any]]
"""A motion, and a class of actuators."""


class _Moving(NamedTuple):
    """Entities that are solved in a tick, and their groups by motion, each with the `together` object of its actuators,
    or None where each actuator is called by itself."""

    entities: list[Entity]
    groups: list[tuple[type[Motion], list[Entity], Any]]


def model_of(spec: WorldSpec, layout: Layout, entity: Entity) -> Model:
    """Return an entity as its model. Raises ComponentError."""
    settings, at = spec.settings_of(entity.name), mounting_of(spec, layout, entity)
    model: Model = called(f"model {entity.model}", entity.name, 0, entity.kind.factory, settings, at)
    return model


def models_of(spec: WorldSpec, layout: Layout) -> dict[int, Model]:
    """Return the entities of a layout as their models, by index; the world itself has none. Raises ComponentError."""
    return {entity.index: model_of(spec, layout, entity) for entity in layout.entities if entity.name != WORLD}


def body_of(spec: WorldSpec, layout: Layout, entity: Entity) -> Body:
    """Return the body of an entity that has one. Raises ComponentError."""
    body = called(f"model {entity.model}", entity.name, 0, model_of(spec, layout, entity).body)
    assert body is not None, entity
    return body


def rules_of(spec: WorldSpec, layout: Layout) -> dict[str, Rule]:
    """Return the rules of a world by name, in name order. Raises ComponentError."""
    rules: dict[str, Rule] = {}
    for label, settings in spec.world_rules.items():
        found = settings.component_type
        at = RuleMounting(spec, layout, label, draw_key(spec.seed, "rule", label), frozenset(found.writes))
        rules[label] = called(f"rule {label}", WORLD, 0, found.factory, settings, at)
    return rules


def build_scene(spec: WorldSpec, layout: Layout) -> Scene:
    """Return the scene of a layout's bodies in the deployment's world. Raises ComponentError."""
    bodies: dict[str, Body] = {}
    for index, model in models_of(spec, layout).items():
        entity = layout.entities[index]
        body = called(f"model {entity.model}", entity.name, 0, model.body)
        if body is not None:
            bodies[entity.name] = body
    return Scene(bodies, (*fixed_shapes(spec), *spec.scenery_shapes()))


def initial_numbers(
    spec: WorldSpec, layout: Layout, models: Mapping[int, Model] | None = None, *, is_guarded: bool = False
) -> list[float]:
    """Return the numbers of a world at tick 0: each entity as its model places it, then the numbers of its rules,
    then those of the rules of the world; spares are parked.

    `models` are those of the layout where they exist already. `is_guarded`: rules that write to them otherwise than
    by their views are errors (`watching`). Raises ComponentError.
    """
    numbers = [0.0] * layout.size
    for place in layout.references:
        numbers[place] = NO_ENTITY
    view = WritableView(0, numbers)
    for index, model in (models_of(spec, layout) if models is None else models).items():
        entity = layout.entities[index]
        called(f"model {entity.model}", entity.name, 0, model.place, view)
    for robot in layout.robots:
        for label, own in entity_rules_of(spec, layout, robot, "place"):
            called(f"rule {label}", robot.name, 0, (guarded(own) if is_guarded else own).place, view)
    for label, rule in rules_of(spec, layout).items():
        called(f"rule {label}", WORLD, 0, (guarded(rule) if is_guarded else rule).place, view)
    for name in layout.spares:
        entity = layout[name]
        numbers[entity.start : entity.stop] = parked(layout, entity)
    return numbers


def world_status(spec: WorldSpec, frame: Frame) -> dict[str, Any]:
    """Return the status of rules and kits in a frame, and its counts of clamped and refused commands, as JSON."""
    status: dict[str, Any] = {"commands": count_commands(frame)}
    for what, one, seen in with_status(spec, frame):
        try:
            status |= status_of(one, seen)
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # noqa: BLE001  # a run continues without it
            status |= {"failed": f"{NO_STATUS} {what}: {failure_of(error)}"}
    return status


def status_numbers(status: Mapping[str, Any], start: str = "") -> dict[str, float | None]:
    """Return the numbers of a status, named by their keys joined by dots. A boolean is 0 or 1.

    None stands for infinity and NaN.
    """
    found: dict[str, float | None] = {}
    for key, value in status.items():
        if isinstance(value, Mapping):
            found |= status_numbers(value, f"{start}{key}.")
        elif isinstance(value, bool | int | float):
            found[f"{start}{key}"] = None if isinstance(value, float) and not isfinite(value) else value + 0
    return found


def with_status(spec: WorldSpec, frame: Frame) -> list[tuple[str, Any, Any]]:
    """Return the label of each rule of the world and each kit, the object, and what its `status` reads."""
    view = View(frame.tick, frame.numbers)
    rules = [(f"rule {name}", rule, view) for name, rule in rules_of(spec, frame.layout).items()]
    return [*rules, *((f"kit {name}", kit, frame) for name, kit in kits_of(spec))]


def status_of(one: Any, seen: Any) -> Mapping[str, Any]:
    """Return the status of a rule or kit. Raises ContractError for another type."""
    status = one.status(seen)
    if not isinstance(status, Mapping):
        raise ContractError(one.status, "a mapping of names to JSON values", status)
    return status


def count_commands(frame: Frame) -> dict[str, int]:
    """Return the counts of commands that the robots of a frame have clamped and refused."""
    robots, values = frame.layout.robots, frame.values
    return {key: int(sum(values[robot.offsets[key]] for robot in robots)) for key in ("clamped", "refused")}


def world_texts(spec: WorldSpec, status: Mapping[str, Any]) -> list[str]:
    """Return in words the status of rules and kits, and the counts of clamped and refused commands, by the result of
    `world_status`."""
    made: list[Any] = [settings.component_type.factory for settings in spec.world_rules.values()]
    made += [kit.factory for kit in spec.kit_types.values()]
    found = [status["failed"]] if "failed" in status else []
    for one in dict.fromkeys(made):
        try:
            found.append(one.text(status))
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # noqa: BLE001  # without its part of the status, for one
            found.append(f"{NO_TEXT} {one.__qualname__}: {failure_of(error)}")
    found += [f"commands {fate} {count}" for fate, count in status.get("commands", {}).items() if count]
    return [text for text in found if text]


def mark_kinds(spec: WorldSpec) -> dict[str, MarkKind]:
    """Return the kinds of the marks of rules, by name."""
    made: list[Any] = [settings.component_type.factory for settings in spec.world_rules.values()]
    made += [rule.component_type.factory for _, robot in sorted(spec.robots.items()) for rule in robot.rules.values()]
    own = {name: kind for one in dict.fromkeys(made) for name, kind in one.mark_kinds.items()}
    return {FAILED: FAILED_LOOK, **({EVENT: EVENT_LOOK} if spec.events else {}), **own}


class WorldMarks:
    """The marks of a world's rules between frames."""

    def __init__(self, spec: WorldSpec, layout: Layout) -> None:
        self._rules: dict[tuple[str, str], Any] = {
            (WORLD, label): rule for label, rule in rules_of(spec, layout).items() if overrides(type(rule), "marks")
        }
        self._rules |= {
            (robot.name, label): rule
            for robot in layout.robots
            for label, rule in entity_rules_of(spec, layout, robot, "marks")
        }
        """By entity and name: those of the world first."""
        self._events = events_by_tick(spec)

    def between(self, before: Frame, after: Frame) -> list[Marked]:
        """Return the marks after one frame, up to a later one.

        A rule that raises, or returns something else than marks, is left out from then on, with a mark.
        """
        found: list[Marked] = []
        if self._events:
            ticks = [tick for tick in self._events if before.tick <= tick < after.tick]
            found += [(tick + 1, EVENT, event.text) for tick in sorted(ticks) for event in self._events[tick]]
        for (entity, label), rule in [*self._rules.items()]:
            try:
                found += called(f"marks of rule {label}", entity, after.tick, _marks_of, rule, before, after)
            except ComponentError as error:
                del self._rules[entity, label]
                found.append((after.tick, FAILED, str(error)))
        return found


def _marks_of(rule: Any, before: Frame, after: Frame) -> list[Marked]:
    found = [*rule.marks(before, after)]
    for mark in found:
        if not (isinstance(mark, tuple) and [*map(type, mark)] == [int, str, str]):
            raise ContractError(rule.marks, "a mark (tick, kind, text)", mark)
    return found


class World:
    """The computation of one layout's ticks, except the engine. Raises ComponentError for a component that raises."""

    def __init__(self, spec: WorldSpec, layout: Layout, *, is_guarded: bool = False) -> None:
        """`is_guarded`: components that write to the frame otherwise than by their views are errors (`watching`)."""
        self._spec, self._layout = spec, layout
        self.models: dict[int, Model] = models_of(spec, layout)
        self._rules = rules_of(spec, layout)
        self.has_rules = bool(self._rules)
        fitted = {robot.index: actuators_of(spec, layout, robot) for robot in layout.robots}
        self.actuators: Mapping[int, tuple[BoundActuator, ...]] = {
            index: actuators for index, actuators in fitted.items() if actuators
        }
        """The actuators of each robot with some, by the entity's index."""
        self._only = {index: its[0] for index, its in fitted.items() if len(its) == 1 and its[0].joints is None}
        """The actuators that alone command all motors of their robots, by the entity's index."""
        self._motions = _motions_of(spec, layout)
        self._moving = _Moving([], [])
        rules = {robot.index: entity_rules_of(spec, layout, robot) for robot in layout.robots}
        self._entity_rules = {index: its for index, its in rules.items() if its}
        self.ruled = frozenset(self._entity_rules)
        """Entities that have rules of their own, by their indices."""
        self.having_jobs = frozenset(
            [index for index, its in self.actuators.items() if any(one.jobs is not None for one in its)]
        )
        """Entities whose actuators may have jobs, by their indices."""
        self._powers: dict[int, list[tuple[str, Any]]] = {}
        """The rules with a switch of an entity's power, by its index."""
        for index, its in self._entity_rules.items():
            for label, rule in its:
                if overrides(type(rule), "has_power"):
                    self._powers.setdefault(index, []).append((label, rule))
        self._alike: dict[_Alike, list[Any]] = {}
        """The actuators that can be called together."""
        self._rows: dict[int, tuple[_Alike, int]] = {}
        """The row of a robot's actuator in these, by the entity's index."""
        self._joined: dict[_Alike, Any] = {}
        """The `together` object of all of them, where it was needed."""
        for index, one in () if is_guarded else self._only.items():
            motion = layout.entities[index].kind.motion
            if motion is None or not motion.takes_arrays:
                continue
            key = motion, type(one.actuator)
            if index not in self._powers and has_together(key[1], "command"):
                members = self._alike.setdefault(key, [])
                self._rows[index] = key, len(members)
                members.append(one.actuator)
        own = {index: type(model) for index, model in self.models.items()}
        if is_guarded:
            self._guard()
        self._checks: Mapping[int, Callable[[Sequence[float], Sequence[float]], bool]] = {
            index: self.models[index].is_plausible for index, kind in own.items() if overrides(kind, "is_plausible")
        }
        self._derive: Mapping[int, Callable[[WritableView], None]] = {
            entity.index: self.models[entity.index].derive
            for entity in layout.entities
            if entity.is_rigid and overrides(own[entity.index], "derive")
        }

    def _guard(self) -> None:
        """Give all components read-only numbers of the frame."""
        self.models = {index: guarded(model) for index, model in self.models.items()}
        self._rules = {label: guarded(rule) for label, rule in self._rules.items()}
        self.actuators = {index: tuple(map(guarded_actuator, its)) for index, its in self.actuators.items()}
        self._only = {index: self.actuators[index][0] for index in self._only}
        self._motions = {kind: guarded(motion) for kind, motion in self._motions.items()}
        self._entity_rules = {
            index: tuple((label, guarded(rule)) for label, rule in its) for index, its in self._entity_rules.items()
        }

    def apply_rules(self, numbers: list[float], tick: int) -> None:
        """Edit a frame's numbers by the rules of the world, in name order, with all their state in the frame."""
        view = WritableView(tick, numbers)
        for label, rule in self._rules.items():
            try:
                rule.apply(view)
            except BaseException as error:
                raise component_error(f"rule {label}", WORLD, tick, error) from error

    def move(
        self,
        entities: Sequence[Entity],
        start: Sequence[float],
        numbers: list[float],
        tick: int,
        values: NDArray[np.float64] | None = None,
    ) -> None:
        """Move these entities, as far as their models have motions.

        `start` are the numbers at the tick's start, `values` the same as an array where there is one already.
        """
        if self._moving.entities != entities:
            groups = [(kind, moved, self._together(kind, moved)) for kind, moved in _by_motion(entities).items()]
            self._moving = _Moving(list(entities), groups)
        if not self._moving.groups:
            return
        view, driving = WritableView(tick, start, None, numbers, values), View(tick, numbers, start=start)
        for kind, moved, together in self._moving.groups:
            commands: Any = (
                self.motors(moved, driving)
                if together is None
                else commands_together(f"actuators of the motion {kind.__name__}", together, len(moved), driving)
            )
            try:
                self._motions[kind].move(moved, commands, view)
            except BaseException as error:
                if not isinstance(error, KeyboardInterrupt) and together is None:
                    self.check_motors(moved, commands, tick)
                raise component_error(f"motion {kind.__name__}", "", tick, error) from error

    def _together(self, motion: type[Motion], entities: Sequence[Entity]) -> Any:
        """Return the `together` object of these entities' actuators; None where each is called by itself."""
        found = [self._rows.get(entity.index) for entity in entities]
        rows = [one for one in found if one is not None]
        if len(rows) < max(TOGETHER_MIN, len(found)) or len({key for key, _ in rows}) > 1:
            return None
        what, (key, _) = f"actuators of the motion {motion.__name__}", rows[0]
        members = self._alike[key]
        if key not in self._joined:
            self._joined[key] = called(what, "", 0, type(members[0]).together, members)
        return some_together(what, 0, self._joined[key], members, np.array([row for _, row in rows]))

    def motors(self, entities: Iterable[Entity], view: View) -> list[Motors]:
        """Return the set-points of the motors of each of these entities, in the order of their actuators' channels."""
        found: list[Motors] = []
        for entity in entities:
            one = self._only.get(entity.index)
            if one is None or (entity.index in self._powers and not self._has_power(entity, view)):
                found.append(self._motors_of_several(entity, view))
                continue
            try:
                found.append(one.actuator.command(view))
            except BaseException as error:
                raise one.failed(view.tick, error) from error
        return found

    def drives(self, entities: Iterable[Entity], view: View) -> tuple[Drives, ...]:
        """Return the set-points of the motors and the wrench on the base of each of these rigid bodies."""
        return tuple([self._drives(entity, view) for entity in entities])

    def _drives(self, entity: Entity, view: View) -> Drives:
        fitted = self.actuators.get(entity.index)
        if fitted is None:
            return NO_DRIVES
        motors = [FREE] * entity.counts.get("joint_positions", 0)
        wrench: Wrench | None = None
        has_power = self._has_power(entity, view)
        for one in fitted:
            try:
                commands = one.actuator.command(view) if has_power else _without_power(one, view)
                joints = range(len(commands)) if one.joints is None else one.joints
                for joint, motor in zip(joints, commands, strict=True):
                    motors[joint] = Motor(*motor)
                if has_power and (force := one.actuator.wrench(view)) is not None:
                    wrench = added(wrench, force)
            except BaseException as error:
                raise one.failed(view.tick, error) from error
        return Drives(tuple(motors), wrench)

    def _has_power(self, entity: Entity, view: View) -> bool:
        """Whether the drives of an entity have power by all of its rules with a switch of power."""
        for label, rule in self._powers.get(entity.index, ()):
            try:
                answer = rule.has_power(view)
                if answer is not True and answer is not False:
                    raise ContractError(rule.has_power, "True or False", answer)
            except BaseException as error:
                raise component_error(f"rule {label}", entity.name, view.tick, error) from error
            if not answer:
                return False
        return True

    def derive(self, entities: Iterable[Entity], numbers: list[float], tick: int) -> None:
        """Let the models of these rigid bodies write their derived fields after a finite new state."""
        if not self._derive:
            return
        view = WritableView(tick, numbers)
        for entity in entities:
            derive = self._derive.get(entity.index)
            if derive is None or not isfinite(sum(numbers[entity.start : entity.split])):
                continue
            try:
                derive(view)
            except BaseException as error:
                raise component_error(f"model {entity.model}", entity.name, tick, error) from error

    def check_motors(self, entities: Sequence[Entity], commands: Sequence[Any], tick: int) -> None:
        """Check the set-points of motors after the engine or motion failed with them. Raises ComponentError."""
        for entity, motors in zip(entities, commands, strict=True):
            actuators = [one for one in self.actuators.get(entity.index, ()) if one.moves]
            if not actuators:
                continue
            count = entity.counts.get("joint_positions") if entity.is_rigid else None
            what = "a tuple of (target, greatest force)" + ("" if count is None else f" for {count} motors")
            if not are_motors(motors, count):
                error = ContractError(actuators[0].actuator.command, what, motors)
                raise actuators[0].failed(tick, error) from error

    def _motors_of_several(self, entity: Entity, view: View) -> Motors:
        """Return the set-points by all actuators of an entity; joints without an actuator are free."""
        has_power = self._has_power(entity, view)
        fitted = self.actuators.get(entity.index, ())
        by_joint = any(one.joints is not None for one in fitted)
        commands: list[tuple[float, ...]] = [NO_FORCE] * entity.counts.get("joint_positions", 0) if by_joint else []
        for one in fitted:
            try:
                motors = one.actuator.command(view) if has_power else _without_power(one, view)
                if one.joints is None:
                    commands.extend(motors)
                    continue
                for joint, motor in zip(one.joints, motors, strict=True):
                    commands[joint] = motor
            except BaseException as error:
                raise one.failed(view.tick, error) from error
        return tuple(commands)

    def apply_entity_rules(
        self, entities: Iterable[Entity], start: Sequence[float], numbers: list[float], tick: int
    ) -> None:
        """Apply the rules of these entities after their new state."""
        if not self._entity_rules:
            return
        view = WritableView(tick, numbers, start)
        for entity in entities:
            for label, rule in self._entity_rules.get(entity.index, ()):
                try:
                    rule.apply(view)
                except BaseException as error:
                    raise component_error(f"rule {label}", entity.name, tick, error) from error

    def judge_jobs(self, entities: Iterable[Entity], start: Sequence[float], numbers: list[float], tick: int) -> None:
        """End jobs of these entities that are done, after their rules."""
        if not self.having_jobs:
            return
        view = WritableView(tick, numbers, start)
        for entity in entities:
            if entity.index in self.having_jobs:
                for one in self.actuators[entity.index]:
                    if one.jobs is not None and not one.jobs.is_idle(view):
                        one.judge_job(view, has_power=not one.moves or self._has_power(entity, view))

    def are_plausible(
        self, entities: Iterable[Entity], numbers: Sequence[float], before: Sequence[float], tick: int
    ) -> bool:
        """Whether the new, finite states of all of these entities are valid; `problem` has the reason of one."""
        for entity in entities:
            check = self._checks.get(entity.index)
            try:
                if check is not None and check(numbers, before) is not True:
                    return False
            except BaseException as error:
                raise component_error(f"model {entity.model}", entity.name, tick, error) from error
        return True

    def problem(self, entity: Entity, numbers: Sequence[float], before: Sequence[float], tick: int) -> str:
        """Return in words why the new, finite state of an entity is invalid; empty for a valid one."""
        check = self._checks.get(entity.index)
        if check is None:
            return ""
        try:
            is_plausible = check(numbers, before)
            if is_plausible is not True and is_plausible is not False:
                raise ContractError(check, "True or False", is_plausible)
        except BaseException as error:
            raise component_error(f"model {entity.model}", entity.name, tick, error) from error
        return "" if is_plausible else "its new state is not within its bounds, speed limits and reach"

    def excite(self, numbers: list[float]) -> None:
        """Set a world at rest in motion, for the fixed small run that distinguishes engines. Raises ComponentError."""
        view = WritableView(0, numbers)
        for index, model in self.models.items():
            entity = self._layout.entities[index]
            if not entity.is_absent(numbers):
                called(f"model {entity.model}", entity.name, 0, model.excite, view)
        for index, fitted in self.actuators.items():
            if self._layout.entities[index].is_absent(numbers):
                continue
            for one in fitted:
                called(f"actuator {one.channel}", one.robot, 0, one.actuator.excite, view)


def _by_motion(entities: Iterable[Entity]) -> dict[type[Motion], list[Entity]]:
    """Return the entities that motions move, by motion, in the order of their names."""
    groups: dict[type[Motion], list[Entity]] = {}
    for entity in entities:
        if entity.kind.motion is not None:
            groups.setdefault(entity.kind.motion, []).append(entity)
    return dict(sorted(groups.items(), key=lambda item: item[0].__qualname__))


def _motions_of(spec: WorldSpec, layout: Layout) -> dict[type[Motion], Motion]:
    motions: dict[type[Motion], Motion] = {}
    for kind, entities in _by_motion(layout.entities).items():
        made: Any = kind
        at = MotionMounting(spec, layout, kind, tuple(entities))
        motions[kind] = called(f"motion {kind.__name__}", "", 0, made, at)
    return motions


def commands_together(what: str, together: Any, count: int, view: View) -> NDArray[np.float64]:
    """Return the set-points by the actuators of `count` entities at once, of shape (entities, motors, 2).

    `what` names them, for errors. Raises ComponentError.
    """
    try:
        commands = together.command(view)
        if isinstance(commands, np.ndarray) and commands.dtype == np.float64 and commands.shape[0::2] == (count, 2):
            return commands
        raise ContractError(together.command, f"an array of float64 of the shape ({count}, motors, 2)", commands)
    except BaseException as error:
        raise component_error(what, "", view.tick, error) from error


def _without_power(one: BoundActuator, view: View) -> Motors:
    """Return an actuator's set-points of its motors without power: by default a speed of 0 with all their force."""
    commands = one.actuator.unpowered()
    return tuple((0.0, motor[1]) for motor in one.actuator.command(view)) if commands is None else commands


def are_motors(commands: object, count: int | None) -> bool:
    """Whether these are set-points of `count` motors of a rigid body, or of any count (None) of a motion's."""
    lengths = (2,) if count is None else (2, 3)
    return (
        isinstance(commands, tuple)
        and count in (None, len(commands))
        and all(isinstance(one, tuple) and len(one) in lengths for one in commands)
        and all(isinstance(number, int | float) and isfinite(number) for one in commands for number in one)
        and all(one[1] >= 0.0 for one in commands)
    )


def entity_rules_of(
    spec: WorldSpec, layout: Layout, robot: Entity, hook: str = ""
) -> tuple[tuple[str, EntityRule], ...]:
    """Return the rules of a robot by name, in name order; with a hook only its overriders. Raises ComponentError."""
    rules = []
    for label, settings in sorted(spec.robots[robot.name].rules.items()):
        found: Any = settings.component_type
        if hook and not overrides(found.factory, hook):
            continue
        key = draw_key(spec.seed, "entity_rule", robot.name, label)
        at = Mounting(spec, layout, robot, label, key, frozenset(found.written))
        rules.append((label, called(f"rule {label}", robot.name, 0, found.factory, settings, at)))
    return tuple(rules)
