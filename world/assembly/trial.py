"""A tick of the forms of other packages, tried when a deployment is loaded: what cannot work is a problem of the file.

Objects are made for the trial and thrown away, and the numbers are copies: a form without a memory of its own does not
notice. Worlds of foosim's own forms are not tried: tests do that.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from math import isfinite
from typing import Any, Final, TypeVar

import numpy as np

from foosim.common.errors import ABSENT
from foosim.common.finding import Finding, Location
from foosim.common.json_text import encode_json
from foosim.world.assembly.world import NO_TEXT, World, initial_numbers, model_of, rules_of, world_status, world_texts
from foosim.world.bodies.limits import size_problem
from foosim.world.components.fitted import FittedActuator, FittedSensor, actuators_of, sensors_of
from foosim.world.components.sensing import Sensing
from foosim.world.components.view import ComponentError, SensingView, WritableView
from foosim.world.components.watching import ReadOnly, Watched, places_of, watched_actuator
from foosim.world.forms import registry
from foosim.world.forms.failures import failure_of
from foosim.world.forms.forms import Kit, Model
from foosim.world.frame import Frame
from foosim.world.layout import WORLD, Entity, Layout, build_layout
from foosim.world.scene import Body, Shape
from foosim.world.spec import WorldSpec


class _Unmet(Exception):
    """Something else than what a form must give; the text says what."""


T = TypeVar("T")
TICK: Final = 1


def trial_findings(spec: WorldSpec) -> Iterator[Finding]:
    """Yield why the forms of a world cannot work, each at its place in the deployment."""
    try:
        trial = _Trial(spec)
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # noqa: BLE001  # of what other people's forms declare
        yield Finding((), f"the layout fails: {failure_of(error)}", ABSENT)
        return
    for step in (trial.try_sections, trial.try_models, trial.try_rules, trial.try_components, trial.try_tick):
        step()
        if trial.found:
            yield from trial.found
            return


class _Trial:
    """The trial of one world: each step relies on those before it."""

    def __init__(self, spec: WorldSpec) -> None:
        self._spec, self._layout = spec, build_layout(spec)
        self.found: list[Finding] = []

    def _attempt(self, location: Location, what: str, call: Callable[..., T], *arguments: Any) -> T | None:
        """Return what a call returns; note what it raises."""
        try:
            return call(*arguments)
        except ComponentError as error:
            said = str(error)
        except _Unmet as error:
            said = f"{what}: {error}"
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # noqa: BLE001  # other people's code may raise anything: SystemExit, too
            said = f"{what} fails: {failure_of(error)}"
        self.found.append(
            Finding(location, said, location[-1] if location else ABSENT, at="key" if location else "value")
        )
        return None

    def try_sections(self) -> None:
        """Make kits and scene, and ask for all that they have."""
        spec = self._spec
        for name, section in sorted(spec.kits.items()):
            form = registry.find("kit", name)
            assert isinstance(form, Kit), form
            for model in form.addable:
                self._attempt((name,), f"kit {name}: {model}", _check_addable, registry.find_model(model))
            kit: Any = self._attempt((name,), f"kit {name}", form.made, section, spec)
            if kit is not None:
                self._attempt((name,), f"kit {name}: shapes", lambda kit=kit: _check_shapes(kit.shapes()))
                self._attempt((name,), f"kit {name}: physics", lambda kit=kit: kit.physics())
                self._attempt((name,), f"kit {name}: findings", lambda kit=kit: _check_findings(kit.findings()))
        if spec.scene is not None:
            made = registry.find("scene", spec.scene.kind).made
            what = f"scene {spec.scene.kind}"
            self._attempt(("scene",), what, lambda scene=spec.scene: _check_shapes(made(scene)))

    def try_models(self) -> None:
        """Make each entity, place it, and ask for its body."""
        numbers = [0.0] * self._layout.size
        for entity in self._layout.entities:
            if entity.name == WORLD:
                continue
            location: Location = ("robots", entity.name) if entity.name in self._spec.robots else ()
            what = f"model {entity.model} of {entity.name}"
            model = self._attempt(location, what, model_of, self._spec, self._layout, entity)
            if model is not None:
                places = places_of(entity, *entity.offsets)
                watched: Any = Watched(model, self._layout, places)
                self._attempt(location, f"{what}: place", watched.place, WritableView(0, numbers))
                self._attempt(location, f"{what}: body", _check_body, model, entity)
                self._attempt(location, f"{what}: is_plausible", _check_plausible, model, numbers)

    def try_rules(self) -> None:
        """Make the rules of the world, and let them set their fields."""
        self._attempt(("rules",), "rules of the world", rules_of, self._spec, self._layout)
        if not self.found:
            start = partial(initial_numbers, self._spec, self._layout, is_watched=True)
            self._attempt(("rules",), "the start of the world", start)

    def try_components(self) -> None:
        """Make sensors and actuators, measure alone and together, ask for limits and motors."""
        spec, layout = self._spec, self._layout
        numbers = initial_numbers(spec, layout)
        everyone: list[FittedSensor] = []
        for robot in layout.robots:
            place: Location = ("robots", robot.name)
            sensors = self._attempt((*place, "sensors"), f"sensors of {robot.name}", sensors_of, spec, layout, robot)
            for sensor in sensors or ():
                what = f"sensor {sensor.channel} of {robot.name}"
                self._attempt((*place, "sensors", sensor.channel), what, _check_readings, [sensor], numbers)
            everyone += sensors or ()
            what = f"actuators of {robot.name}"
            for one in self._attempt((*place, "actuators"), what, actuators_of, spec, layout, robot) or ():
                what = f"actuator {one.channel} of {robot.name}"
                self._attempt((*place, "actuators", one.channel), what, _check_actuator, one, layout, numbers)
        if not self.found:
            self._attempt(("robots",), "sensors that are read together", _check_readings, everyone, numbers)

    def try_tick(self) -> None:
        """Let rules and motions do what they do in a tick, and show what rules and kits show."""
        self._attempt((), "a tick", self._tick)
        if not self.found:
            self._attempt((), "the status", self._show)

    def _tick(self) -> None:
        spec, layout = self._spec, self._layout
        world, numbers = World(spec, layout, is_watched=True), initial_numbers(spec, layout)
        world.apply_rules(numbers, TICK)
        start = numbers.copy()
        moved = [entity for entity in layout.entities if entity.is_solved]
        world.move(moved, start, numbers, TICK)
        world.apply_entity_rules(moved, start, numbers, TICK)
        world.plausible(moved, numbers, start, TICK)
        for entity in layout.entities:
            for field, at in entity.offsets.items():
                values = numbers[at : at + entity.counts[field]]
                if not all(map(isfinite, values)):
                    raise _Unmet(f"{entity.name} {field} is {', '.join(map(str, values))} after it")

    def _show(self) -> None:
        frame = Frame(TICK, self._layout, np.array(initial_numbers(self._spec, self._layout)))
        status = world_status(self._spec, frame)
        _need("failed" not in status, "a status", status.get("failed"))
        encode_json(status)
        for text in world_texts(self._spec, status):
            _need(not str(text).startswith(NO_TEXT), "a text", text)


# --- what is asked of each -------------------------------------------------------------------------------------------


def _need(is_met: bool, what: str, value: object) -> None:
    if not is_met:
        raise _Unmet(f"{what} is needed, not {value!r}"[:200])


def _numbers(values: Any, count: int, what: str) -> None:
    is_met = isinstance(values, tuple | list) and len(values) == count
    _need(is_met and all(isinstance(one, float | int) and isfinite(one) for one in values), what, values)


def _check_shapes(shapes: Iterable[Any]) -> None:
    _need(isinstance(shapes, tuple | list), "a tuple of shapes", shapes)
    for shape in shapes:
        _check_shape(shape)


def _check_shape(shape: Any) -> None:
    _need(isinstance(shape, Shape), "a Shape", shape)
    _numbers(shape.colour, 4, "a colour of four numbers")
    _numbers(shape.position, 3, "a position of three numbers")
    _numbers(shape.orientation, 4, "an orientation of four numbers")
    sizes = [getattr(shape.geometry, name, None) for name in ("radius", "length")]
    sizes += getattr(shape.geometry, "half", ())
    _need(all(size is None or (isfinite(size) and size > 0) for size in sizes), "a size above 0", shape.geometry)


def _check_addable(model: Model) -> None:
    lacking = [method for method in ("check_place", "place_at") if not hasattr(model.made, method)]
    _need(
        not lacking and "position" in (model.declared or ()),
        "a model with position, check_place and place_at",
        model.name,
    )


def _check_findings(findings: Iterable[Any]) -> None:
    for finding in findings:
        _need(isinstance(finding, Finding), "a Finding", finding)


def _check_body(model: Any, entity: Entity) -> None:
    body = model.body()
    if body is None:
        return
    _need(isinstance(body, Body), "a Body, or None", body)
    _need(bool(body.links), "a body with links", body)
    if body.is_free:
        lacking = [field for field in ("position", "orientation") if field not in entity.offsets]
        _need(not lacking, "a model with position and orientation, which has a free body", lacking)
    for link in body.links:
        _check_shapes(link.shapes)
    if entity.is_rigid:
        problem = size_problem([link.shapes for link in body.links])
        if problem:
            raise _Unmet(problem)


def _check_plausible(model: Any, numbers: Sequence[float]) -> None:
    answer = model.is_plausible(numbers, numbers)
    _need(isinstance(answer, bool), "True or False", answer)


def _check_readings(sensors: Sequence[FittedSensor], numbers: Sequence[float]) -> None:
    view = SensingView(TICK, ReadOnly(numbers), np.array(numbers))
    view.values.setflags(write=False)
    for one, payload in zip(sensors, Sensing().sample(sensors, view), strict=True):
        if payload is not None:
            one.codec.decode(payload)


def _check_actuator(fitted: FittedActuator, layout: Layout, numbers: Sequence[float]) -> None:
    one = watched_actuator(fitted, layout)
    fields = {field.name for field in one.codec.fields}
    for name, bounds in one.actuator.limits().items():
        _need(name in fields, f"limits of fields of the command ({', '.join(sorted(fields))})", name)
        _numbers(bounds, 2, "the least and the greatest value")
    view = WritableView(TICK, list(numbers))
    one.actuator.hold(view)
    for motor in _motors(one.actuator.command(view)):
        _numbers(motor, 2, "a target speed and a greatest force for each motor")
        _need(motor[1] >= 0, "a greatest force that is not negative", motor[1])
    one.actuator.stir(view)


def _motors(asked: Any) -> Any:
    _need(isinstance(asked, tuple), "a tuple with what is asked of each motor", asked)
    return asked
