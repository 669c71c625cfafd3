"""The JSON Schema of a deployment file: that of the parts that are always there, and of all forms."""

import json
from typing import Any, Final

from pydantic import BaseModel

from foosim.common.names import CLASS_PATTERN
from foosim.deployment.schema import Deployment
from foosim.deployment.text.file_schema import file_schema
from foosim.world.forms import registry
from foosim.world.forms.settings import (
    ActuatorSettings,
    EntityRuleSettings,
    ModifierSettings,
    RobotSettings,
    RuleSettings,
    SceneSettings,
    SensorSettings,
)
from foosim.world.spec import KITS

OPEN: Final = {
    SensorSettings.__name__: "sensor",
    ActuatorSettings.__name__: "actuator",
    ModifierSettings.__name__: "modifier",
    EntityRuleSettings.__name__: "entity_rule",
    RuleSettings.__name__: "rule",
    SceneSettings.__name__: "scene",
    RobotSettings.__name__: "model",
}
"""Definitions that stand for anything of a form."""
OWN: Final = "foosim."


def deployment_schema(*, installed: bool = False) -> dict[str, Any]:
    """The JSON Schema of a deployment in which nothing is abbreviated, which the checks and the reference go by.

    It has foosim's own components; with `installed` those of other packages, too.
    """
    schema = Deployment.model_json_schema(by_alias=True, mode="validation")
    schema["properties"]["engine"] = _any_engine(installed=installed)
    definitions = schema["$defs"]
    for name, form in OPEN.items():
        definitions[name] = _any_of_form(form, definitions, installed=installed)
    properties = {key: value for key, value in schema["properties"].items() if key != KITS}
    for kind in registry.names("kit"):
        kit = registry.find("kit", kind)
        if installed or kit.module.startswith(OWN):
            properties[kind] = {"$ref": _add(kit.settings, kit.settings.__name__, definitions)}
    robots = definitions.pop(RobotSettings.__name__)
    ((pattern, _),) = properties["robots"]["patternProperties"].items()
    properties["robots"] = {**properties["robots"], "patternProperties": {pattern: robots}}
    schema["properties"] = properties
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema, "title": "foosim deployment"}


def deployment_schema_text(*, installed: bool = False) -> str:
    """What deploy/deployment.schema.json holds: the JSON Schema of a deployment's file, for editors and for people."""
    return json.dumps(file_schema(deployment_schema(installed=installed)), indent=2) + "\n"


def _any_engine(*, installed: bool) -> dict[str, Any]:
    """Return the schema of an engine's name."""
    found = [registry.find("engine", name) for name in registry.names("engine")]
    known = [engine.name for engine in found if installed or engine.module.startswith(OWN)]
    of_class = {"pattern": CLASS_PATTERN, "title": "Class", "type": "string"}
    return {"anyOf": [{"enum": known, "type": "string"}, of_class], "title": "Engine"}


def _any_of_form(form: str, definitions: dict[str, Any], *, installed: bool) -> dict[str, Any]:
    """Return the schema of anything of a form by its kind, and add that of each kind to the definitions."""
    key = "model" if form == "model" else "kind"
    mapping = {}
    for kind in registry.names(form):
        found = registry.find(form, kind)
        is_own = found.module.startswith(OWN)
        if (not installed and not is_own) or not getattr(found, "is_robot", True):
            continue
        name = found.settings.__name__ if is_own else f"{kind.title()}{form.title()}Settings"
        assert name not in definitions or name in OPEN, f"two definitions are called {name}"
        mapping[kind] = _add(found.settings, name, definitions)
        properties = definitions[name]["properties"]
        definitions[name]["properties"] = {**properties, key: {"const": kind, "title": key.title(), "type": "string"}}
    return {
        "discriminator": {"mapping": mapping, "propertyName": key},
        "oneOf": [{"$ref": reference} for reference in mapping.values()],
    }


def _add(settings: type[BaseModel], name: str, definitions: dict[str, Any]) -> str:
    """Add the schema of settings to the definitions, and what it refers to; return the reference to it."""
    schema = settings.model_json_schema(by_alias=True, ref_template="#/$defs/{model}")
    inner = schema.pop("$defs", {})
    schema = inner.pop(schema["$ref"].rpartition("/")[2]) if "$ref" in schema else schema
    for other, its in inner.items():
        definitions.setdefault(other, its)
    definitions[name] = schema
    return f"#/$defs/{name}"
