"""What `foosim-supervisor components` shows: the forms that a deployment can name here."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from foosim.common.errors import BadValue, Refused, UnknownName
from foosim.runtime.command import DONE, FAILED
from foosim.world.forms import registry
from foosim.world.forms.forms import Component, Form
from foosim.world.forms.payloads import PayloadCodec
from foosim.world.forms.registry import FORMS

CARRIES: Final = {"sensor": "reading", "actuator": "command"}
"""What the values of a form are called."""


def chosen(form: str | None, name: str | None) -> list[Form]:
    """Return all of the forms, or those that were asked for. Raises UnknownName."""
    if form is not None and form not in FORMS:
        raise UnknownName("unknown form", form, FORMS)
    forms = FORMS if form is None else (form,)
    if name is None:
        return [registry.find(one, kind) for one in forms for kind in registry.names(one)]
    try:
        return [registry.find(one, name) for one in forms]
    except UnknownName:
        raise
    except Refused as error:
        raise BadValue(error.what, name) from None


def checked(text: str, file: Path, name: str, ticks: int, seed: int) -> int:
    """Check a form in a deployment that uses it, and print what was found; return the exit code."""
    from foosim.cli.rehearse import elsewhere
    from foosim.rehearsal.check.component_check import ComponentCheck, used_form

    form = used_form(text, str(file), name)
    label, folder = f"{form.form} {form.name}", file.parent
    check = ComponentCheck(text, str(file), ticks, seed, folder)
    if sys.stderr.isatty():
        check.on_step = _note
    is_broken = False
    try:
        for line in check.broken():
            is_broken = True
            print(f"{label}: {line}", flush=True)
        if not check.has_failed:
            check.begin("in another process")
            for line in elsewhere(text, str(file), ticks, folder):
                is_broken = True
                print(f"{label}: {line}", flush=True)
    except KeyboardInterrupt:
        _note(f"{label}: interrupted, {check.now}")
        raise
    if not is_broken:
        print(f"{label}: the same world on 1, 2 and 3 nodes, in any order and company, in {ticks} ticks")
    if not check.has_failed:
        print(f"{label}: {check.compared} of {check.sensors} sensors measured, and were compared alone and with others")
    return FAILED if is_broken else DONE


def _note(line: str) -> None:
    """Write a line beside the result, in one piece."""
    sys.stderr.write(f"{line}\n")
    sys.stderr.flush()


def as_json(component: Form) -> dict[str, Any]:
    """Return all that there is to know of one."""
    slots = getattr(component, "slots", {})
    about: dict[str, Any] = {
        "form": component.form,
        "name": component.name,
        "summary": component.summary,
        "class": f"{component.module}:{component.made.__qualname__}",
        "settings": [{"key": key, "value": value, "default": default} for key, value, default in _settings(component)],
        "slots": None if callable(slots) else dict(slots),
        "needs": list(getattr(component, "needs", ())),
        "kit": component.kit,
        "meshes": getattr(component, "meshes", False),
    }
    if isinstance(component, Component) and component.value is not None:
        fields = PayloadCodec(component.value, component.name).fields
        about[CARRIES[component.form]] = [
            {"field": field.name, "unit": field.unit, "several": field.is_several} for field in fields
        ]
    return about


def line(component: Form) -> str:
    """Return one in one line."""
    return f"{component.form:11} {component.name:16} {component.summary}"


def lines(component: Form) -> Iterator[str]:
    """Yield one in full."""
    about = as_json(component)
    yield f"{component.form} {component.name}, of {about['class']}"
    yield f"  {component.summary}"
    if about["settings"]:
        yield "  settings"
    for setting in about["settings"]:
        default = "required" if setting["default"] is None else f"default {setting['default']}"
        yield f"    {setting['key']}: {setting['value']} ({default})"
    if component.form in CARRIES:
        fields = about[CARRIES[component.form]]
        units = [f"{field['field']}{'[]' if field['several'] else ''} {field['unit']}".rstrip() for field in fields]
        yield f"  {CARRIES[component.form]}: {', '.join(units)}"
    if about["slots"]:
        counted = (field if size == 1 else f"{field}[{size}]" for field, size in about["slots"].items())
        yield f"  slots: {', '.join(counted)}"
    elif about["slots"] is None:
        yield "  slots: by its settings"
    if about["needs"]:
        yield f"  needs a model with: {', '.join(about['needs'])}"
    if about["meshes"]:
        yield "  has scenery of triangles (shape: mesh)"
    if component.kit:
        yield f"  needs a deployment with: {component.kit}"


def _settings(component: Form) -> Iterator[tuple[str, str, str | None]]:
    """Yield key, what is valid, and the default of each setting; None where it is required."""
    schema = component.settings.model_json_schema(by_alias=True)
    yield from _properties(schema, schema.get("$defs", {}), "")


def _properties(
    schema: Mapping[str, Any], definitions: Mapping[str, Any], path: str
) -> Iterator[tuple[str, str, str | None]]:
    """Yield the settings of a schema; of one that has settings of its own these, after its key and a point."""
    required = schema.get("required", ())
    for key, value in schema["properties"].items():
        found = _followed(value, definitions)
        each = _followed(found.get("additionalProperties", {}), definitions)
        if "properties" in found:
            yield from _properties(found, definitions, f"{path}{key}.")
        elif "properties" in each and "kind" not in each["properties"]:
            yield from _properties(each, definitions, f"{path}{key}.NAME.")
        elif key != "kind":
            default = None if key in required else str(value.get("default", ""))
            yield f"{path}{key}", _valid(found), default


def _followed(value: Any, definitions: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return what a schema refers to, and of one or nothing the one."""
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
    bounds = [f"{word} {value[key]}" for key, word in (("minimum", "at least"), ("maximum", "at most")) if key in value]
    return ", ".join([str(value.get("type", "any")), *bounds])
