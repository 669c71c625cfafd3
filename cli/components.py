"""What `foosim components` shows: the component types that a deployment can name here."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Final

from foosim.common.errors import UnknownName
from foosim.world.component_types import registry
from foosim.world.component_types.descriptions import ROBOTS, Component, ComponentType, Model, References
from foosim.world.component_types.payloads import PayloadCodec
from foosim.world.component_types.registration import VALUES
from foosim.world.component_types.registry import TYPE_NAMES
from foosim.world.component_types.settings import ActuatorSettings, EntityRuleSettings, ModifierSettings, SensorSettings
from foosim.world.placing import is_placed
from foosim.world.setting.settable import valid

OF_TYPE: Final[Mapping[str, tuple[str, ...]]] = {
    "model": ("is_robot", "mover", "actuators", "rules", "tags"),
    "rule": ("each", "writes"),
    "entity_rule": ("writes", "shared"),
    "kit": ("entities", "rules", "presets"),
}
"""The fields to print of a component type, besides those of all."""
SETTINGS_OF: Final[Mapping[str, str]] = {
    SensorSettings.__name__: "sensor",
    ActuatorSettings.__name__: "actuator",
    ModifierSettings.__name__: "modifier",
    EntityRuleSettings.__name__: "entity_rule",
}
"""The type name of the components whose settings are of a class."""
BOUNDS: Final[Mapping[str, str]] = {
    "minimum": "at least",
    "exclusiveMinimum": "more than",
    "maximum": "at most",
    "exclusiveMaximum": "less than",
}


def chosen(type_name: str | None, name: str | None) -> list[ComponentType]:
    """Return the component types with this type name and this name, or all of them. Raises UnknownName."""
    if type_name is not None and type_name not in TYPE_NAMES:
        named = (
            [one for one in TYPE_NAMES if registry.lookup(one, type_name) is not None] if ":" not in type_name else []
        )
        raise UnknownName(
            "; ".join(["unknown component type", *(f"is it {one} {type_name}?" for one in named)]),
            type_name,
            TYPE_NAMES,
        )
    type_names = TYPE_NAMES if type_name is None else (type_name,)
    if name is None:
        return [registry.find(one, kind) for one in type_names for kind in registry.names(one)]
    return [registry.find(one, name) for one in type_names]


def as_json(component: ComponentType) -> dict[str, Any]:
    """Return all properties of one."""
    slots = getattr(component, "slots", {})
    about: dict[str, Any] = {
        "type": component.type_name,
        "name": component.name,
        "summary": component.summary,
        "class": f"{component.module}:{component.factory.__qualname__}",
        "settings": [{"key": key, "value": value, "default": default} for key, value, default in _settings(component)],
        "slots": None if callable(slots) else {field: _size(size) for field, size in slots.items()},
        "needs": list(getattr(component, "needs", ())),
        "kit": component.kit,
        **{key: _plain(getattr(component, key)) for key in OF_TYPE.get(component.type_name, ())},
        "settable": _settable(component),
    }
    if isinstance(component, Model) and component.variants:
        about["variants"] = {
            dynamics: {"class": f"{one.module}:{one.factory.__qualname__}", **_moved(one)}
            for dynamics, one in component.variants.items()
        }
    if isinstance(component, Component) and component.value is not None:
        fields = PayloadCodec(component.value, component.name).fields
        about[VALUES[component.type_name]] = [
            {"field": field.name, "unit": field.unit, "several": field.is_several} for field in fields
        ]
    return about


def _settable(component: ComponentType) -> dict[str, str]:
    """Return the fields that can be set during a run, each with its valid values."""
    if isinstance(component, Model):
        placed = {"at": "a pose"} if is_placed(component.settings) else {}
        its = placed | ({"down": "true or false"} if component.is_robot else {})
    else:
        its = {}
    return its | {name: valid(one) for name, one in getattr(component, "settable", {}).items()}


def _size(size: Any) -> int | None:
    """Return the count of a slot's numbers; None where that follows from settings."""
    return None if callable(size) else int(size)


def _moved(model: Model) -> dict[str, Any]:
    """Return what moves the entities of a model, and the slots of their state."""
    slots = None if callable(model.slots) else {field: _size(size) for field, size in model.slots.items()}
    return {"mover": model.mover, "slots": slots}


def line(component: ComponentType) -> str:
    """Return one in one line."""
    return f"{component.type_name:11} {component.name:16} {component.summary}"


def lines(component: ComponentType) -> Iterator[str]:
    """Yield one in full."""
    about = as_json(component)
    yield f"{component.type_name} {component.name}, of {about['class']}"
    yield f"  {component.summary}"
    if about["settings"]:
        yield "  settings"
    for setting in about["settings"]:
        default = {None: "required", "": "optional"}.get(setting["default"], f"default {setting['default']}")
        yield f"    {setting['key']}: {setting['value']} ({default})"
    if component.type_name in VALUES:
        fields = about[VALUES[component.type_name]]
        units = [f"{field['field']}{'[]' if field['several'] else ''} {field['unit']}".rstrip() for field in fields]
        yield f"  {VALUES[component.type_name]}: {', '.join(units)}"
    if about["slots"]:
        yield f"  slots: {_counted(about['slots'])}"
    elif about["slots"] is None:
        yield "  slots: by its settings"
    if about["needs"]:
        yield f"  needs a model with: {', '.join(about['needs'])}"
    yield from _lines_of_form(about)
    if about["settable"]:
        yield f"  can be set: {', '.join(f'{name} ({valid})' for name, valid in about['settable'].items())}"
    if component.kit:
        yield f"  needs a deployment with: {component.kit}"


def _lines_of_form(about: Mapping[str, Any]) -> Iterator[str]:
    """Yield the lines of a component type's own fields; empty fields have none."""
    for whose, slots in about.get("each", {}).items():
        yield f"  slots of each {'robot' if whose == ROBOTS else whose}: {_counted(slots)}"
    if about.get("writes"):
        yield f"  writes: {', '.join(about['writes'])}"
    if about.get("shared"):
        yield f"  slots that are the model's where it has them: {', '.join(about['shared'])}"
    if about["type"] == "model":
        yield "  a robot" if about["is_robot"] else "  not a robot, has no owner"
        yield f"  moved by: {about['mover']}"
        for dynamics, its in about.get("variants", {}).items():
            slots = "by its settings" if its["slots"] is None else _counted(its["slots"])
            yield f"  with dynamics: {dynamics}, moved by: {its['mover']}; slots: {slots}"
    usual = "usual " if about["type"] == "model" else ""
    for key in ("actuators", "rules"):
        if about.get(key):
            kinds = {name: settings["kind"] for name, settings in about[key].items()}
            yield f"  {usual}{key}: {_paired(kinds)}"
    if about.get("tags"):
        yield f"  tags: {', '.join(about['tags'])}"
    if about.get("entities"):
        yield f"  beside the robots: {_paired(about['entities'])}"
    if about.get("presets"):
        yield f"  presets: {', '.join(about['presets'])}"


def _paired(kinds: Mapping[str, str]) -> str:
    return ", ".join(f"{name} ({kind})" for name, kind in kinds.items())


def _counted(slots: Mapping[str, int | None]) -> str:
    sizes = {field: "n by settings" if size is None else size for field, size in slots.items()}
    return ", ".join(field if size == 1 else f"{field}[{size}]" for field, size in sizes.items())


def _plain(value: Any) -> Any:
    """Return mappings, sequences and counts of references as JSON has them."""
    if isinstance(value, Mapping):
        return {key: _plain(inner) for key, inner in value.items()}
    if isinstance(value, References):
        return int(value)
    return list(value) if isinstance(value, tuple) else value


def _settings(component: ComponentType) -> Iterator[tuple[str, str, str | None]]:
    """Yield key, valid values and default of each setting; None where it is required."""
    schema = component.settings.model_json_schema(by_alias=True)
    yield from _properties(schema, schema.get("$defs", {}), "")


def _properties(
    schema: Mapping[str, Any], definitions: Mapping[str, Any], path: str
) -> Iterator[tuple[str, str, str | None]]:
    """Yield the settings of a schema; nested settings follow the key of theirs and a point."""
    required = schema.get("required", ())
    for key, value in schema["properties"].items():
        found = _followed(value, definitions)
        each = _followed(_inner(found), definitions)
        if "properties" in found:
            yield from _properties(found, definitions, f"{path}{key}.")
        elif "properties" in each and "kind" not in each["properties"]:
            yield from _properties(each, definitions, f"{path}{key}.NAME.")
        elif key != "kind":
            default = None if key in required else str(value.get("default", ""))
            yield f"{path}{key}", _valid(found), default


def _inner(value: Mapping[str, Any]) -> Any:
    """Return the schema of the values of a mapping with arbitrary names; empty for another schema."""
    return next(iter(value.get("patternProperties", {}).values()), value.get("additionalProperties", {}))


def _followed(value: Any, definitions: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the schema without references, and without `or null`."""
    if not isinstance(value, dict):
        return {}
    if "$ref" in value:
        return _followed(definitions[value["$ref"].rpartition("/")[2]], definitions)
    choices = [choice for choice in value.get("anyOf", ()) if choice.get("type") != "null"]
    return _followed(choices[0], definitions) if len(choices) == 1 and "description" not in value else value


def _valid(value: Mapping[str, Any]) -> str:
    """Return in words which values a setting accepts."""
    if "description" in value:
        return str(value["description"])
    if "enum" in value:
        return " or ".join(map(str, value["enum"]))
    for inner, how in ((_inner(value), "by name"), (value.get("items"), "a list")):
        if isinstance(inner, dict) and inner:
            type_name = SETTINGS_OF.get(inner.get("$ref", "").rpartition("/")[2])
            return (
                f"{how}: of {type_name}s, see components {type_name}" if type_name else f"{how}, each: {_valid(inner)}"
            )
    bounds = [f"{word} {value[key]}" for key, word in BOUNDS.items() if key in value]
    return ", ".join([str(value.get("type", "any")), *bounds])
