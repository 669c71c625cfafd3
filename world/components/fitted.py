"""The sensors and actuators of the robots of one layout, built from their settings."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from math import inf
from typing import Any, NamedTuple

from foosim.common.errors import Malformed
from foosim.common.keyed_random import draw_key
from foosim.world.component_types.descriptions import SAMPLES, Component, overrides
from foosim.world.component_types.failures import ContractError
from foosim.world.component_types.payloads import FLOAT, PayloadCodec, as_floats
from foosim.world.component_types.per_field import codec_of, numbers_of
from foosim.world.component_types.settings import ActuatorSettings, ComponentSettings, SensorSettings
from foosim.world.components.base import Actuator, Modifier, Sensor
from foosim.world.components.bounds import NO_LIMITS, Clamped, CommandBounds, limits_of
from foosim.world.components.job_book import JobBook
from foosim.world.components.joint_names import joint_indices
from foosim.world.components.mounted import body_at
from foosim.world.components.view import (
    ComponentError,
    ModifierMounting,
    Mounting,
    WritableView,
    called,
    component_error,
)
from foosim.world.layout import Entity, Layout, modifier_labels, trigger_slot
from foosim.world.spec import WorldSpec


@dataclass(frozen=True, slots=True)
class BoundModifier:
    """A modifier of one sensor or actuator: its name, and which robot's it is, for messages."""

    what: str
    robot: str
    modifier: Modifier
    waits: bool
    """Whether commands may have to wait in it."""

    def apply(self, values: list[float], view: WritableView) -> list[float] | None:
        """Return the numbers of a reading after the modifier. Raises ComponentError."""
        return self._checked(len(values), view, self.modifier.apply, values, view)

    def accept(self, values: list[float], view: WritableView) -> list[float] | None:
        """Return a command's numbers after the modifier; None where it is dropped or waits. Raises ComponentError."""
        return self._checked(len(values), view, self.modifier.accept, values, view)

    def take_due(self, size: int, view: WritableView) -> list[float] | None:
        """Return the `size` numbers of a command that is due, None without one. Raises ComponentError."""
        return self._checked(size, view, self.modifier.due, view) if self.waits else None

    def _checked(
        self, size: int, view: WritableView, call: Callable[..., list[float] | None], *arguments: Any
    ) -> list[float] | None:
        try:
            values = call(*arguments)
            if values is None:
                return None
            if type(values) is list and len(values) == size:
                floats = values if FLOAT.issuperset(map(type, values)) else as_floats(values)
                if floats is not None:
                    return floats
            raise ContractError(call, f"a list of {size} numbers, or None", values)
        except BaseException as error:
            raise self.failed(view.tick, error) from error

    def failed(self, tick: int, error: BaseException) -> ComponentError:
        """Return the error of a modifier that has raised."""
        return component_error(self.what, self.robot, tick, error)


@dataclass(frozen=True, slots=True, eq=False)
class BoundSensor:
    """A sensor of one robot: the channel of its readings, its schedule (`spec.Schedule`) number by number,
    which is read at each tick, and the slot that counts them."""

    robot: str
    channel: str
    step: int
    shift: int
    period: int
    samples_at: int
    sensor: Sensor
    codec: PayloadCodec
    modifiers: tuple[BoundModifier, ...]
    size: int
    """The count of a reading's numbers; 0 of one with other fields than numbers."""
    trigger_at: int = -1
    """The place of the number that makes it measure where it is not 0; -1 without one."""

    def is_due(self, tick: int, numbers: Sequence[float]) -> bool:
        """Whether it measures at a tick, at whose start the numbers of the frame are these."""
        return (tick * self.step + self.shift) % self.period < self.step or (
            self.trigger_at >= 0 and numbers[self.trigger_at] != 0.0
        )

    def sample(self, view: WritableView) -> Any:
        """Return the measurement. Raises ComponentError."""
        try:
            reading = self.sensor.sample(view)
        except BaseException as error:
            raise self.failed(view.tick, error) from error
        if not isinstance(reading, self.codec.kind):
            wrong = ContractError(self.sensor.sample, f"a {self.codec.kind.__name__}", reading)
            raise self.failed(view.tick, wrong) from wrong
        return reading

    def failed(self, tick: int, error: BaseException) -> ComponentError:
        """Return the error of a sensor that has raised, or whose reading is none."""
        return component_error(f"sensor {self.channel}", self.robot, tick, error)


@dataclass(frozen=True, slots=True, eq=False)
class BoundActuator:
    """An actuator of one robot, and the channel of its commands."""

    robot: str
    channel: str
    actuator: Actuator
    codec: PayloadCodec
    modifiers: tuple[BoundModifier, ...]
    size: int
    """The count of a command's numbers; 0 of one with other fields than numbers."""
    bounds: CommandBounds
    clamped_at: int
    """The place of the robot's count of clamped commands."""
    moves: bool = True
    """Whether it commands the motors of its robot."""
    joints: tuple[int, ...] | None = None
    """The numbers of the joints whose motors it commands; None for all of them."""
    jobs: JobBook | None = None
    """The state of its jobs; None of an actuator without jobs."""

    @property
    def has_waiting(self) -> bool:
        """Whether commands may have to wait for their tick."""
        return any(one.waits for one in self.modifiers)

    def accept(self, payload: bytes, view: WritableView, source: str = "") -> bool:
        """Take a command of an endpoint, clamped to its limits; False when it is refused. Raises ComponentError."""
        try:
            command = self.codec.decode_finite(payload)
        except Malformed:
            return False
        if self.jobs is not None:
            command = self.jobs.addressed(command, source)
            if command is None:
                return False
        view.count_command(self)
        if not self.modifiers:
            return self._take(command, view)
        return self._take_from(0, self.codec.numbers(command), view)

    def take_due(self, view: WritableView) -> int:
        """Take the commands whose time has come; return how many of them are refused. Raises ComponentError."""
        refused = 0
        for place, one in enumerate(self.modifiers):
            values = one.take_due(self.size, view)
            if values is not None and not self._take_from(place + 1, values, view):
                refused += 1
        return refused

    def examine(self, payload: bytes) -> tuple[str, Sequence[Clamped]]:
        """Return why a command can only be refused, empty where it need not be, and which of its numbers are clamped.

        Modifiers may change it before. Raises ComponentError.
        """
        why = ""
        try:
            command = self.codec.decode_finite(payload)
            found = self.bounds.clamp(command)
            if self.jobs is None or command.job >= 0.0:
                why = self.actuator.problem(command)
        except Malformed as error:
            return str(error), ()
        except BaseException as error:
            raise self.failed(0, error) from error
        return (why, found[1]) if found is not None else (f"{self.codec.name} of another length", ())

    def _take_from(self, place: int, values: list[float], view: WritableView) -> bool:
        """Take a command through the modifiers from this place on; dropping or delaying it is no refusal."""
        left: list[float] | None = values
        for one in self.modifiers[place:]:
            assert left is not None
            left = one.accept(left, view)
            if left is None:
                return True
        assert left is not None
        return self._take(self.codec.from_numbers(left), view)

    def _take(self, command: Any, view: WritableView) -> bool:
        if self.jobs is None:
            return self._carry_out(command, view)
        try:
            return self.jobs.take(command, view, self.actuator, lambda its: self._carry_out(its, view))
        except BaseException as error:
            raise self.failed(view.tick, error) from error

    def _carry_out(self, command: Any, view: WritableView) -> bool:
        try:
            found = self.bounds.clamp(command)
            if found is None:
                return False
            within, clamped = found
            is_taken = self.actuator.accept(within, view)
            if is_taken is True or is_taken is False:
                if is_taken and clamped:
                    view.written_to[self.clamped_at] += 1.0
                return is_taken
            raise ContractError(self.actuator.accept, "True or False", is_taken)
        except BaseException as error:
            raise self.failed(view.tick, error) from error

    def judge_job(self, view: WritableView, *, has_power: bool) -> None:
        """After the robot was solved: let the job that runs end, if it does. Raises ComponentError."""
        assert self.jobs is not None
        try:
            self.jobs.judge(view, self.actuator, has_power=has_power)
        except BaseException as error:
            raise self.failed(view.tick, error) from error

    def failed(self, tick: int, error: BaseException) -> ComponentError:
        """Return the error of an actuator that has raised."""
        return component_error(f"actuator {self.channel}", self.robot, tick, error)


# --- building --------------------------------------------------------------------------------------------------------


def sensors_of(spec: WorldSpec, layout: Layout, robot: Entity) -> tuple[BoundSensor, ...]:
    """Return the sensors of a robot, in the order of their channels. Raises ComponentError."""
    fitted = []
    for channel, settings in sorted(spec.robots[robot.name].sensors.items()):
        component = settings.component_type
        key = draw_key(spec.seed, "sensor", robot.name, channel)
        mounting = Mounting(spec, layout, robot, channel, key, is_owners=True)
        sensor = _made(component, settings, mounting)
        of_values = _spacing(spec, component, settings)
        modifiers = tuple(_modifiers(component, settings, mounting, sensor, of_values))
        numbers, trigger = numbers_of(component, settings, robot.counts), component.trigger_by(settings)
        fitted.append(
            BoundSensor(
                robot.name,
                channel,
                *spec.schedule(settings),
                robot.offsets[f"{channel}.{SAMPLES}"],
                sensor,
                codec_of(component),
                modifiers,
                0 if numbers is None else numbers.size,
                robot.offsets[trigger_slot(robot, channel, trigger)] if trigger else -1,
            )
        )
    return tuple(fitted)


def actuators_of(spec: WorldSpec, layout: Layout, robot: Entity) -> tuple[BoundActuator, ...]:
    """Return the actuators of a robot, in the order of their channels. Raises ComponentError."""
    fitted = []
    for channel, settings in sorted(spec.robots[robot.name].actuators.items()):
        component = settings.component_type
        mounting = Mounting(spec, layout, robot, channel, draw_key(spec.seed, "actuator", robot.name, channel))
        made = _made(component, settings, mounting)
        modifiers = tuple(_modifiers(component, settings, mounting, made, Spacing(1, spec.tick_ns / 1e9)))
        numbers = numbers_of(component, settings, robot.counts)
        size = 0 if numbers is None else numbers.size
        codec = codec_of(component)
        bounds = called(f"actuator {channel}", robot.name, 0, CommandBounds, made, codec)
        counter = robot.offsets["clamped"]
        joints = called(f"actuator {channel}", robot.name, 0, _joints, component, settings, mounting)
        fitted.append(
            BoundActuator(
                robot.name,
                channel,
                made,
                codec,
                modifiers,
                size,
                bounds,
                counter,
                component.moves,
                joints,
                JobBook(mounting) if component.jobs else None,
            )
        )
    return tuple(fitted)


def _joints(component: Component, settings: ActuatorSettings, mounting: Mounting) -> tuple[int, ...] | None:
    """Return the joints that an actuator's settings select; None for all in their order. Raises
    IncompatibleComponent."""
    if not component.joints:
        return None
    body = body_at(mounting)
    joints = joint_indices(body, component.joints_named(settings), component.joints, has_motors=True)
    return None if joints == tuple(range(len(body.joints))) else joints


def _made(component: Component, settings: ComponentSettings, mounting: Mounting | ModifierMounting) -> Any:
    at = mounting if isinstance(mounting, Mounting) else mounting.mounting
    return called(f"{component.type_name} {at.name}", at.robot.name, 0, component.factory, settings, mounting)


class Spacing(NamedTuple):
    """The period of a component's values: the least number of ticks, and the mean time (s)."""

    least_ticks: int
    period_s: float


def _spacing(spec: WorldSpec, sensor: Component, settings: SensorSettings) -> Spacing:
    """Return that of a sensor's readings; one with a trigger may have one at each tick."""
    if sensor.trigger:
        return Spacing(1, spec.tick_ns / 1e9)
    return Spacing(spec.schedule(settings).least_ticks, float(1 / settings.rate_hz))


def _modifiers(
    component: Component,
    settings: SensorSettings | ActuatorSettings,
    mounting: Mounting,
    made: Any,
    of_values: Spacing,
) -> Iterator[BoundModifier]:
    """Yield the modifiers of a component's readings or commands, in order; their draws are keyed by their names."""
    if not settings.modifiers:
        return
    numbers = numbers_of(component, settings, mounting.robot.counts)
    assert numbers is not None, "checked with the deployment"
    spec, robot, channel = mounting.spec, mounting.robot, mounting.name
    limits = NO_LIMITS
    if component.type_name == "sensor":
        limits = called(f"sensor {channel}", robot.name, 0, limits_of, made, numbers.fields)
    bounds = [limits.get(numbers.field(place).name, (-inf, inf)) for place in range(numbers.size)]
    low, high = tuple(least for least, _ in bounds), tuple(most for _, most in bounds)
    for label, its in zip(modifier_labels(settings.modifiers), settings.modifiers, strict=True):
        key = draw_key(spec.seed, component.type_name, robot.name, channel, label)
        own = Mounting(spec, mounting.layout, robot, f"{channel}.{label}", key, is_owners=mounting.is_owners)
        at = ModifierMounting(own, numbers, low, high, spec.tick_ns, of_values.period_s, of_values.least_ticks, key)
        one = _made(its.component_type, its, at)
        waits = overrides(type(one), "due")
        yield BoundModifier(f"modifier {label} of {channel}", robot.name, one, waits)
