"""What a form says of itself when it is registered: refused where it contradicts itself, with its name and module.

It is found here, when the module is imported, and not as a strange failure of a deployment or a run.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Final

from msgspec import Struct

from foosim.common.errors import Refused, show
from foosim.common.names import NAME_RULE, is_name, is_robot_name
from foosim.common.spec_base import SpecBase
from foosim.world.forms.forms import (
    OF_ROBOTS,
    OF_SOLVED,
    Component,
    EntityRule,
    Form,
    Kit,
    Model,
    Motion,
    WorldRule,
    slots_problem,
    with_article,
    word_of,
)
from foosim.world.forms.settings import BASES
from foosim.world.forms.shown import shown_problems

VALUES: Final[Mapping[str, str]] = {"sensor": "reading", "actuator": "command"}
"""What the values of a form are called."""


def check_form(found: Form) -> None:
    """Refuse what a form says of itself where it cannot be so. Raises Refused."""
    word, name = word_of(found.form), _anything(found.name)
    if not (isinstance(name, str) and is_name(name)):
        raise Refused(f"{found.module} registers {with_article(word)} as {name!r}: {NAME_RULE}")
    problem = next(_problems(found), "")
    if problem:
        raise Refused(f"{word} {found.name} of {found.module}: {problem}")


def _problems(found: Form) -> Iterator[str]:
    yield from _settings(found)
    kit = _anything(found.kit)
    if not isinstance(kit, str):
        yield f"kit is the name of a kit, not {show(kit)}"
    match found:
        case Component():
            yield from _component(found)
        case Model():
            yield from _model(found)
        case Motion() | EntityRule():
            yield from _slots(found.slots)
            yield from _names("needs", found.needs)
            yield from _names("writes", found.writes)
            if isinstance(found, EntityRule):
                yield from _names("shared", found.shared)
        case WorldRule():
            yield from _world_rule(found)
        case Kit():
            yield from _kit(found)


def _anything(value: Any) -> Any:
    """Return a value of which nobody has made sure that it is what it should be."""
    return value


def _settings(found: Any) -> Iterator[str]:
    base = BASES.get(found.form, SpecBase)
    settings = found.settings
    if not (isinstance(settings, type) and issubclass(settings, base)):
        yield f"its settings are a class derived from {base.__name__}, not {_shown(settings)}"


def _component(found: Any) -> Iterator[str]:
    word = VALUES.get(found.form)
    value = found.value
    if word is not None and not (isinstance(value, type) and issubclass(value, Struct)):
        yield f"its {word} is a class derived from msgspec.Struct, not {_shown(value)}"
    elif word is not None and not value.__struct_fields__:
        yield f"its {word} {value.__name__} has no fields"
    if not callable(found.slots):
        yield from _slots(found.slots, is_sensor=found.form == "sensor")
    yield from _names("needs", found.needs)
    for key in ("several", "speaks", "joints"):
        if not isinstance(getattr(found, key), str) and not (key == "several" and callable(found.several)):
            yield f"{key} is a name, not {show(getattr(found, key))}"
    yield from shown_problems(found)
    for key in ("several", "joints"):
        name = getattr(found, key)
        if isinstance(name, str) and name and name not in found.settings.model_fields:
            yield f"{key} names no setting, {show(name)}"
    if not isinstance(found.per_field, Mapping):
        yield f"per_field is a mapping of settings to least values, not {show(found.per_field)}"
        return
    keys = [field.alias or name for name, field in found.settings.model_fields.items()]
    for key, least in found.per_field.items():
        if key not in keys:
            yield f"per_field names no setting, {show(key)} (there are: {', '.join(keys)})"
        elif least is not None and (isinstance(least, bool) or not isinstance(least, int | float)):
            yield f"the least value of the setting {key} is a number or None, not {show(least)}"


def _model(found: Any) -> Iterator[str]:
    if not callable(found.slots):
        yield from _slots(found.slots)
    yield from _slots(found.on_demand, "on_demand")
    for slot in () if callable(found.slots) else (*OF_ROBOTS, *OF_SOLVED):
        if found.slots.get(slot, 1) != 1:
            yield f"{slot}, which foosim writes, is one number, not {show(found.slots[slot])}"
    if not isinstance(found.motion, str):
        yield f"motion is the name of a motion, not {show(found.motion)}"
    yield from _kinds("actuators", found.actuators)
    yield from _kinds("rules", found.rules)
    yield from _names("tags", found.tags)
    yield from _variants(found)


def _variants(found: Any) -> Iterator[str]:
    variants = found.variants
    if not isinstance(variants, Mapping) or not all(isinstance(one, Model) for one in variants.values()):
        yield f"variants are a mapping of values of dynamics to what differs, not {_shown(variants)}"
        return
    if variants and "dynamics" not in found.settings.model_fields:
        yield "it has variants, and its settings have no dynamics, which chooses one"
    for value, variant in variants.items():
        if variant.module != found.module:
            yield f"its variant {show(value)} is of another module, {variant.module}"
        yield from (f"its variant {show(value)}: {problem}" for problem in _model(variant))


def _world_rule(found: Any) -> Iterator[str]:
    yield from _slots(found.slots)
    yield from _names("writes", found.writes)
    if not isinstance(found.each, Mapping):
        yield f"each is a mapping of models to slots, not {show(found.each)}"
        return
    for model, slots in found.each.items():
        if not isinstance(model, str):
            yield f"each is a mapping of models to slots, and a model is a name, not {show(model)}"
        yield from _slots(slots, f"each {model}")


def _kit(found: Any) -> Iterator[str]:
    if not isinstance(found.entities, Mapping):
        yield f"entities are a mapping of names to models, not {show(found.entities)}"
        return
    for name, model in found.entities.items():
        if not (isinstance(name, str) and is_robot_name(name)):
            yield f"the entity {show(name)}: {NAME_RULE}"
        if not isinstance(model, str):
            yield f"the model of the entity {name} is a name, not {show(model)}"
    yield from _names("addable", found.addable)
    yield from _kinds("rules", found.rules)


def _slots(slots: object, what: str = "slots", *, is_sensor: bool = False) -> Iterator[str]:
    problem = slots_problem(slots, is_sensor=is_sensor)
    if problem:
        yield f"{what}: {problem}"


def _names(key: str, names: object) -> Iterator[str]:
    if not (isinstance(names, tuple) and all(isinstance(name, str) for name in names)):
        shown = show(names) if isinstance(names, str) else _shown(names)
        hint = f": a tuple of one is ({show(names)},)" if isinstance(names, str) else ""
        yield f"{key} is a tuple of names, not {shown}{hint}"


def _kinds(key: str, settings: object) -> Iterator[str]:
    """Yield what is wrong with settings by name, each with its kind."""
    if not isinstance(settings, Mapping):
        yield f"{key} is a mapping of names to settings, not {_shown(settings)}"
        return
    for name, its in settings.items():
        if not (isinstance(name, str) and is_name(name)):
            yield f"{key}, {show(name)}: {NAME_RULE}"
        elif not (isinstance(its, Mapping) and isinstance(its.get("kind"), str)):
            yield f"{key}, {name}: settings are a mapping with a kind, not {_shown(its)}"


def _shown(value: object) -> str:
    return value.__name__ if isinstance(value, type) else show(value)
