"""What a form declares when it is registered: refused where it contradicts itself, with its name and module.

It is found here, when the module is imported, and not as a strange failure of a deployment or a run.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields
from typing import Any, Final

from msgspec import Struct

from foosim.common.errors import BadValue, Refused, show
from foosim.common.names import NAME_RULE, is_name, is_robot_name
from foosim.common.spec_base import SpecBase
from foosim.common.units import Quantity
from foosim.world.forms.forms import OF_ROBOTS, OF_SOLVED, SET_BY_FOOSIM, Model, slots_problem, with_article, word_of
from foosim.world.forms.jobs import JOB
from foosim.world.forms.payloads import PayloadCodec
from foosim.world.forms.settings import BASES
from foosim.world.forms.shown import MESSAGES

VALUES: Final[Mapping[str, str]] = {"sensor": "reading", "actuator": "command"}
"""What the values of a form are called."""
NAMES: Final = ("needs", "writes", "shared", "tags")
TEXTS: Final = ("kit", "motion", "several", "speaks", "joints")
MAPPINGS: Final = {
    "actuators": "names to settings",
    "rules": "names to settings",
    "each": "models to slots",
    "entities": "names to models",
    "per_field": "settings to least values",
    "settable": "fields to quantities",
    "variants": "values of dynamics to what differs",
}
"""What the fields of a description are."""


def check_form(found: Any) -> None:
    """Refuse a form whose description cannot be so. Raises Refused."""
    word, name = word_of(found.form), found.name
    if not (isinstance(name, str) and is_name(name)):
        raise Refused(f"{found.module} registers {with_article(word)} as {name!r}: {NAME_RULE}")
    problem = next(_problems(found), "")
    if problem:
        raise Refused(f"{word} {found.name} of {found.module}: {problem}")


def _problems(found: Any) -> Iterator[str]:
    """Yield what is wrong with the fields of a description. Each is read only where those before it are right."""
    base = BASES.get(found.form, SpecBase)
    if not (isinstance(found.settings, type) and issubclass(found.settings, base)):
        yield f"its settings are a class derived from {base.__name__}, not {_shown(found.settings)}"
    for field in fields(found):
        key, value = field.name, getattr(found, field.name)
        if key in NAMES and not (isinstance(value, tuple) and all(isinstance(name, str) for name in value)):
            hint = f": a tuple of one is ({show(value)},)" if isinstance(value, str) else ""
            yield f"{key} is a tuple of names, not {_shown(value)}{hint}"
        if key in TEXTS and not (isinstance(value, str) or (key in ("several", "speaks") and callable(value))):
            yield f"{key} is a name, not {show(value)}"
        if key in MAPPINGS and not isinstance(value, Mapping):
            yield f"{key} is a mapping of {MAPPINGS[key]}, not {_shown(value)}"
        if key in OF_FIELD:
            yield from OF_FIELD[key](found, key)


def _value(found: Any, key: str) -> Iterator[str]:
    word, value = VALUES.get(found.form), found.value
    if word is not None and not (isinstance(value, type) and issubclass(value, Struct)):
        yield f"its {word} is a class derived from msgspec.Struct, not {_shown(value)}"
    elif word is not None and not value.__struct_fields__:
        yield f"its {word} {value.__name__} has no fields"


def _slots(found: Any, key: str) -> Iterator[str]:
    slots = getattr(found, key)
    if callable(slots) and found.form in ("model", "sensor", "actuator", "modifier"):
        return
    problem = slots_problem(slots, is_sensor=found.form == "sensor")
    if problem:
        yield f"{key}: {problem}"
    for slot in (*OF_ROBOTS, *OF_SOLVED) if isinstance(found, Model) else ():
        if slots.get(slot, 1) != 1:
            yield f"{slot}, which foosim writes, is one number, not {show(slots[slot])}"


def _setting(found: Any, key: str) -> Iterator[str]:
    name = getattr(found, key)
    if isinstance(name, str) and name and name not in found.settings.model_fields:
        yield f"{key} names no setting, {show(name)}"


def _jobs(found: Any, key: str) -> Iterator[str]:
    """Yield what is wrong with the commands of an actuator that are jobs, and with its own slots."""
    if not found.jobs:
        return
    codec = PayloadCodec(found.value, found.name)
    fields, value = codec.fields, found.value.__name__
    if not (fields[-1].name == JOB and fields[-1].is_number and found.value.__struct_defaults__[-1:] == (0.0,)):
        yield f"its command {value} may be a job, and its last field is not `{JOB}: JobNumber = 0.0`"
    elif not _is_encodable(codec, codec.nothing()):
        yield f"its command {value} may be a job, and has fields that are neither numbers nor tuples which may be empty"
    if not hasattr(found.made, "progress"):
        yield f"its commands may be jobs, and {found.made.__name__} has no method progress"


def _is_encodable(codec: PayloadCodec, value: Any) -> bool:
    try:
        codec.encode_checked(value)
    except BadValue:
        return False
    return True


def _shown_as(found: Any, key: str) -> Iterator[str]:
    """Yield what is wrong with the message that a sensor names, if it names one."""
    if found.shown_as == "":
        return
    if found.shown_as not in tuple(MESSAGES):  # whatever it is
        yield f"shown_as is one of {', '.join(MESSAGES)}, not {show(found.shown_as)}"
        return
    needed = MESSAGES[found.shown_as]
    having = PayloadCodec(found.value, found.name).fields
    there = {field.name for field in having if (field.is_several if needed.is_several else field.is_number)}
    if not any(there.issuperset(choice) for choice in needed.choices):
        what = "tuples of numbers" if needed.is_several else "numbers"
        choices = " or ".join(", ".join(choice) for choice in needed.choices)
        yield f"its reading {found.value.__name__} lacks the {what} that {found.shown_as} shows: {choices}"
    for name in needed.settings:
        if name not in found.settings.model_fields and not hasattr(found.settings, name):
            yield f"its settings {found.settings.__name__} lack {name}, which {found.shown_as} shows"


def _per_field(found: Any, key: str) -> Iterator[str]:
    keys = [field.alias or name for name, field in found.settings.model_fields.items()]
    for name, least in found.per_field.items():
        if name not in keys:
            yield f"per_field names no setting, {show(name)} (there are: {', '.join(keys)})"
        elif least is not None and (isinstance(least, bool) or not isinstance(least, int | float)):
            yield f"the least value of the setting {name} is a number or None, not {show(least)}"


def _settable(found: Any, key: str) -> Iterator[str]:
    for name, quantity in found.settable.items():
        if not (isinstance(name, str) and is_name(name)):
            yield f"settable: {show(name)}: {NAME_RULE}"
        elif not isinstance(quantity, Quantity):
            yield f"settable: {name} is set to a Quantity, which has limits, not to {_shown(quantity)}"
        elif isinstance(found, Model) and name in SET_BY_FOOSIM:
            yield f"settable: {name} is set by foosim itself"
        elif not hasattr(found.made, "set") and not callable(found.slots) and found.slots.get(name) != 1:
            yield f"settable: {name} is no slot of one number, and the class has no method set"


def _variants(found: Any, key: str) -> Iterator[str]:
    variants = found.variants
    if not all(isinstance(one, Model) for one in variants.values()):
        yield f"{key} is a mapping of {MAPPINGS[key]}, not {_shown(variants)}"
    if variants and "dynamics" not in found.settings.model_fields:
        yield "it has variants, and its settings have no dynamics, which chooses one"
    for value, variant in variants.items():
        if variant.module != found.module:
            yield f"its variant {show(value)} is of another module, {variant.module}"
        yield from (f"its variant {show(value)}: {problem}" for problem in _problems(variant))


def _each(found: Any, key: str) -> Iterator[str]:
    for model, slots in found.each.items():
        if not isinstance(model, str):
            yield f"each is a mapping of models to slots, and a model is a name, not {show(model)}"
        problem = slots_problem(slots)
        if problem:
            yield f"each {model}: {problem}"


def _entities(found: Any, key: str) -> Iterator[str]:
    for name, model in found.entities.items():
        if not (isinstance(name, str) and is_robot_name(name)):
            yield f"the entity {show(name)}: {NAME_RULE}"
        if not isinstance(model, str):
            yield f"the model of the entity {name} is a name, not {show(model)}"


def _spares(found: Any, key: str) -> Iterator[str]:
    if found.spares is not None and not callable(found.spares):
        yield f"spares is a function of the section, not {_shown(found.spares)}"


def _kinds(found: Any, key: str) -> Iterator[str]:
    """Yield what is wrong with settings by name, each with its kind."""
    for name, its in getattr(found, key).items():
        if not (isinstance(name, str) and is_name(name)):
            yield f"{key}, {show(name)}: {NAME_RULE}"
        elif not (isinstance(its, Mapping) and isinstance(its.get("kind"), str)):
            yield f"{key}, {name}: settings are a mapping with a kind, not {_shown(its)}"


def _shown(value: object) -> str:
    return value.__name__ if isinstance(value, type) else show(value)


OF_FIELD: Final[Mapping[str, Callable[[Any, str], Iterator[str]]]] = {
    "value": _value,
    "slots": _slots,
    "on_demand": _slots,
    "several": _setting,
    "joints": _setting,
    "jobs": _jobs,
    "shown_as": _shown_as,
    "per_field": _per_field,
    "settable": _settable,
    "variants": _variants,
    "each": _each,
    "entities": _entities,
    "spares": _spares,
    "actuators": _kinds,
    "rules": _kinds,
}
"""Further checks of a field that has the right type."""
