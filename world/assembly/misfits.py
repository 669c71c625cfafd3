"""What forms do not find in the world that they are to be in: models, fields, motions, kits, what their settings name.

A problem is a text without a place: a deployment names the robot, rule or kit that has the form. A finding has one.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from typing import Any, Final, NamedTuple

from foosim.common.errors import ABSENT, CHOICES_MAX, BadValue, Refused, UnknownName, show
from foosim.common.finding import Finding, Location
from foosim.common.keyed_random import draw_key
from foosim.common.names import NAME_RULE, is_robot_name, nearest_name
from foosim.world.components.view import IncompatibleComponent, Mounting
from foosim.world.forms import registry
from foosim.world.forms.failures import failure_of
from foosim.world.forms.forms import (
    ROBOTS,
    Component,
    ComponentType,
    EntityRule,
    Kit,
    Model,
    WorldRule,
    overrides,
    with_article,
    word_of,
)
from foosim.world.forms.settings import ComponentSettings, RobotSettings
from foosim.world.layout import (
    Declaring,
    Layout,
    build_layout,
    declaring,
    find_rule,
    kits_named,
    of_motion,
    spares_of,
    trigger_slot,
    world_rules,
)
from foosim.world.rules.wind import WindSettings
from foosim.world.spec import WorldSpec

REACHED: Final = ("rod", "ball")
"""The rigid models that may share a solve (`assembly.islands.table_reach_of`)."""
SECTIONS: Final[Mapping[str, str]] = {"sensors": "sensor", "actuators": "actuator", "rules": "entity_rule"}
"""The sections of a robot that have components, and their form."""

# --- models and components -------------------------------------------------------------------------------------------


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


def needs_kit(form: ComponentType, kits: Collection[str], noun: str = "") -> Iterator[str]:
    """Yield that the world is without the kit that a form is of."""
    if form.kit and form.kit not in kits:
        yield f"{noun or word_of(form.type_name)} of {with_article(form.kit)} in a world without one"


def model_problems(model: Model, kits: Collection[str], having: Mapping[str, int] | None = None) -> Iterator[str]:
    """Yield why entities of a model would not be solved in a world with these kits.

    `having` are the fields of its state, where they follow from settings; without them nothing is missing.
    """
    if model.is_rigid and not model.couples and model.name not in REACHED:
        yield f"a rigid model with couples=False, which is valid of {', '.join(REACHED)} alone"


def component_problems(form: ComponentType, model: Model, having: Mapping[str, int] | None = None) -> Iterator[str]:
    """Yield what a robot of a model does not have that a component or rule of it needs; `having` as above."""
    has = model.declared if having is None else having
    word = word_of(form.type_name)
    needs: tuple[str, ...] = form.needs if isinstance(form, Component | EntityRule) else ()
    if isinstance(form, Component) and (field := _trigger_of_model(form)) and field not in needs:
        needs = (*needs, field)
    missing = [] if has is None else [field for field in needs if field not in has and field not in model.on_demand]
    if missing:
        fitting = ", ".join(_having(needs))
        valid = f"valid on: {fitting or 'none'}" + ("" if fitting else f"; {_fields_of(model, missing, has)}")
        yield (f"{word} that {with_article(model.name)} cannot carry, which has no {', '.join(missing)} ({valid})")
    if isinstance(form, Component) and form.jobs and not model.is_solved:
        yield f"{word} whose jobs would never end: {with_article(model.name)} is neither rigid nor has a motion"
    if not isinstance(form, EntityRule):
        return
    written = [] if has is None else [field for field in form.writes if field not in has]
    if written:
        yield f"{word} that writes {', '.join(written)}: {_fields_of(model, written, has)}"
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


def _trigger_of_model(sensor: Component) -> str:
    """Return the field of the model that is the trigger of a sensor; empty where that is a slot of its own, or of a
    rule or an actuator (`unheard`)."""
    trigger = sensor.trigger
    if callable(trigger) or callable(sensor.slots) or trigger in sensor.slots or "." in trigger:
        return ""
    return trigger


def _fields_of(model: Model, missing: Sequence[str], having: Mapping[str, int] | None) -> str:
    """Return which fields a model has, and the one that is nearest to the first of those that it has not."""
    fields = [*(having or ())]
    shown = ", ".join(fields[:CHOICES_MAX]) + (", ..." if len(fields) > CHOICES_MAX else "")
    nearest = nearest_name(missing[0], fields)
    near = "" if nearest is None else f", nearest to {missing[0]} is {nearest}"
    return f"{with_article(model.name)} has {shown or 'no fields'}{near}"


# --- rules of the world and kits -------------------------------------------------------------------------------------


def rule_problems(rule: WorldRule) -> Iterator[str]:
    """Yield the models that a rule of worlds names, and that there are not."""
    for word, models in (("remembers something of each", rule.each), ("writes", rule.writes)):
        for model in models:
            if (model != ROBOTS or word == "writes") and (":" in model or registry.lookup("model", model) is None):
                error = UnknownName("unknown model", model, registry.names("model"))
                yield f"{word_of('rule')} that {word} {model}: {error}"


def checked_spares(spec: WorldSpec, kit: Kit) -> tuple[Mapping[str, str], list[str]]:
    """Return what a kit brings that is absent at the start, models by name, or why it cannot say so."""
    try:
        found: object = spares_of(spec, kit)
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # SystemExit, too: a kit may do anything
        if kit.is_own:
            raise
        return {}, [f"spares fails: {failure_of(error, kit.module)}"]
    if not isinstance(found, Mapping) or not all(isinstance(text, str) for one in found.items() for text in one):
        return {}, [f"spares returns a mapping of names to models, not {show(found)}"]
    wrong = [name for name in found if not is_robot_name(name)]
    if wrong:
        return {}, [f"spares returns the entity {show(wrong[0])}: {NAME_RULE}"]
    return found, []


def kit_problems(
    name: str, entities: Mapping[str, Mapping[str, str]], kits: Collection[str], reserved: Sequence[str]
) -> Iterator[str]:
    """Yield what a kit puts into a world with these kits that cannot be there.

    `entities` are those of each kit, models by name, `reserved` names that no entity can have.
    """
    for entity, model in entities[name].items():
        if entity in reserved:
            yield f"its entity {entity} has a reserved name"
        for other in kits:
            if other < name and entity in entities[other]:
                yield f"its entity {entity} has a name that is also one of the kit {other}'s"
        for problem in _not_there(model, kits):
            yield f"its entity {entity} is {problem}"


def _not_there(name: str, kits: Collection[str]) -> Iterator[str]:
    """Yield why an entity without an owner cannot be of a model."""
    try:
        model = registry.find_model(name)
    except BadValue as error:
        yield f"of a model that is not there: {error}"
        return
    if model.is_robot:
        yield f"of the model {model.name}, which is one of robots: these have owners, and are in robots:"
    for problem in needs_kit(model, kits, model.name):
        yield f"of a model that cannot be there: {problem}"
    yield from model_problems(model, kits)


# --- a world with its files ------------------------------------------------------------------------------------------


def components_of(robot: RobotSettings) -> Iterator[tuple[str, str, ComponentSettings, ComponentType]]:
    """Yield the components and rules of a robot: section, name, settings and form of each."""
    for section, form in SECTIONS.items():
        for name, settings in getattr(robot, section).items():
            yield section, name, settings, registry.find(form, settings.kind)


def field_findings(spec: WorldSpec) -> Iterator[Finding]:
    """Yield settings of which no state follows, and components that need what it does not have.

    Robots whose state is that of their model are checked with the file; of these, the files must have been given.
    """
    for name, robot in spec.robots.items():
        model, place = registry.model_of(robot), ("robots", name)
        if model.declared is not None:
            continue
        try:
            having = model.fields_of(robot, spec)
        except BadValue as bad:
            value = robot.model if bad.value is ABSENT else bad.value
            yield Finding((*place, "model"), bad.problem, value, bad.nearest)
            continue
        for problem in model_problems(model, spec.kits, having):
            yield Finding((*place, "model"), problem, robot.model)
        for section, label, its, form in components_of(robot):
            for problem in component_problems(form, model, having):
                yield Finding((*place, section, label, "kind"), problem, its.kind)


def unfit_components(spec: WorldSpec) -> Iterator[Finding]:
    """Yield components whose settings their robots or the world do not fit: a joint that is not there, for one."""
    checked = [
        (name, *component)
        for name, robot in spec.robots.items()
        for component in components_of(robot)
        if overrides(component[-1].factory, "check")
    ]
    layout = build_layout(spec) if checked else None
    for name, section, channel, settings, form in checked:
        assert layout is not None
        key = draw_key(spec.seed, form.type_name, name, channel)
        at = Mounting(spec, layout, layout[name], channel, key, is_owners=section == "sensors")
        made: Any = form.factory
        try:
            made.check(settings, at)
        except IncompatibleComponent as error:
            place: Location = ("robots", name, section, channel, *error.path)
            yield Finding(place, error.problem, error.value, error.nearest)


def unheard(spec: WorldSpec) -> Iterator[Finding]:
    """Yield the sensors that speak by a slot that their robot does not have."""
    layout: Layout | None = None
    for name, robot in spec.robots.items():
        for channel, settings in robot.sensors.items():
            sensor = registry.find_component("sensor", settings.kind)
            trigger = sensor.trigger_by(settings)
            if not trigger or (callable(sensor.trigger) and overrides(sensor.factory, "check")):
                continue  # its own check names the setting
            layout = layout or build_layout(spec)
            if trigger_slot(layout[name], channel, trigger) not in layout[name].offsets:
                valid = "a slot of its own, a field of the model, or RULE.SLOT of a rule of the robot"
                what = f"sensor whose trigger is {trigger}, which {name} does not have: it is {valid}"
                yield Finding(("robots", name, "sensors", channel, "kind"), what, settings.kind)


def doubled_slots(spec: WorldSpec) -> Iterator[Finding]:
    """Yield what declares a slot of an entity that something else has declared: it would be in one place for both."""
    of_rules: list[tuple[str, Declaring]] = []
    for label, settings in world_rules(spec).items():
        kits = tuple(kit.name for kit in kits_named(spec) if label in kit.rules)
        place: Location = ("rules", label) if label in spec.rules else kits
        for model, slots in find_rule(settings).each.items():
            named = {f"{label}.{slot}": count for slot, count in slots.items()}
            of_rules.append((model, Declaring(f"rule {label} of the world", place, named)))
    seen: set[tuple[int, tuple[tuple[str, int], ...]]] = set()
    for name, robot in spec.robots.items():
        parts = (*robot.actuators.items(), *robot.rules.items(), *robot.sensors.items())
        alike = id(registry.model_of(robot)), tuple([(label, id(settings)) for label, settings in parts])
        if alike not in seen:  # many robots of a fleet are
            seen.add(alike)
            remembered = [one for model, one in of_rules if model in (registry.model_of(robot).name, ROBOTS)]
            yield from _doubled([*remembered, *declaring(spec, name, robot)], name)
    for kit in kits_named(spec):
        for name, model in kit.entities.items():
            kind = registry.find_model(model)
            motion = Declaring("motion", (kit.name,), of_motion(kind))
            yield from _doubled([motion, *(one for its, one in of_rules if its == kind.name)], name)


def _doubled(all_of_it: Iterable[Declaring], entity: str) -> Iterator[Finding]:
    first: dict[str, Declaring] = {}
    for one in all_of_it:
        for slot in one.slots:
            other = first.setdefault(slot, one)
            if other is not one:
                what = f"the {one.what} declares the slot {slot} of {entity}, which the {other.what} has already"
                yield Finding(one.location, what, slot.partition(".")[2], at="key")


def lasting_spares(spec: WorldSpec) -> Iterator[Finding]:
    """Yield the spares that cannot be absent: only what has a place of its own, and is solved, comes and goes."""
    named: dict[str, Location] = {name: ("objects", name, "spare") for name, one in spec.objects.items() if one.spare}
    named |= {name: ("robots", name, "spare") for name, one in spec.robots.items() if one.spare}
    named |= {name: (kit.name,) for kit in kits_named(spec) for name in spares_of(spec, kit)}
    layout = build_layout(spec) if named else None
    for name, location in named.items():
        assert layout is not None
        if not layout[name].can_leave:
            what = f"a spare that could not be absent: {with_article(layout[name].model)} without a place of its own"
            if len(location) > 1:
                yield Finding(location, what)
            else:
                yield Finding(location, f"kit {location[0]}: {name}, {what}", at="key")


# --- engines ---------------------------------------------------------------------------------------------------------


class _Rigid(NamedTuple):
    """Where something rigid is declared, and what it is."""

    location: tuple[str, ...]
    what: str


def engine_findings(spec: WorldSpec) -> Iterator[Finding]:
    """Rigid bodies that the engine does not have, those of which no engine has both, and wind that it does not have."""
    engine = registry.find_engine(spec.engine)
    winds = [name for name, settings in spec.rules.items() if isinstance(settings, WindSettings)]
    if winds and not engine.islands:
        what = f"the engine has no air, and the world has the rule {winds[0]}, which is wind"
        yield Finding(("engine",), what, engine.name, "'mujoco'")
    for name in winds[1:]:
        yield Finding(("rules", name), f"a second wind beside {winds[0]}", name, at="key")
    body, rod = next(rigid_bodies(spec), None), next(_rods(spec), None)
    if body is not None and rod is not None:
        for one, other in ((body, rod), (rod, body)):
            what = f"{one.what}, which no engine solves beside {'.'.join(other.location)}, {other.what}"
            yield Finding(one.location, what, one.location[-1], at="key")
    elif body is not None and not engine.islands:
        what = f"the engine solves rods and balls of a table; {'.'.join(body.location)} is {body.what}"
        yield Finding(("engine",), what, engine.name, "'mujoco'")
    elif rod is not None and engine.islands:
        what = f"the engine solves no rods and balls of a table; {'.'.join(rod.location)} is {rod.what}"
        yield Finding(("engine",), what, engine.name, "'bullet'")


def _rods(spec: WorldSpec) -> Iterator[_Rigid]:
    """Yield the robots, or else the objects of kits, that are rods and balls of a table."""
    for name, robot in spec.robots.items():
        if (model := registry.model_of(robot)).shares_solve:
            yield _Rigid(("robots", name), with_article(model.name))
    for key in spec.kits:
        kit = registry.find("kit", key)
        for model_name in kit.entities.values() if isinstance(kit, Kit) else ():
            if registry.find_model(model_name).shares_solve:
                yield _Rigid((key,), with_article(model_name))


def rigid_bodies(spec: WorldSpec) -> Iterator[_Rigid]:
    """Yield the robots and objects that need an engine with bodies of any kind."""
    for section, entities in (("robots", spec.robots), ("objects", spec.objects)):
        for name, settings in entities.items():
            model = registry.model_of(settings)
            if model.is_rigid and model.couples:
                yield _Rigid((section, name), with_article(model.name))
