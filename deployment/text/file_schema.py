"""The JSON Schema of a deployment file: that of the models, with the abbreviations of files.

Entries of a section may be like a template, and then have any part of their keys; in those for each robot texts may
have signs (`$robot`). What is missing in the end, and whether names exist, only `foosim check` says.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

from foosim.common import limits
from foosim.common.names import NAME_PATTERN, SELECTOR_LENGTH_MAX, SELECTOR_PATTERN
from foosim.deployment.text.expand import ENTRIES, FLEETS, FOR_ROBOTS
from foosim.deployment.text.includes import INCLUDE
from foosim.deployment.text.made import AXES, COUNT, EACH, SPACING, SPARE
from foosim.deployment.text.templates import LIKE, PRESET, TEMPLATES

Schema = dict[str, Any]

DESCRIPTIONS: Final[Mapping[str, str]] = {
    INCLUDE: "files with further sections, by their paths in the folder of this one",
    TEMPLATES: "partial robots, things of the scenery, players and clients, which entries are `like`",
    LIKE: "the name of a template, whose keys apply where this entry has none",
    COUNT: "how many of these there are: NAME-1 to NAME-N",
    SPARE: "whether it is absent until it is added, or how many more of these are: the last ones",
    SPACING: "the distance along x, y and z from each of them to the next",
    PRESET: "the name of a preset of the kit, whose keys apply where this section has none",
    EACH: "a selector of robots: there is one of these for each, and $robot is its name",
}
NUMBERED: Final = "-[1-9][0-9]*$"
"""Ends the name of an entry of a count; the file may have an entry of that name with its own keys."""
_OF_WHOLE: Final = ("required", "discriminator", "minProperties")
"""Keywords of whole entries alone."""
_PARTIAL: Final = "Partial"
_REF: Final = "#/$defs/"
_NULL: Final[Schema] = {"type": "null"}
_SPACINGS: Final[Schema] = {
    "additionalProperties": False,
    "description": DESCRIPTIONS[SPACING],
    "properties": {axis: {"type": "string"} for axis in AXES},
    "type": "object",
}
_SELECTOR: Final[Schema] = {"maxLength": SELECTOR_LENGTH_MAX, "pattern": SELECTOR_PATTERN, "type": "string"}
_ROBOTS: Final[Schema] = {"items": _SELECTOR, "maxItems": limits.ENTITIES_MAX, "title": "Robots", "type": "array"}
"""Of a node."""
_SIGNS: Final[Schema] = {"pattern": "[$]", "type": "string"}


def file_schema(schema: Schema, presets: Mapping[str, Sequence[str]]) -> Schema:
    """Return the schema of a deployment's file, from that of the expanded deployment, which stays unchanged.

    `presets` are the names of the presets of each kit.
    """
    properties, models = dict(schema["properties"]), dict(schema["$defs"])
    partly_of: list[Schema] = []
    for section in ENTRIES:
        own: Schema = {LIKE: _text(LIKE)}
        if section in FLEETS:
            count = {"maximum": FLEETS[section], "minimum": 1, "type": "integer"}
            spare = {"anyOf": [{"type": "boolean"}, count], "default": False, "description": DESCRIPTIONS[SPARE]}
            own |= {COUNT: {"description": DESCRIPTIONS[COUNT], **count}, SPARE: spare, SPACING: _SPACINGS}
        else:
            own |= {EACH: {**_text(EACH), **_SELECTOR}}
        ((pattern, entry),) = properties[section]["patternProperties"].items()
        partial = _Partial(models, has_signs=section in FOR_ROBOTS)
        partly: Schema = {"anyOf": [partial.of(one) for one in entry.get("oneOf", [entry])]}
        for name in [one["$ref"].removeprefix(_REF) for one in entry.get("oneOf", [entry])]:
            models[name] = _with_keys(models[name], own)
            models[name + _PARTIAL] = _with_keys(models[name + _PARTIAL], own)
        partly_of += partly["anyOf"]
        properties[section] = {**properties[section], "patternProperties": _entries(section, pattern, entry, partly)}
    for kit, names in presets.items():
        if kit in properties:
            properties[kit] = _with_presets(properties[kit], names, models)
    models["NodeSpec"] = _with_keys(models["NodeSpec"], {"robots": _ROBOTS})
    properties[TEMPLATES] = {
        "description": DESCRIPTIONS[TEMPLATES],
        "maxProperties": limits.TEMPLATES_MAX,
        "patternProperties": {NAME_PATTERN: {"anyOf": partly_of}},
        "type": "object",
    }
    paths = {"items": {"type": "string"}, "maxItems": limits.INCLUDES_MAX, "type": "array"}
    properties[INCLUDE] = {"anyOf": [{"type": "string"}, paths], "description": DESCRIPTIONS[INCLUDE]}
    rest = {key: value for key, value in schema.items() if key != "required"}
    alone = {"if": {"required": [INCLUDE]}, "else": {"required": schema["required"]}}
    return {**rest, "$defs": models, "properties": properties, **alone}


def _entries(section: str, pattern: str, entry: Schema, partly: Schema) -> Schema:
    """Return the schemas of a section's entries by the pattern of their names."""
    if section in FOR_ROBOTS:  # each may have the own keys of a made entry
        return {pattern: partly, "[$]": partly}
    whole = {"if": {"required": [LIKE]}, "then": partly, "else": entry}
    return {f"^(?!.*{NUMBERED}){pattern[1:]}": whole, f"^(?=.*{NUMBERED}){pattern[1:]}": partly}


def _with_presets(section: Schema, names: Sequence[str], models: Schema) -> Schema:
    """Return the schema of a kit's section, of which any part may be there with a preset."""
    partly = _Partial(models, has_signs=False).of(section)
    name = partly["$ref"].removeprefix(_REF)
    preset = {"description": DESCRIPTIONS[PRESET], "enum": [*names], "type": "string"}
    models[name] = _with_keys(models[name], {PRESET: preset})
    return {"if": {"required": [PRESET]}, "then": partly, "else": section}


def _with_keys(model: Schema, keys: Schema) -> Schema:
    return {**model, "properties": {**model["properties"], **keys}}


def _text(key: str) -> Schema:
    return {"description": DESCRIPTIONS[key], "type": "string"}


class _Partial:
    """Makes schemas of which any part of the keys may be there, and null in place of each; adds them to the models."""

    def __init__(self, models: Schema, *, has_signs: bool) -> None:
        self._models = models
        self._has_signs = has_signs

    def of(self, schema: Schema) -> Schema:
        """Return the partial form of a schema."""
        if "$ref" in schema:
            return self._of_model(schema["$ref"].removeprefix(_REF))
        left = {key: value for key, value in schema.items() if key not in _OF_WHOLE}
        for key in ("oneOf", "anyOf"):
            if key in left:
                left["anyOf"] = [self.of(one) for one in left.pop(key)]
        for key in ("items", "additionalProperties"):
            if isinstance(left.get(key), dict):
                left[key] = self.of(left[key])
        for key in ("patternProperties", "properties"):
            if key in left:
                left[key] = {name: {"anyOf": [self.of(value), _NULL]} for name, value in left[key].items()}
        return {"anyOf": [left, _SIGNS]} if self._has_signs and left.get("type") == "string" else left

    def _of_model(self, name: str) -> Schema:
        partial = name + _PARTIAL
        if not self._models[name].keys() & {"properties", "oneOf"}:
            return {"$ref": _REF + name}
        if partial not in self._models:
            self._models[partial] = {}  # it may hold itself
            self._models[partial] = {**self.of(self._models[name]), "title": partial}
        return {"$ref": _REF + partial}
