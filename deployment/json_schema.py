"""The JSON Schema of a deployment file: that of the parts that are always there, and of the components of robots."""

import json
from typing import Any, Final

from foosim.deployment.schema import Deployment
from foosim.deployment.text.file_schema import file_schema
from foosim.world.forms import registry
from foosim.world.forms.settings import ActuatorSettings, ModifierSettings, SensorSettings

OPEN: Final = {
    SensorSettings.__name__: "sensor",
    ActuatorSettings.__name__: "actuator",
    ModifierSettings.__name__: "modifier",
}
"""Definitions that stand for any component of a form."""
OWN: Final = "foosim."


def deployment_schema(*, installed: bool = False) -> dict[str, Any]:
    """The JSON Schema of a deployment in which nothing is abbreviated, which the checks and the reference go by.

    It has foosim's own components; with `installed` those of other packages, too.
    """
    schema = Deployment.model_json_schema(by_alias=True, mode="validation")
    definitions = schema["$defs"]
    for name, form in OPEN.items():
        definitions[name] = _any_of_form(form, definitions, installed=installed)
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema, "title": "foosim deployment"}


def deployment_schema_text(*, installed: bool = False) -> str:
    """What deploy/deployment.schema.json holds: the JSON Schema of a deployment's file, for editors and for people."""
    return json.dumps(file_schema(deployment_schema(installed=installed)), indent=2) + "\n"


def _any_of_form(form: str, definitions: dict[str, Any], *, installed: bool) -> dict[str, Any]:
    """Return the schema of a component of a form by its kind, and add that of each kind to the definitions."""
    mapping = {}
    for kind in registry.names(form):
        component = registry.find(form, kind)
        if not installed and not component.module.startswith(OWN):
            continue
        settings = component.settings
        name = settings.__name__ if component.module.startswith(OWN) else f"{kind.title()}{form.title()}Settings"
        schema = settings.model_json_schema(by_alias=True, ref_template="#/$defs/{model}")
        inner = schema.pop("$defs", {})
        schema = inner.pop(schema["$ref"].rpartition("/")[2]) if "$ref" in schema else schema
        definitions |= {name: other for name, other in inner.items() if name not in definitions}
        schema["properties"]["kind"] = {"const": kind, "title": "Kind", "type": "string"}
        definitions[name] = schema
        mapping[kind] = f"#/$defs/{name}"
    return {
        "discriminator": {"mapping": mapping, "propertyName": "kind"},
        "oneOf": [{"$ref": reference} for reference in mapping.values()],
    }
