"""Reads the settings of the components of robots: those of a kind are checked by the class that registered it.

Kinds are open, so their settings are read before the schema of the deployment is applied, which takes what was read as
it is.
"""

from collections.abc import Iterator, Mapping
from typing import Any, Final

from pydantic import ValidationError

from foosim.common.errors import BadValue, Refused, UnknownName
from foosim.common.finding import Finding, Location
from foosim.common.units import parse_ns, period_ticks
from foosim.deployment.schema_errors import settings_findings
from foosim.world.forms import registry
from foosim.world.forms.models import MODELS
from foosim.world.forms.per_field import Numbers, numbers_of, read_per_field
from foosim.world.forms.registry import Carrier, Component
from foosim.world.forms.settings import ActuatorSettings, ComponentSettings, ModifierSettings, SensorSettings

SECTIONS: Final[Mapping[str, tuple[str, type[ComponentSettings]]]] = {
    "sensors": ("sensor", SensorSettings),
    "actuators": ("actuator", ActuatorSettings),
}
"""The sections of a robot that have components: their form, and what all settings have."""


def read_components(data: Any) -> tuple[Any, list[Finding]]:
    """Return a deployment's plain data with the settings of all components read, and what is wrong with them.

    A robot that says nothing of its actuators has those of its model.
    """
    robots = data.get("robots") if isinstance(data, dict) else None
    if not isinstance(robots, dict):
        return data, []
    reader = _Reader(data)
    read = {name: reader.robot(("robots", name), robot) for name, robot in robots.items()}
    return {**data, "robots": read}, reader.findings


class _Reader:
    """Reads the robots of one deployment, and gathers what is wrong."""

    def __init__(self, data: Mapping[str, Any]) -> None:
        self._data = data
        self.findings: list[Finding] = []
        self._read: dict[tuple[str, Any, int], Any] = {}
        """What was read without findings: by form, model and the identity of the plain data, which lives as long."""

    def robot(self, location: Location, robot: Any) -> Any:
        """Return the data of a robot with the settings of its components read."""
        if not isinstance(robot, dict):
            return robot
        model = robot.get("model")
        if isinstance(model, str) and model in MODELS and robot.get("actuators") is None:
            robot = {**robot, "actuators": dict(MODELS[model].actuators)}
        found = dict(robot)
        for section, (form, base) in SECTIONS.items():
            if isinstance(robot.get(section), dict):
                found[section] = {
                    name: self._component(form, base, model, (*location, section, name), settings)
                    for name, settings in robot[section].items()
                }
        self.findings += _competing(found.get("actuators"), (*location, "actuators"))
        return found

    def _component(
        self, form: str, base: type[ComponentSettings], model: Any, location: Location, settings: Any
    ) -> Any:
        """Return the settings of one component. What many robots share, by a template, is read once."""
        key = form, model, id(settings)
        if key not in self._read:
            count = len(self.findings)
            read = self._read_component(form, base, model, location, settings)
            if len(self.findings) > count:
                return read
            self._read[key] = read
        return self._read[key]

    def _read_component(
        self, form: str, base: type[ComponentSettings], model: Any, location: Location, settings: Any
    ) -> Any:
        """Return the settings of one component; in place of what is refused, settings that say its kind alone."""
        kind = settings.get("kind") if isinstance(settings, dict) else None
        if not isinstance(kind, str):
            return settings
        try:
            component = registry.find(form, kind)
            misfits = [*self._misfits(component, model, (*location, "kind"), kind)]
            self.findings += misfits
            modifiers = settings.get("modifiers")
            if isinstance(modifiers, list):
                settings = {**settings, "modifiers": [*self._modifiers((*location, "modifiers"), modifiers)]}
            found = component.settings.model_validate(settings)
            if isinstance(found, SensorSettings | ActuatorSettings) and not misfits:
                self.findings += self._unfit_modifiers(component, found, location)
            return found
        except UnknownName as error:
            self.findings.append(Finding((*location, "kind"), error.problem, kind, error.nearest))
        except Refused as error:
            self.findings.append(Finding((*location, "kind"), error.what, kind))
        except ValidationError as error:
            self.findings += settings_findings(error, registry.find(form, kind).settings, location)
        return base.model_construct(kind=kind)

    def _misfits(self, component: Component, model: Any, location: Location, kind: str) -> Iterator[Finding]:
        """Yield what the world or a model does not have that a component needs."""
        if component.kit and self._data.get(component.kit) is None:
            yield Finding(location, f"{component.form} of a {component.kit} in a world without one", kind)
            return
        known = MODELS.get(model) if isinstance(model, str) else None
        missing = [] if known is None else [field for field in component.needs if field not in known.slots]
        if missing:
            fitting = ", ".join(name for name, other in MODELS.items() if {*component.needs} <= {*other.slots})
            lacking = f"a {model} cannot carry, which has no {', '.join(missing)}"
            yield Finding(location, f"{component.form} that {lacking} (valid on: {fitting})", kind)

    def _modifiers(self, location: Location, modifiers: list[Any]) -> Iterator[Any]:
        for number, settings in enumerate(modifiers):
            yield self._component("modifier", ModifierSettings, None, (*location, number), settings)

    def _unfit_modifiers(
        self, component: Component, settings: SensorSettings | ActuatorSettings, location: Location
    ) -> Iterator[Finding]:
        """Yield the settings of modifiers that do not fit the readings or commands that these are on."""
        numbers = numbers_of(component, settings)
        for number, modifier in enumerate(settings.modifiers):
            place: Location = (*location, "modifiers", number)
            if numbers is None:
                what = f"a modifier of what is not numbers alone: {component.form} {component.name}"
                yield Finding((*place, "kind"), what, modifier.kind)
                continue
            period_ns = self._period_ns(settings)
            if type(modifier) is not ModifierSettings and period_ns is not None:
                yield from _unfit(
                    registry.find("modifier", modifier.kind), modifier, Carrier(numbers.size, period_ns), numbers, place
                )

    def _period_ns(self, settings: SensorSettings | ActuatorSettings) -> int | None:
        """Return the time between two values; None where it is wrong, which is found elsewhere."""
        try:
            tick_ns = parse_ns(self._data.get("tick"))
            ticks = period_ticks(settings.rate_hz, tick_ns) if isinstance(settings, SensorSettings) else 1
            return ticks * tick_ns or None
        except (BadValue, ZeroDivisionError):
            return None


def _competing(actuators: Any, location: Location) -> Iterator[Finding]:
    """Yield the actuators that command motors which another one commands already."""
    moving = [
        (name, settings.kind)
        for name, settings in (actuators.items() if isinstance(actuators, dict) else ())
        if type(settings) is not ActuatorSettings
        and isinstance(settings, ActuatorSettings)
        and registry.find("actuator", settings.kind).moves
    ]
    for name, kind in moving[1:]:
        yield Finding((*location, name, "kind"), f"commands the motors that {moving[0][0]} commands already", kind)


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
        check = getattr(component.made, "check", None)
        if check is not None:
            check(settings, numbers)
        component.slots_on(settings, carrier)
    except BadValue as error:
        yield Finding((*place, "kind"), error.problem, error.value, error.nearest)
