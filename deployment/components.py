"""Reads the settings of all forms of a deployment: those of a kind are checked by the class that registered it.

Kinds are open, so their settings are read before the schema of the deployment is applied, which takes what was read as
it is: of kits, rules of the world, the scene, robots and their components.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any, Final, Literal

from pydantic import ValidationError

from foosim.common.errors import ABSENT, BadValue
from foosim.common.finding import Finding, Location
from foosim.common.spec_base import SpecBase
from foosim.deployment.schema import Deployment
from foosim.deployment.schema_errors import settings_findings
from foosim.world.assembly.misfits import (
    SECTIONS,
    component_problems,
    model_problems,
    models_of,
    needs_kit,
    rule_problems,
)
from foosim.world.forms import registry
from foosim.world.forms.failures import failure_of
from foosim.world.forms.forms import (
    JOINTS,
    JOINTS_MAX,
    Carrier,
    Component,
    ComponentType,
    Model,
    WorldRule,
    with_article,
)
from foosim.world.forms.per_field import Numbers, numbers_of, read_per_field
from foosim.world.forms.settings import (
    BASES,
    ActuatorSettings,
    ComponentSettings,
    ModifierSettings,
    RobotSettings,
    SensorSettings,
)
from foosim.world.spec import KITS, schedule_of

ROBOTS: Final = "robots"
JOINT_POSITIONS: Final = JOINTS[0]
OF_MODEL: Final = ("actuators", "rules")
"""The sections of which a robot that says nothing has those of its model."""


def read_components(data: Any, known: Collection[str]) -> tuple[Any, list[Finding]]:
    """Return a deployment's plain data with the settings of all forms read, and what is wrong with them.

    `known` are the keys of a deployment; any other that is the name of a kit is that kit's section.
    """
    if not isinstance(data, dict):
        return data, []
    reader = _Reader()
    reader.findings += _unknown_engine(data.get("engine"))
    read = {key: value for key, value in data.items() if key != KITS}
    kits = {key: read.pop(key) for key in data if key not in known and reader.is_kit(key)}
    if KITS in data:
        reader.findings.append(Finding((KITS,), "unknown key", KITS, at="key"))
    read[KITS] = {key: reader.kit(key, section) for key, section in kits.items() if section is not None}
    reader.kits = {*read[KITS]}
    robots = data.get("robots")
    if isinstance(robots, dict):
        read["robots"] = {name: reader.entity(("robots", name), robot) for name, robot in robots.items()}
    objects = data.get("objects")
    if isinstance(objects, dict):
        read["objects"] = {name: reader.entity(("objects", name), one) for name, one in objects.items()}
    rules = data.get("rules")
    if isinstance(rules, dict):
        read["rules"] = {
            name: reader.component("rule", None, ("rules", name), settings) for name, settings in rules.items()
        }
    if isinstance(data.get("scene"), dict):
        read["scene"] = reader.component("scene", None, ("scene",), data["scene"])
    return read, reader.findings


def _unknown_engine(kind: Any) -> Iterator[Finding]:
    """Yield what is wrong with the name of an engine; whether it is a text is the schema's to say."""
    if not isinstance(kind, str):
        return
    try:
        registry.find_engine(kind)
    except BadValue as error:
        yield Finding(("engine",), error.problem, kind, error.nearest)


class _Reader:
    """Reads the forms of one deployment, and gathers what is wrong."""

    def __init__(self) -> None:
        self.kits: set[str] = set()
        self.findings: list[Finding] = []
        self._read: dict[tuple[str, int, int], Any] = {}
        """What was read without findings: by form and the identities of model and plain data, which live as long."""

    def is_kit(self, key: Any) -> bool:
        """Whether a kit has this name; one that cannot be imported is reported."""
        if not isinstance(key, str):
            return False
        try:
            return registry.lookup("kit", key) is not None
        except BadValue as error:
            self.findings.append(Finding((key,), error.problem, key, error.nearest, at="key"))
        return False

    def kit(self, name: str, section: Any) -> Any:
        """Return the settings of a kit; in place of what is refused, settings without any."""
        settings = registry.find("kit", name).settings
        try:
            return settings.model_validate(section)
        except ValidationError as error:
            self.findings += settings_findings(error, settings, (name,))
            return SpecBase.model_construct()

    def entity(self, location: Location, robot: Any) -> Any:
        """Return the settings of a robot or an object; in place of what is refused, settings of its model alone."""
        if not isinstance(robot, dict):
            return robot
        name = robot.get("model")
        if not isinstance(name, str):
            what = "missing key" if name is None else "not a text"
            at: Literal["missing", "value"] = "missing" if name is None else "value"
            self.findings.append(Finding((*location, "model"), what, name or "model", at=at))
            return RobotSettings.model_construct(model="")
        try:
            model = registry.find_model(name)
        except BadValue as error:
            choices = [other.name for other in models_of(robots=location[0] == ROBOTS)]
            refused = error if ":" in name else registry.unknown("model", name, choices)
            self.findings.append(Finding((*location, "model"), refused.problem, name, refused.nearest))
        else:
            return self._entity_of(model.variant(robot.get("dynamics")), location, robot)
        self._components_of(None, location, robot)
        return RobotSettings.model_construct(model=name)

    def _entity_of(self, model: Model, location: Location, robot: Mapping[str, Any]) -> Any:
        noun = "robot" if location[0] == ROBOTS else "object"
        if model.is_robot != (noun == "robot"):
            other = "is there without an owner" if noun == "robot" else "has an owner, and stands in robots"
            what = f"no model of {noun}s: {model.name} {other}"
            self.findings.append(Finding((*location, "model"), what, robot["model"]))
            return RobotSettings.model_construct(model=model.name)
        for what in (*needs_kit(model, self.kits, f"{with_article(noun)}"), *model_problems(model, self.kits)):
            self.findings.append(Finding((*location, "model"), what, robot["model"]))
        for section in OF_MODEL if noun == "robot" else ():
            if robot.get(section) is None:
                robot = {**robot, section: dict(getattr(model, section))}
        found = self._components_of(model, location, robot)
        try:
            return model.settings.model_validate(found)
        except ValidationError as error:
            self.findings += settings_findings(error, model.settings, location)
            return RobotSettings.model_construct(model=model.name)

    def _components_of(self, model: Model | None, location: Location, robot: Mapping[str, Any]) -> dict[str, Any]:
        """Return the data of a robot with the settings of its components read."""
        found = dict(robot)
        for section, form in SECTIONS.items():
            if isinstance(robot.get(section), dict):
                found[section] = {
                    name: self.component(form, model, (*location, section, name), settings)
                    for name, settings in robot[section].items()
                }
        return found

    def component(self, form: str, model: Model | None, location: Location, settings: Any) -> Any:
        """Return the settings of one component. What many robots share, by a template, is read once."""
        key = form, id(model), id(settings)
        if key not in self._read:
            count = len(self.findings)
            read = self._read_component(form, model, location, settings)
            if len(self.findings) > count:
                return read
            self._read[key] = read
        return self._read[key]

    def _read_component(self, form: str, model: Model | None, location: Location, settings: Any) -> Any:
        """Return the settings of one component; in place of what is refused, settings that say its kind alone."""
        kind = settings.get("kind") if isinstance(settings, dict) else None
        if not isinstance(kind, str):
            return settings
        try:
            component = registry.find(form, kind)
            self.findings += self._misfits(component, model, (*location, "kind"), kind)
            modifiers = settings.get("modifiers")
            if isinstance(modifiers, list):
                settings = {**settings, "modifiers": [*self._modifiers((*location, "modifiers"), modifiers)]}
            return component.settings.model_validate(settings)
        except BadValue as error:
            self.findings.append(Finding((*location, "kind"), error.problem, kind, error.nearest))
        except ValidationError as error:
            self.findings += settings_findings(error, registry.find(form, kind).settings, location)
        return BASES[form].model_construct(kind=kind)

    def _misfits(
        self, component: ComponentType, model: Model | None, location: Location, kind: str
    ) -> Iterator[Finding]:
        """Yield what the world or a model does not have that a component needs."""
        problems = [*needs_kit(component, self.kits)]
        if not problems and model is not None:
            problems += component_problems(component, model)
        if isinstance(component, WorldRule):
            problems += rule_problems(component)
        for problem in problems:
            yield Finding(location, problem, kind)

    def _modifiers(self, location: Location, modifiers: list[Any]) -> Iterator[Any]:
        for number, settings in enumerate(modifiers):
            yield self.component("modifier", None, (*location, number), settings)


def check_components(deployment: Deployment) -> Iterator[Finding]:
    """Yield sensors and actuators whose slots or modifiers do not fit their settings, or that command the same motors.

    What many robots share, by a template, is checked once.
    """
    met: set[tuple[int, int]] = set()
    for name, robot in deployment.robots.items():
        model = registry.model_of(robot)
        for section, form in ("sensors", "sensor"), ("actuators", "actuator"):
            for channel, settings in getattr(robot, section).items():
                if (id(model), id(settings)) not in met:
                    met.add((id(model), id(settings)))
                    component = registry.find_component(form, settings.kind)
                    location = ("robots", name, section, channel)
                    yield from _unfit_component(component, settings, model, deployment.tick_ns, location)
        yield from _competing(robot.actuators, ("robots", name, "actuators"))


def _unfit_component(
    component: Component, settings: SensorSettings | ActuatorSettings, model: Model, tick_ns: int, location: Location
) -> Iterator[Finding]:
    """Yield why the slots of a sensor or actuator do not follow from its settings, and the settings of modifiers that
    do not fit the readings or commands that these are on."""
    period_ns = tick_ns
    if isinstance(settings, SensorSettings) and not component.trigger:
        period_ns *= schedule_of(settings, tick_ns).least_ticks
    # Joints are as many as may be where that follows from a robot's file.
    counts = dict.fromkeys(JOINTS, JOINTS_MAX) if model.declared is None else model.declared
    yield from _unknown_slots(component, settings, Carrier(0, period_ns, counts.get(JOINT_POSITIONS, 0)), location)
    numbers = numbers_of(component, settings, counts)
    for number, modifier in enumerate(settings.modifiers):
        place: Location = (*location, "modifiers", number)
        if numbers is None:
            what = f"a modifier of what is not numbers alone: {component.type_name} {component.name}"
            yield Finding((*place, "kind"), what, modifier.kind)
        else:
            found = registry.find_component("modifier", modifier.kind)
            yield from _unfit(found, modifier, Carrier(numbers.size, period_ns), numbers, place)


def _competing(actuators: Mapping[str, ActuatorSettings], location: Location) -> Iterator[Finding]:
    """Yield the actuators that command motors which another one commands already."""
    before: dict[str, Sequence[str] | None] = {}
    for name, settings in actuators.items():
        component = registry.find_component("actuator", settings.kind)
        if not component.moves:
            continue
        try:
            named = component.joints_named(settings)
        except BadValue as error:
            yield Finding((*location, name, component.joints), error.problem, error.value)
            continue
        clashes = (_clash(named, other, theirs) for other, theirs in before.items())
        found = next((clash for clash in clashes if clash is not None), None)
        if found is not None:
            place, what = found
            path = ("kind",) if named is None else (component.joints, place)
            yield Finding((*location, name, *path), what)
        before[name] = named


def _clash(named: Sequence[str] | None, other: str, theirs: Sequence[str] | None) -> tuple[int, str] | None:
    """Return the place of a joint among those that an actuator commands, and how another one commands it; None where
    none is. None for joints are all that the robot has."""
    if named is None:
        what = "the motors that" if theirs is None else f"all joints, of which {theirs[0]} is one that"
        return 0, f"commands {what} {other} commands already"
    if theirs is None:
        return 0, f"a joint that {other} commands already, with all others"
    for place, joint in enumerate(named):
        if joint in theirs:
            return place, f"a joint that {other} commands already"
    return None


def _unfit(
    component: Component, settings: ModifierSettings, carrier: Carrier, numbers: Numbers, place: Location
) -> Iterator[Finding]:
    """Yield what is wrong with a modifier on these numbers."""
    keys = {field.alias or name: name for name, field in component.settings.model_fields.items()}
    findings = []
    for key, least in component.per_field.items():
        written = getattr(settings, keys[key])
        parts = (
            {(key, name): {name: one} for name, one in written.items()}
            if isinstance(written, dict)
            else {(key,): written}
        )
        for path, part in parts.items():
            try:
                if part is not None:
                    read_per_field(part, numbers, least)
            except BadValue as error:
                findings.append(Finding((*place, *path), error.problem, error.value, error.nearest))
    yield from findings
    if findings:
        return
    try:
        made: Any = component.factory
        made.check(settings, numbers)
    except BadValue as error:
        yield Finding(place, error.problem, _value_of(error, settings.kind), error.nearest)
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # noqa: BLE001  # of whoever wrote the modifier
        yield Finding(place, f"its check failed: {failure_of(error)}", settings.kind)
    else:
        yield from _unknown_slots(component, settings, carrier, place)


def _unknown_slots(
    component: Component, settings: ComponentSettings, carrier: Carrier, place: Location
) -> Iterator[Finding]:
    """Yield why the slots of a component do not follow from its settings and what it is on."""
    try:
        component.slots_on(settings, carrier)
    except BadValue as error:
        yield Finding(place, error.problem, _value_of(error, settings.kind), error.nearest)


def _value_of(error: BadValue, kind: str) -> object:
    """Return the value that an error is about; that of a component is its kind where none is said."""
    return kind if error.value is ABSENT else error.value
