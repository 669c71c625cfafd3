"""The JSON Schema of a deployment file: that of the parts that are always there, and of all component types."""

import json
from typing import Any, Final

from foosim.common.names import CLASS_PATTERN
from foosim.deployment.schema import Deployment
from foosim.deployment.text.file_schema import file_schema
from foosim.world.component_types import registry
from foosim.world.component_types.descriptions import ENGINES, ComponentType, Kit, Model, with_article, word_of
from foosim.world.component_types.settings import BASES, EntitySettings, RobotSettings
from foosim.world.spec import KITS

OPEN: Final = {base.__name__: type_name for type_name, base in BASES.items()}
"""The type name of the component types that a definition accepts."""
OWN: Final = "foosim."
REF: Final = "#/$defs/"


def deployment_schema(*, installed: bool = False) -> dict[str, Any]:
    """The JSON Schema of a deployment in which nothing is abbreviated, which the checks and the reference go by.

    It has foosim's own component types; with `installed` those of other packages, too. The settings of one that is
    named as `module:Class` are any.
    """
    schema = Deployment.model_json_schema(by_alias=True, mode="validation")
    engines = [name for name in registry.engines() if installed or ENGINES[name].path.startswith(OWN)]
    schema["properties"]["engine"] = {"enum": engines, "title": "Engine", "type": "string"}
    definitions = schema["$defs"]
    for name, type_name in OPEN.items():
        if type_name != "model":
            definitions[name] = _any_of(type_name, definitions, installed=installed)
    properties = {key: value for key, value in schema["properties"].items() if key != KITS}
    for kind in registry.names("kit"):
        kit = registry.find("kit", kind)
        if installed or kit.module.startswith(OWN):
            properties[kind] = {"$ref": REF + _add(kit, definitions)}
    for section, is_robot in (("robots", True), ("objects", False)):
        entities = _any_of("model", definitions, installed=installed, is_robot=is_robot)
        ((pattern, _),) = properties[section]["patternProperties"].items()
        properties[section] = {**properties[section], "patternProperties": {pattern: entities}}
    for name in (RobotSettings.__name__, EntitySettings.__name__):
        definitions.pop(name)
    schema["properties"] = properties
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema, "title": "foosim deployment"}


def deployment_schema_text(*, installed: bool = False) -> str:
    """Return the content of deploy/deployment.schema.json: the JSON Schema of a deployment's file, for editors."""
    kits = ((name, registry.find("kit", name)) for name in registry.names("kit"))
    presets = {name: list(kit.presets) for name, kit in kits if isinstance(kit, Kit) and kit.presets}
    return json.dumps(file_schema(deployment_schema(installed=installed), presets), indent=2) + "\n"


def _any_of(type_name: str, definitions: dict[str, Any], *, installed: bool, is_robot: bool = True) -> dict[str, Any]:
    """Return the schema of all component types with a type name, by kind, and add that of each kind to the definitions.

    Of models those of robots, or those of objects, without the ones that only a kit brings.
    """
    key = "model" if type_name == "model" else "kind"
    mapping = {}
    for kind in registry.names(type_name):
        found = registry.find(type_name, kind)
        if not installed and not found.module.startswith(OWN):
            continue
        if isinstance(found, Model) and (found.is_robot != is_robot or (found.kit and not is_robot)):
            continue
        name = _add(found, definitions)
        mapping[kind] = REF + name
        properties = definitions[name]["properties"]
        definitions[name]["properties"] = {**properties, key: {"const": kind, "title": key.title(), "type": "string"}}
    noun = with_article(word_of(type_name)).capitalize()
    any_class = f"{type_name.title().replace('_', '')}ByClass"
    definitions[any_class] = {
        "allOf": [{"required": [key]}],  # of a part of it, too: any other part is one of a kind that is known
        "description": f"{noun} of any module on the path. Its other keys are those of its settings.",
        "properties": {key: {"pattern": CLASS_PATTERN, "title": "Class", "type": "string"}},
        "required": [key],
        "title": any_class,
        "type": "object",
    }
    return {
        "discriminator": {"mapping": mapping, "propertyName": key},
        "oneOf": [{"$ref": reference} for reference in (*mapping.values(), REF + any_class)],
    }


def _add(component_type: ComponentType, definitions: dict[str, Any]) -> str:
    """Add the schema of a component type's settings to the definitions, and what it refers to; return its name there.

    Classes of other packages may have equal names: theirs begin with type name and kind.
    """
    schema = component_type.settings.model_json_schema(by_alias=True, ref_template=REF + "{model}")
    inner = schema.pop("$defs", {})
    schema = inner.pop(schema["$ref"].removeprefix(REF)) if "$ref" in schema else schema
    is_own = component_type.module.startswith(OWN)
    name = component_type.settings.__name__ if is_own else f"{component_type.type_name}.{component_type.name}"
    if not is_own:
        renamed = {REF + other: f"{REF}{name}.{other}" for other in inner if other not in OPEN}
        renamed[REF + component_type.settings.__name__] = REF + name  # where it refers to itself
        schema = _with_references(schema, renamed)
        inner = {
            (renamed.get(REF + other) or other).removeprefix(REF): _with_references(its, renamed)
            for other, its in inner.items()
        }
    assert name not in definitions or name in OPEN, f"two definitions are called {name}"
    for other, its in inner.items():
        assert other in OPEN or definitions.get(other, its) == its, f"two definitions are called {other}"
        definitions.setdefault(other, its)
    definitions[name] = schema
    return name


def _with_references(schema: Any, renamed: dict[str, str]) -> Any:
    """Return a schema whose references have other names."""
    if isinstance(schema, list):
        return [_with_references(one, renamed) for one in schema]
    if not isinstance(schema, dict):
        return schema
    return {
        key: renamed.get(value, value) if isinstance(value, str) else _with_references(value, renamed)
        for key, value in schema.items()
    }
