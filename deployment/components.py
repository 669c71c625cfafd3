"""Reads the settings of all component types of a deployment: each by the class that registered its kind, which the
settings then know. After this nothing is looked up by kind.

Kinds are open, so their settings are read before the schema of the deployment is applied, which takes what was read as
it is: of kits, rules of the world, the scene, robots and their components.
"""

from collections.abc import Collection, Mapping
from typing import Any, Final, Literal

from pydantic import BaseModel, ValidationError

from foosim.common.errors import BadValue
from foosim.common.finding import Finding, Location
from foosim.common.spec_base import SpecBase
from foosim.deployment.schema_errors import settings_findings
from foosim.world.component_types import registry
from foosim.world.component_types.settings import BASES, RobotSettings
from foosim.world.spec import KITS

ROBOTS: Final = "robots"
SECTIONS: Final[Mapping[str, str]] = {"sensors": "sensor", "actuators": "actuator", "rules": "entity_rule"}
"""The sections of a robot that have components, and the type name of these."""
OF_MODEL: Final = ("actuators", "rules")
"""The sections that a robot without them has from its model."""


def read_components(data: Any, known: Collection[str]) -> tuple[Any, list[Finding]]:
    """Return a deployment's plain data with the settings of all component types read, and the findings about them.

    `known` are the keys of a deployment; any other that is the name of a kit is that kit's section.
    """
    if not isinstance(data, dict):
        return data, []
    reader = _Reader()
    read = {key: value for key, value in data.items() if key != KITS}
    if isinstance(engine := data.get("engine"), str):
        try:
            registry.find_engine(engine)
        except BadValue as error:
            reader.findings.append(Finding(("engine",), error.problem, engine, error.nearest))
            del read["engine"]
    kits = {key: read.pop(key) for key in data if key not in known and reader.is_kit(key)}
    if KITS in data:
        reader.findings.append(Finding((KITS,), "unknown key", KITS, at="key"))
    read[KITS] = {key: reader.kit(key, section) for key, section in kits.items() if section is not None}
    for section in (ROBOTS, "objects"):
        if isinstance(data.get(section), dict):
            read[section] = {name: reader.entity((section, name), one) for name, one in data[section].items()}
    for section, type_name in (("rules", "rule"), ("gateways", "gateway")):
        if isinstance(data.get(section), dict):
            read[section] = {
                name: reader.component(type_name, (section, name), one) for name, one in data[section].items()
            }
    if isinstance(data.get("scene"), dict):
        read["scene"] = reader.component("scene", ("scene",), data["scene"])
    return read, reader.findings


class _Reader:
    """Reads the component types of one deployment, and gathers findings."""

    def __init__(self) -> None:
        self.findings: list[Finding] = []
        self._read: dict[tuple[str, int], Any] = {}
        """What was read without findings: by type name and the identity of its plain data, which lives as long."""

    def find(self, type_name: str, kind: str, location: Location) -> Any:
        """Return a component type; None, reported, where there is none."""
        try:
            return registry.find(type_name, kind)
        except BadValue as error:
            self.findings.append(Finding(location, error.problem, kind, error.nearest))
        return None

    def is_kit(self, key: Any) -> bool:
        """Whether a kit has this name; one that cannot be imported is reported."""
        try:
            return isinstance(key, str) and registry.lookup("kit", key) is not None
        except BadValue as error:
            self.findings.append(Finding((key,), error.problem, key, error.nearest, at="key"))
        return False

    def settings(self, settings_type: type[BaseModel], data: Any, location: Location) -> Any:
        """Return settings; None, reported, where they are refused."""
        try:
            return settings_type.model_validate(data)
        except ValidationError as error:
            self.findings += settings_findings(error, settings_type, location)
        return None

    def kit(self, name: str, section: Any) -> Any:
        """Return the settings of a kit; without keys in place of refused ones."""
        return self.settings(registry.find("kit", name).settings, section, (name,)) or SpecBase.model_construct()

    def entity(self, location: Location, robot: Any) -> Any:
        """Return the settings of a robot or an object; with its model alone in place of refused ones."""
        if not isinstance(robot, dict):
            return robot
        name, is_robot, place = robot.get("model"), location[0] == ROBOTS, (*location, "model")
        model = None
        if not isinstance(name, str):
            what = "missing key" if name is None else "not a text"
            at: Literal["missing", "value"] = "missing" if name is None else "value"
            self.findings.append(Finding(place, what, name or "model", at=at))
            return RobotSettings.model_construct(model="")
        try:
            model = registry.find_model(name).variant(robot.get("dynamics"))
        except BadValue as error:
            choices = [one for one in registry.names("model") if registry.find_model(one).is_robot == is_robot]
            refused = error if ":" in name else registry.unknown("model", name, choices)
            self.findings.append(Finding(place, refused.problem, name, refused.nearest))
        if model is not None and model.is_robot != is_robot:
            other = "is there without an owner" if is_robot else "has an owner, and stands in robots"
            what = f"no model of {'robots' if is_robot else 'objects'}: {model.name} {other}"
            self.findings.append(Finding(place, what, name))
            return RobotSettings.model_construct(model=name)
        found = dict(robot)
        for section in OF_MODEL if model is not None and is_robot else ():
            if found.get(section) is None:
                found[section] = dict(getattr(model, section))
        for section, type_name in SECTIONS.items():
            if isinstance(found.get(section), dict):
                components = found[section].items()
                found[section] = {
                    key: self.component(type_name, (*location, section, key), one) for key, one in components
                }
        settings = None if model is None else self.settings(model.settings, found, location)
        return RobotSettings.model_construct(model=name) if settings is None else settings.typed(model)

    def component(self, type_name: str, location: Location, data: Any) -> Any:
        """Return the settings of one component; with its kind alone in place of refused ones.

        What many robots share, by a template, is read once.
        """
        kind = data.get("kind") if isinstance(data, dict) else None
        if not isinstance(kind, str):
            return data
        key, count = (type_name, id(data)), len(self.findings)
        if key in self._read:
            return self._read[key]
        settings, found = None, self.find(type_name, kind, (*location, "kind"))
        if found is not None:
            modifiers = data.get("modifiers")
            if isinstance(modifiers, list):
                places = ((*location, "modifiers", number) for number in range(len(modifiers)))
                data = {**data, "modifiers": [*map(self.component, ["modifier"] * len(modifiers), places, modifiers)]}
            settings = self.settings(found.settings, data, location)
        if settings is None:
            return BASES[type_name].model_construct(kind=kind)
        settings.typed(found)
        if len(self.findings) == count:
            self._read[key] = settings
        return settings
