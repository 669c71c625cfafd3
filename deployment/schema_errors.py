"""Translates pydantic's errors about a deployment's data into findings with this project's texts and places.

pydantic reports where in the *models* a value failed: that path has union tags and markers for keys in it, which are in
no file. The path is followed through the JSON Schema of the deployment, which knows what each step is, and which names
and choices are valid there.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache
from typing import Any, Final

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from foosim.common import names
from foosim.common.errors import ABSENT
from foosim.common.finding import Finding, Location
from foosim.common.names import nearest_quoted, quoted
from foosim.deployment import hosts
from foosim.world.component_types import registry

_NAME = "lower case letters, digits, - and _, a letter first"
_PATTERNS: Final = {
    names.NAME_PATTERN: f"not a name ({_NAME})",
    names.ROBOT_NAME_PATTERN: f"not a robot's name (names joined by dots; {_NAME})",
    names.SELECTOR_PATTERN: "not a selector (a name, in which * and ? stand for anything)",
    names.CLASS_PATTERN: "not a class (module:Class)",
    hosts.ADDRESS_PATTERN: "not the name or the IP address of a machine",
    hosts.SSH_PATTERN: "not a destination for ssh (HOST, USER@HOST or ssh://USER@HOST:PORT)",
    hosts.FOLDER_PATTERN: "not an absolute path",
    hosts.OPTION_PATTERN: "not an argument for ssh",
}
_KINDS: Final = {
    "string_type": "not a text",
    "int_type": "not a whole number",
    "float_type": "not a number",
    "bool_type": "not true or false",
    "list_type": "not a list",
    "dict_type": "not a mapping",
    "model_type": "not a mapping",
    "model_attributes_type": "not a mapping",
}
_BOUNDS: Final = {
    "greater_than_equal": "less than the least that is valid, {ge}",
    "less_than_equal": "more than the most that is valid, {le}",
    "greater_than": "not above {gt}",
    "less_than": "not below {lt}",
    "multiple_of": "not a multiple of {multiple_of}",
    "finite_number": "not finite",
    "string_too_long": "longer than {max_length} characters",
    "string_too_short": "shorter than {min_length} characters",
    "too_long": "more than {max_length} entries",
    "too_short": "fewer than {min_length} entries",
}
UNKNOWN: Final = "unknown key"
_BOOLEANS: Final = {"on": "true", "yes": "true", "off": "false", "no": "false"}
# pydantic reports this for a field whose default depends on another, invalid one, which is reported anyway.
_CONSEQUENCES: Final = frozenset({"default_factory_not_called"})


def schema_findings(error: ValidationError, under: Location = ()) -> Iterator[Finding]:
    """One finding for each of pydantic's errors, computed lazily.

    `under` is the location in the deployment of the checked part.
    """
    details = error.errors(include_url=False)
    root = _deployment()
    for detail in details:
        if _is_cause(detail):
            yield _with_failures(_finding(detail, (*under, *detail["loc"]), root))


def settings_findings(error: ValidationError, settings: type[BaseModel], under: Location) -> Iterator[Finding]:
    """One finding for each of pydantic's errors about the settings of a component, which are at `under`."""
    root = _of_settings(settings)
    for detail in error.errors(include_url=False):
        if _is_cause(detail):
            finding = _finding(detail, detail["loc"], root)
            if finding.what == UNKNOWN and finding.nearest is None:
                finding = replace(finding, what=f"{UNKNOWN} (there are: {', '.join(finding.valid) or 'none'})")
            yield replace(finding, location=(*under, *finding.location))


def _with_failures(finding: Finding) -> Finding:
    """Return the finding of a key that no kit has with why packages, of which one might, could not be imported."""
    if finding.what != UNKNOWN or len(finding.location) > 1:
        return finding
    failures = registry.load_entry_points()
    key = finding.location[-1]
    if not failures and finding.nearest is None and isinstance(key, str) and names.is_name(key):
        failures = ["no package that is installed here has a kit of this name"]
    return replace(finding, what="; ".join([UNKNOWN, *failures]))


def _is_cause(detail: ErrorDetails) -> bool:
    return detail["type"] not in _CONSEQUENCES


def _finding(detail: ErrorDetails, path: Location, root: "_Schema") -> Finding:
    kind, value, context = detail["type"], detail["input"], detail.get("ctx", {})
    location, schema, is_key = root.follow(path)
    if kind == "extra_forbidden":
        return _unknown(location, root.follow(path[:-1])[1])
    translate = _TRANSLATIONS.get(kind)
    if translate is not None:
        finding = translate(location, schema, value, context)
        return replace(finding, at="key") if is_key else finding
    nearest = context.get("nearest")
    if kind == "bool_type" and isinstance(value, str):
        nearest = _BOOLEANS.get(value.lower())
    if context.get("pattern") == names.CLASS_PATTERN:
        nearest = quoted(names.class_path_of(str(value)))
    what = _PATTERNS.get(context.get("pattern", "")) or _KINDS.get(kind) or _bounds(kind, context) or detail["msg"]
    if kind == "bad_value" and isinstance(value, dict):
        value = ABSENT  # the error is between its settings, which the text names
    return Finding(location, what, location[-1] if is_key else value, nearest, "key" if is_key else "value")


def _bounds(kind: str, context: Mapping[str, Any]) -> str | None:
    if kind == "too_short" and context.get("min_length", 1) == 1:
        return "empty"
    text = _BOUNDS.get(kind)
    return None if text is None else text.format(**context)


def _missing(location: Location, schema: Mapping[str, Any], value: object, context: Mapping[str, Any]) -> Finding:
    return Finding(location, "missing key", location[-1], at="missing")


def _unknown(location: Location, parent: Mapping[str, Any]) -> Finding:
    key, valid = location[-1], tuple(parent.get("properties", ()))
    return Finding(location, UNKNOWN, key, nearest_quoted(key, valid), "key", valid=valid)


def _choice(location: Location, schema: Mapping[str, Any], value: object, context: Mapping[str, Any]) -> Finding:
    choices = schema.get("enum", [schema.get("const")])
    finding = _not_a_choice(location, value, [str(choice) for choice in choices])
    # Only a text is written in quotes.
    return finding if isinstance(choices[0], str) else replace(finding, nearest=None)


def _tag(location: Location, schema: Mapping[str, Any], value: object, context: Mapping[str, Any]) -> Finding:
    key = str(context["discriminator"]).strip("'")
    tag = value.get(key) if isinstance(value, dict) else value
    return _not_a_choice((*location, key), tag, sorted(schema["discriminator"]["mapping"]))


def _no_tag(location: Location, schema: Mapping[str, Any], value: object, context: Mapping[str, Any]) -> Finding:
    key = str(context["discriminator"]).strip("'")
    return Finding((*location, key), "missing key", key, at="missing")


def _not_a_choice(location: Location, value: object, choices: Sequence[str]) -> Finding:
    nearest = nearest_quoted(value, choices) if isinstance(value, str) else None
    return Finding(location, f"not one of {', '.join(choices)}", value, nearest)


_TRANSLATIONS: Final[dict[str, Callable[[Location, Mapping[str, Any], object, Mapping[str, Any]], Finding]]] = {
    "missing": _missing,
    "literal_error": _choice,
    "union_tag_invalid": _tag,
    "union_tag_not_found": _no_tag,
}


class _Schema:
    """A JSON Schema that the paths of errors are followed through."""

    def __init__(self, root: Mapping[str, Any]) -> None:
        self._root = root

    def follow(self, path: Sequence[str | int]) -> tuple[Location, Mapping[str, Any], bool]:
        """The location in the data of a path through the models, its schema, and whether the key there is meant.

        Of a key that is meant, the schema is that of keys.
        """
        location: list[str | int] = []
        keys: Mapping[str, Any] = {}
        schema = self._resolve(self._root)
        for step in path:
            if step == "[key]":
                return tuple(location), self._resolve(keys), True
            if "discriminator" in schema and step in schema["discriminator"]["mapping"]:
                schema = self._resolve({"$ref": schema["discriminator"]["mapping"][step]})
                continue
            location.append(step)
            keys = schema.get("propertyNames", {})
            schema = self._child(schema, step)
        return tuple(location), schema, False

    def _child(self, schema: Mapping[str, Any], step: str | int) -> Mapping[str, Any]:
        if isinstance(step, int):
            several = schema.get("prefixItems", ())
            found = several[step] if step < len(several) else schema.get("items", {})
        else:
            named, patterns = schema.get("properties", {}), schema.get("patternProperties", {})
            found = named.get(step) or next(iter(patterns.values()), schema.get("additionalProperties"))
        return self._resolve(found if isinstance(found, dict) else {})

    def _resolve(self, schema: Mapping[str, Any]) -> Mapping[str, Any]:
        """The schema without references, and without `or null` and `or a list of them`."""
        while True:
            if "$ref" in schema:
                schema = self._root["$defs"][schema["$ref"].removeprefix("#/$defs/")]
            elif "anyOf" in schema:
                inner = [s for s in schema["anyOf"] if _has_parts(s)]
                schema = next(iter(inner or [s for s in schema["anyOf"] if s.get("type") != "null"]), {})
            else:
                return schema


@cache
def _of_settings(settings: type[BaseModel]) -> _Schema:
    return _Schema(settings.model_json_schema(by_alias=True))


@cache
def _deployment() -> _Schema:
    from foosim.deployment.json_schema import deployment_schema  # only files with problems need it

    return _Schema(deployment_schema())


def _has_parts(schema: Mapping[str, Any]) -> bool:
    return not schema.keys().isdisjoint({"$ref", "discriminator"}) or schema.get("type") in ("array", "object")
