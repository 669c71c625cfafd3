"""The registry of component types: models, sensors, rules and all other parts of a world, by type and name.

Each is in a file of its own and registers itself there, under its name in deployments. foosim's own are in modules of
their names in `library/`; those of another package are in a module that the package names as an entry point of the
group `foosim.world`; and `module:Class` names one of any module on the path.
A module is imported when one of its component types is looked up.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cache
from importlib import import_module
from itertools import chain
from pkgutil import iter_modules
from typing import TYPE_CHECKING, Any, Final, Protocol, TypeVar

from foosim.common.errors import BadValue, Refused, UnknownName
from foosim.common.names import CLASS_PATTERN, class_path_of, nearest_name, quoted
from foosim.world.component_types.descriptions import (
    ENGINES,
    Component,
    ComponentType,
    Engine,
    EntityRule,
    Kit,
    Model,
    Scene,
    WorldRule,
    with_article,
    word_of,
)
from foosim.world.component_types.failures import failure_of, in_library
from foosim.world.component_types.registration import check_component_type
from foosim.world.component_types.settings import ComponentSettings

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

    from msgspec import Struct

    from foosim.common.spec_base import SpecBase
    from foosim.world.component_types.settings import EntitySettings

GROUP: Final = "foosim.world"
LIBRARY: Final = "foosim.library"
"""Where foosim's own are: each in a module of its name, in a folder for the kind of world."""
GATEWAYS: Final = "foosim.gateways"
"""Where foosim's own gateways are: each is a module or a package of its name."""
TYPE_NAMES: Final = ("model", "sensor", "actuator", "modifier", "rule", "entity_rule", "scene", "kit", "gateway")
BY_CLASS: Final = "module:Class"
"""The notation of a component type by its class, beside its name."""

Made = TypeVar("Made", bound=Callable[..., Any])


class Decorator(Protocol):
    """A decorator that registers a class, and returns it."""

    def __call__(self, made: Made, /) -> Made: ...


_known: Final[dict[tuple[str, str], ComponentType]] = {}
_loaded: Final[dict[str, str]] = {}
"""The error of each entry point that was loaded, empty without one."""


def sensor(name: str, settings: type[ComponentSettings], reading: type[Struct], **about: Any) -> Decorator:
    """Register a sensor: a class derived from `Sensor`; `about` are fields of `descriptions.Component`."""
    return _registering(Component, "sensor", name, settings, value=reading, **about)


def actuator(name: str, settings: type[ComponentSettings], command: type[Struct], **about: Any) -> Decorator:
    """Register an actuator: a class derived from `Actuator`; `about` are fields of `descriptions.Component`.

    It commands motors of its robot unless `moves` is False.
    """
    return _registering(Component, "actuator", name, settings, value=command, **{"moves": True, **about})


def modifier(name: str, settings: type[ComponentSettings], **about: Any) -> Decorator:
    """Register a modifier: a class derived from `Modifier`; `about` are fields of `descriptions.Component`."""
    return _registering(Component, "modifier", name, settings, **about)


def model(name: str, settings: type[EntitySettings], **about: Any) -> Decorator:
    """Register a model: a class derived from `Model`; `about` are fields of `descriptions.Model`.

    Fields that foosim itself needs come after the declared ones. `variants` are
    classes of the same module by the value of the setting `dynamics`, each with the fields that differ:
    `{"rigid": {"factory": Rigid, "is_rigid": True, ...}}`.
    """
    return _registering(Model, "model", name, settings, **about)


def rule(name: str, settings: type[ComponentSettings], **about: Any) -> Decorator:
    """Register a rule: a class derived from `Rule`, or from `EntityRule`; `about` are fields of
    `descriptions.WorldRule` or `descriptions.EntityRule`."""

    def register(made: Made) -> Made:
        is_of_entity = getattr(made, "type_name", "") == "entity_rule"
        kind, type_name = (EntityRule, "entity_rule") if is_of_entity else (WorldRule, "rule")
        return _registering(kind, type_name, name, settings, **about)(made)

    return register


def scene(name: str, settings: type[ComponentSettings], *, kit: str = "") -> Decorator:
    """Register the scene of a kit, or one by itself: a function of its settings that returns its shapes."""
    return _registering(Scene, "scene", name, settings, kit=kit)


def kit(name: str, settings: type[SpecBase], **about: Any) -> Decorator:
    """Register a kit: a class derived from `Kit`; `about` are fields of `descriptions.Kit`."""
    return _registering(Kit, "kit", name, settings, **about)


def gateway(name: str, settings: type[ComponentSettings]) -> Decorator:
    """Register a gateway: a class derived from `Gateway`."""
    return _registering(ComponentType, "gateway", name, settings)


def _registering(kind: type[Any], type_name: str, name: str, settings: type[Any], **about: Any) -> Decorator:
    def register(made: Made) -> Made:
        declared = _declared(made, about)
        if what := _misplaced(kind, about, declared):
            raise Refused(f"{word_of(type_name)} {name} of {made.__module__}: {what}")
        its = about | declared
        found = _described(kind, {"type_name": type_name, "name": name, "factory": made, "settings": settings, **its})
        check_component_type(found)
        key = type_name, name
        if found.module not in _own_modules().get(name, ()):
            _own(type_name, name)
        first = _known.setdefault(key, found)
        if (first.module, first.factory.__qualname__) != (found.module, made.__qualname__):
            raise Refused(f"{type_name} {name} is registered by {first.module} and {found.module}")
        _known[key] = found
        return made

    return register


def _declared(made: Any, about: Mapping[str, Any]) -> dict[str, Any]:
    """Return the slots and needs that a class declares by `slot` and `need`, as fields of its description."""
    declared = getattr(made, "declared", {}).values()
    slots = {one.name: one.size for one in declared if one.size is not None}
    shared = tuple(one.name for one in declared if one.is_shared)
    found: dict[str, Any] = {key: its for key, its in (("slots", slots), ("shared", shared)) if its}
    if needs := tuple(one.name for one in declared if one.size is None):
        found["needs"] = (*needs, *about.get("needs", ()))
    return found


def _misplaced(kind: type[Any], about: Mapping[str, Any], declared: Mapping[str, Any]) -> str:
    """Return what is wrong with the place of declared slots and needs; empty if nothing is."""
    if kind is Model:
        return "the slots of a model are slots= of its registration, not slot() or need()" if declared else ""
    if "slots" in about:
        return "its slots are declared in its class, as offset = slot(3), not by slots="
    if "shared" in declared and kind is not EntityRule:
        return "slot(shared=True) is valid in rules of entities only"
    if "needs" in declared and kind is WorldRule:
        return "need() is valid in components of entities only; a rule of the world reads all entities"
    return ""


def _described(kind: type[Any], about: dict[str, Any]) -> Any:
    """Return the description of a component type; that of a model has the fields that foosim needs, and variants."""
    variants = about.pop("variants", {})
    found = kind(**about)
    if not isinstance(found, Model):
        return found
    of_variants = {value: _described(Model, {**about, **its}) for value, its in variants.items()}
    declared = found.slots
    if isinstance(declared, Mapping):
        declared = {**declared, **{slot: 1 for slot in found.needed if slot not in declared}}
    return replace(found, slots=declared, variants=of_variants)


# --- finding ---------------------------------------------------------------------------------------------------------


def find(type_name: str, kind: str) -> ComponentType:
    """Return the component type with this `kind` in a deployment: a registered name, or `module:Class`.

    Raises UnknownName, which has the nearest name, and BadValue for a module that cannot be imported, or an
    unregistered class in it.
    """
    found = lookup(type_name, kind)
    if found is None:
        raise unknown(type_name, kind, names(type_name))
    return found


def unknown(type_name: str, kind: str, choices: Iterable[str]) -> UnknownName:
    """Return the error for an unknown name, with the packages that could not be imported."""
    others = () if type_name == "engine" else (f"any {BY_CLASS}",)
    return UnknownName("; ".join([f"unknown {word_of(type_name)}", *load_entry_points()]), kind, choices, *others)


def lookup(type_name: str, kind: str) -> ComponentType | None:
    """Return the component type as `find`, or None for an unknown name; raises BadValue for a class as `find` does."""
    if ":" in kind:
        return _of_class(type_name, kind)
    found = _known.get((type_name, kind)) or _own(type_name, kind)
    if found is None:
        load_entry_points()
        found = _known.get((type_name, kind))
    return found


def find_engine(name: str) -> Engine:
    """Return an engine; raises UnknownName."""
    if name not in ENGINES and name not in engines():
        raise unknown("engine", name, engines())
    return ENGINES[name]


def engines() -> list[str]:
    """Return the names of the engines of foosim and of installed packages, in name order."""
    load_entry_points()
    return sorted(ENGINES)


def find_component(type_name: str, kind: str) -> Component:
    """Return a sensor, actuator or modifier; raises like `find`."""
    found = find(type_name, kind)
    assert isinstance(found, Component), found
    return found


def find_model(kind: str) -> Model:
    """Return a model of entities; raises like `find`."""
    found = find("model", kind)
    assert isinstance(found, Model), found
    return found


def names(type_name: str) -> list[str]:
    """Return the names of all installed component types with a type name, sorted."""
    for module in chain.from_iterable(_own_modules().values()):
        import_module(module)
    load_entry_points()
    packages = {entry.module.partition(".")[0] for entry in _entry_points()}
    return sorted(
        name
        for (known, name), found in _known.items()
        if known == type_name
        and (found.module in _own_modules().get(name, ()) or found.module.partition(".")[0] in packages)
    )


def load_entry_points() -> list[str]:
    """Import the modules that other packages name; return errors of imports."""
    for entry in _entry_points():
        if entry.value not in _loaded:
            _loaded[entry.value] = _load(entry)
    return [failure for failure in _loaded.values() if failure]


@cache
def _entry_points() -> Sequence[EntryPoint]:
    """Return the entry points of all installed packages; their files are read once."""
    from importlib.metadata import entry_points  # brings the parser of e-mail

    return sorted(entry_points(group=GROUP), key=lambda entry: entry.value)


def _load(entry: EntryPoint) -> str:
    known = dict(_known)
    try:
        entry.load()
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # noqa: BLE001  # SystemExit, too: a module may do anything
        _forget_new(known)
        giver = "a package" if entry.dist is None else f"{entry.dist.name} {entry.dist.version}"
        return f"{entry.value} of {giver} cannot be imported: {failure_of(error, entry.module)}"
    return ""


def _own(type_name: str, name: str) -> ComponentType | None:
    """Return one of foosim's own, imported from its module; None for an unknown name."""
    for module in _own_modules().get(name, ()):
        import_module(module)
        if (type_name, name) in _known:  # a module of another type may bring numpy
            break
    return _known.get((type_name, name))


@cache
def _own_modules() -> Mapping[str, Sequence[str]]:
    """Return the modules of foosim's own component types by name: a sensor and a model may have one name.

    Those of all worlds are last: they have the sensors that take the longest to import.
    """
    folders = import_module(LIBRARY).__path__
    found: dict[str, list[str]] = {}
    for kind in sorted([kind.name for kind in iter_modules(folders) if kind.ispkg], reverse=True):
        for module in iter_modules([f"{folder}/{kind}" for folder in folders]):
            if not module.ispkg:
                found.setdefault(module.name, []).append(f"{LIBRARY}.{kind}.{module.name}")
    for module in iter_modules(import_module(GATEWAYS).__path__):
        found.setdefault(module.name, []).append(f"{GATEWAYS}.{module.name}")
    return found


def class_at(path: str, found_on: str = "on PYTHONPATH") -> Any:
    """Return the value of `module:Class`, for a component or a player; `found_on` is where its module can be.

    Raises BadValue for a module that cannot be imported, or has no such name; its nearest is a path that may be meant.
    """
    if not re.fullmatch(CLASS_PATTERN, path):
        raise BadValue(f"not of the form {BY_CLASS}", path, quoted(class_path_of(path)))
    module_name, _, class_name = path.partition(":")
    known = dict(_known)
    try:
        module = import_module(module_name)
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # SystemExit, too: a module may do anything
        _forget_new(known)
        missing = error.name if isinstance(error, ModuleNotFoundError) else None
        if missing and f"{module_name}.".startswith(f"{missing}."):
            raise _not_found(path, missing, found_on) from error
        raise BadValue(f"cannot be imported: {failure_of(error, module_name)}", path) from error
    if not hasattr(module, class_name):
        own = (one for one, its in vars(module).items() if getattr(its, "__module__", "") == module_name)
        there = [one for one in own if not one.startswith("_")]
        refused = UnknownName(f"there is no {class_name} in {module_name}", class_name, there)
        nearest = nearest_name(class_name, there)
        raise BadValue(refused.problem, path, quoted(nearest and f"{module_name}:{nearest}"))
    return getattr(module, class_name)


def _not_found(path: str, missing: str, found_on: str) -> BadValue:
    """Return the error for a path whose module, or a package of it, cannot be found."""
    parent, dot, last = missing.rpartition(".")
    if dot:
        folders: Iterable[str] = getattr(sys.modules.get(parent), "__path__", ())
        hint = "" if folders else f" ({parent} is a module, not a package)"
    else:
        folders = [folder for folder in sys.path if not in_library(f"{folder}/")]
        hint = f" (it is not {found_on})"
    nearest = nearest_name(last, [module.name for module in iter_modules(folders)] if folders else ())
    found = None if nearest is None else f"{parent}{dot}{nearest}{path[len(missing) :]}"
    return BadValue(f"there is no module {missing}{hint}", path, quoted(found))


def _of_class(type_name: str, path: str) -> ComponentType:
    """Return the component type that `module:Class` registered."""
    made, module = class_at(path), path.partition(":")[0]
    of_type = [one for one in _known.values() if one.type_name == type_name]
    for one in of_type:
        if one.factory is made:
            return one
    there = sorted(one.factory.__qualname__ for one in of_type if one.module == module)
    hint = f"; {module} registers {', '.join(there)}" if there else ""
    raise BadValue(f"not registered as {with_article(word_of(type_name))}{hint}", path)


def _forget_new(known: Mapping[tuple[str, str], ComponentType]) -> None:
    """Forget the registered component types of modules whose import then failed; their earlier imports stay."""
    for key in _known.keys() - known.keys():
        if _known[key].module not in sys.modules:
            del _known[key]
