"""What forms do not find in the world that they are to be in: models, fields, motions, kits.

A problem is a text without a place: a deployment names the robot, rule or kit that has the form.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Final

from foosim.common.errors import CHOICES_MAX, Refused, UnknownName
from foosim.common.names import nearest_name
from foosim.world.forms import registry
from foosim.world.forms.forms import (
    ROBOTS,
    Component,
    EntityRule,
    Form,
    Kit,
    Model,
    Motion,
    WorldRule,
    with_article,
    word_of,
)

REACHED: Final = ("rod", "ball")
"""The rigid models that may share a solve (`assembly.islands.table_reach_of`)."""
PLACED_BY: Final = ("check_place", "place_at")
"""The methods of a model of which a running world can have more."""


def find_kit_model(name: str) -> Model | None:
    """Return a model that a kit names, None where there is none."""
    try:
        found = registry.lookup("model", name)
    except Refused:
        return None
    assert found is None or isinstance(found, Model), found
    return found


def models_of(*, robots: bool) -> list[Model]:
    """Return the models of robots, or of objects, that are installed here, in name order."""
    found = map(registry.find_model, registry.names("model"))
    return [model for model in found if model.is_robot == robots]


def needs_kit(form: Form, kits: Collection[str], noun: str = "") -> Iterator[str]:
    """Yield that the world is without the kit that a form is of."""
    if form.kit and form.kit not in kits:
        yield f"{noun or word_of(form.form)} of {with_article(form.kit)} in a world without one"


def model_problems(model: Model, kits: Collection[str]) -> Iterator[str]:
    """Yield why entities of a model would not be solved in a world with these kits."""
    if model.is_rigid and not model.couples and model.name not in REACHED:
        yield f"a rigid model with couples=False, which is valid of {', '.join(REACHED)} alone"
    if not model.motion:
        return
    try:
        motion = registry.find("motion", model.motion)
    except Refused as error:
        text = error.what if isinstance(error, UnknownName) else f"{error.what}, {model.motion!r}"
        yield f"a model without its motion: {text}"
        return
    assert isinstance(motion, Motion), motion
    for verb, fields in (("needs", motion.needs), ("writes", motion.writes)):
        missing = [] if model.declared is None else [field for field in fields if field not in model.declared]
        if missing:
            yield f"a model whose motion {motion.name} {verb} {', '.join(missing)}: {fields_of(model, missing)}"
    for problem in needs_kit(motion, kits, motion.name):
        yield f"a model whose motion is {problem}"


def component_problems(form: Form, model: Model, having: Mapping[str, int] | None = None) -> Iterator[str]:
    """Yield what a robot of a model does not have that a component or rule of it needs.

    `having` are the fields of its state, where they follow from settings; without them nothing is missing.
    """
    has = model.declared if having is None else having
    word = word_of(form.form)
    needs: tuple[str, ...] = form.needs if isinstance(form, Component | EntityRule) else ()
    if isinstance(form, Component) and _speaks_by_model(form) and form.speaks not in needs:
        needs = (*needs, form.speaks)
    missing = [] if has is None else [field for field in needs if field not in has and field not in model.on_demand]
    if missing:
        fitting = ", ".join(_having(needs))
        valid = f"valid on: {fitting or 'none'}" + ("" if fitting else f"; {fields_of(model, missing, has)}")
        yield (f"{word} that {with_article(model.name)} cannot carry, which has no {', '.join(missing)} ({valid})")
    if not isinstance(form, EntityRule):
        return
    written = [] if has is None else [field for field in form.writes if field not in has]
    if written:
        yield f"{word} that writes {', '.join(written)}: {fields_of(model, written, has)}"
    if not model.is_solved:
        yield f"{word} that would never apply: {with_article(model.name)} is neither rigid nor has a motion"


def _having(fields: Collection[str]) -> Iterator[str]:
    """Yield the names of the models of robots whose state has these fields, and of their variants that alone do."""
    for model in models_of(robots=True):
        if {*fields} <= {*(model.declared or ()), *model.on_demand}:
            yield model.name
            continue
        for dynamics, variant in model.variants.items():
            if {*fields} <= {*(variant.declared or ())}:
                yield f"{model.name} with dynamics: {dynamics}"


def _speaks_by_model(sensor: Component) -> bool:
    """Whether a sensor speaks by a field of the model, and not by a slot of its own or of a rule (`layout.unheard`)."""
    is_own = callable(sensor.slots) or sensor.speaks in sensor.slots
    return bool(sensor.speaks) and not is_own and "." not in sensor.speaks


def rule_problems(rule: WorldRule) -> Iterator[str]:
    """Yield the models that a rule of worlds names, and that there are not."""
    for word, models in (("remembers something of each", rule.each), ("writes", rule.writes)):
        for model in models:
            if model != ROBOTS or word == "writes":
                found = None if ":" in model else registry.lookup("model", model)
                if found is None:
                    error = UnknownName("unknown model", model, registry.names("model"))
                    yield f"{word_of('rule')} that {word} {model}: {error.what}"


def kit_problems(name: str, kit: Kit, kits: Mapping[str, Kit], reserved: Sequence[str]) -> Iterator[str]:
    """Yield what a kit puts into a world with these kits that cannot be there.

    `reserved` are names that no entity can have.
    """
    for entity, model in kit.entities.items():
        if entity in reserved:
            yield f"its entity {entity} has a reserved name"
        for other in kits:
            if other < name and entity in kits[other].entities:
                yield f"its entity {entity} has a name that is also one of the kit {other}'s"
        for problem in _not_there(model, kits):
            yield f"its entity {entity} is {problem}"
    for model in kit.addable:
        for problem in (*_not_there(model, kits), *_not_placed(model)):
            yield f"what can be added is {problem}"


def _not_there(name: str, kits: Collection[str]) -> Iterator[str]:
    """Yield why an entity without an owner cannot be of a model."""
    try:
        model = registry.find_model(name)
    except Refused as error:
        text = error.what if isinstance(error, UnknownName) else f"{error.what}, {name!r}"
        yield f"of a model that is not there: {text}"
        return
    if model.is_robot:
        yield f"of the model {model.name}, which is one of robots: these have owners, and are in robots:"
    for problem in needs_kit(model, kits, model.name):
        yield f"of a model that cannot be there: {problem}"
    yield from model_problems(model, kits)


def _not_placed(name: str) -> Iterator[str]:
    """Yield why a running world cannot have one more of a model."""
    model = find_kit_model(name)
    if model is not None and not model.is_robot:
        missing = [f"method {method}" for method in PLACED_BY if not hasattr(model.made, method)]
        missing += ["field position"] if "position" not in (model.declared or ()) else []
        if missing:
            yield f"of the model {model.name}, which has no {' and no '.join(missing)}"


def fields_of(model: Model, missing: Sequence[str], having: Mapping[str, int] | None = None) -> str:
    """Return which fields a model has, and the one that is nearest to the first of those that it has not."""
    fields = [*(having or model.declared or ())]
    shown = ", ".join(fields[:CHOICES_MAX]) + (", ..." if len(fields) > CHOICES_MAX else "")
    nearest = nearest_name(missing[0], fields)
    near = "" if nearest is None else f", nearest to {missing[0]} is {nearest}"
    return f"{with_article(model.name)} has {shown or 'no fields'}{near}"
