"""Checks of a component's description when it registers itself; errors have its name and module."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Final

import msgspec

from foosim.common.errors import BadValue, Refused, show
from foosim.common.names import NAME_RULE, is_name, nearest_name
from foosim.common.spec_base import SpecBase
from foosim.common.units import Quantity
from foosim.world.component_types import descriptions
from foosim.world.component_types.descriptions import (
    OF_ROBOTS,
    OF_SOLVED,
    SET_BY_FOOSIM,
    overrides,
    slots_problem,
    with_article,
    word_of,
)
from foosim.world.component_types.jobs import JOB
from foosim.world.component_types.payloads import PayloadCodec
from foosim.world.component_types.settings import BASES
from foosim.world.component_types.shown import MESSAGES

VALUES: Final[Mapping[str, str]] = {"sensor": "reading", "actuator": "command"}
"""The noun of a component's values."""
TYPES: Final[Mapping[str, Any]] = {
    **dict.fromkeys(("kit", "joints", "drawn_by"), str),
    **dict.fromkeys(("needs", "writes", "shared", "tags"), tuple[str, ...]),
    **dict.fromkeys(("actuators", "rules"), dict[str, dict[str, Any]]),
    "each": dict[str, dict[str, int]],
    "entities": dict[str, str],
    "per_field": dict[str, float | None],
}
"""The types of a description's fields."""
REQUIRED: Final = {"sensor": "sample", "actuator": "command", "modifier": "apply"}
"""The hook without which a component has no effect, by type name."""


def check_component_type(found: Any) -> None:
    """Refuse a component with an invalid description. Raises Refused."""
    word, name = word_of(found.type_name), found.name
    if not (isinstance(name, str) and is_name(name)):
        raise Refused(f"{found.module} registers {with_article(word)} as {name!r}: {NAME_RULE}")
    problem = next(_problems(found), "")
    if problem:
        raise Refused(f"{word} {name} of {found.module}: {problem}")


def _problems(found: Any) -> Iterator[str]:
    """Yield problems of a description. Each field is read only where the fields before it are valid."""
    base, settings, bases = BASES.get(found.type_name, SpecBase), found.settings, getattr(found.factory, "__mro__", ())
    if bases and not any(vars(one).get("type_name") == found.type_name for one in bases):
        wanted = found.type_name.title().replace("_", "")
        yield f"the class {found.factory.__name__} is not derived from {wanted} of foosim.components"
    hook = REQUIRED.get(found.type_name, "")
    if bases and hook and not overrides(found.factory, hook):
        nearest = nearest_name(hook, vars(found.factory))
        yield f"the class {found.factory.__name__} has no method {hook}" + (
            f", nearest is {nearest}" if nearest else ""
        )
    if not (isinstance(settings, type) and issubclass(settings, base)):
        yield f"its settings are a class derived from {base.__name__}, not {_shown(settings)}"
    for key, kind in TYPES.items():
        try:
            msgspec.convert(getattr(found, key, None) or kind(), kind)
        except msgspec.ValidationError as error:
            yield f"{key}: {error}"
    yield from _values(found)
    for key in ("slots", "on_demand"):
        yield from _slots(found, key, getattr(found, key, {}))
    for model, slots in getattr(found, "each", {}).items():
        yield from _slots(found, f"each {model}", slots)
    yield from _settings_named(found)
    yield from _settable(found)
    for value, variant in getattr(found, "variants", {}).items():
        if "dynamics" not in settings.model_fields:
            yield "it has variants, and its settings have no dynamics, which chooses one"
        yield from (f"its variant {value}: {problem}" for problem in _problems(variant))


def _settings_named(found: Any) -> Iterator[str]:
    """Yield unknown names of settings."""
    fields = found.settings.model_fields
    for key in ("array_length", "joints"):
        name = getattr(found, key, "")
        if isinstance(name, str) and name and name not in fields:
            yield f"{key} names no setting, {show(name)}"
    keys = [field.alias or name for name, field in fields.items()]
    for name in getattr(found, "per_field", ()):
        if name not in keys:
            yield f"per_field names no setting, {show(name)} (there are: {', '.join(keys)})"


def _values(found: Any) -> Iterator[str]:
    """Yield problems of the type of readings or commands."""
    word = VALUES.get(found.type_name)
    if word is None:
        return
    if not (isinstance(found.value, type) and issubclass(found.value, msgspec.Struct)):
        yield f"its {word} is a class derived from msgspec.Struct, not {_shown(found.value)}"
        return
    value = found.value.__name__
    if not found.value.__struct_fields__:
        yield f"its {word} {value} has no fields"
        return
    codec = PayloadCodec(found.value, found.name)
    if found.jobs:
        last = codec.fields[-1]
        if not (last.name == JOB and last.is_number and found.value.__struct_defaults__[-1:] == (0.0,)):
            yield f"its command {value} may be a job, and its last field is not `{JOB}: JobNumber = 0.0`"
        try:
            codec.encode_checked(codec.nothing())
        except BadValue:
            yield f"its command {value} may be a job: its fields must be numbers, or tuples which may be empty"
        if not overrides(found.factory, "progress"):
            yield f"its commands may be jobs, and {found.factory.__name__} has no method progress"
    if found.shown_as:
        yield from _shown_as(found, codec)


def _slots(found: Any, key: str, slots: Any) -> Iterator[str]:
    if callable(slots) and found.type_name == "model":
        return
    if key == "slots" and isinstance(found, descriptions.Component):
        slots = {name: 1 if callable(size) else size for name, size in slots.items()}
    problem = slots_problem(slots, is_sensor=found.type_name == "sensor")
    if problem:
        yield f"{key}: {problem}"
    for slot in (*OF_ROBOTS, *OF_SOLVED) if isinstance(found, descriptions.Model) else ():
        if slots.get(slot, 1) != 1:
            yield f"{slot}, which foosim writes, is one number, not {show(slots[slot])}"


def _shown_as(found: Any, codec: PayloadCodec) -> Iterator[str]:
    """Yield problems of the message that a sensor names."""
    needed = MESSAGES.get(str(found.shown_as))
    if needed is None:
        yield f"shown_as is one of {', '.join(MESSAGES)}, not {show(found.shown_as)}"
        return
    there = {field.name for field in codec.fields if (field.is_several if needed.is_several else field.is_number)}
    if not any(there.issuperset(choice) for choice in needed.choices):
        what = "tuples of numbers" if needed.is_several else "numbers"
        choices = " or ".join(", ".join(choice) for choice in needed.choices)
        yield f"its reading {found.value.__name__} lacks the {what} that {found.shown_as} shows: {choices}"
    for name in needed.settings:
        if name not in found.settings.model_fields and not hasattr(found.settings, name):
            yield f"its settings {found.settings.__name__} lack {name}, which {found.shown_as} shows"


def _settable(found: Any) -> Iterator[str]:
    for name, quantity in getattr(found, "settable", {}).items():
        if not isinstance(quantity, Quantity):
            yield f"settable: {name} is set to a Quantity, which has limits, not to {_shown(quantity)}"
        elif isinstance(found, descriptions.Model) and name in SET_BY_FOOSIM:
            yield f"settable: {name} is set by foosim itself"
        elif not overrides(found.factory, "set") and not callable(found.slots) and found.slots.get(name) != 1:
            yield f"settable: {name} is no slot of one number, and the class has no method set"


def _shown(value: object) -> str:
    return value.__name__ if isinstance(value, type) else show(value)
