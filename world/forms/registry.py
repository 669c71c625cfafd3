"""The registry of forms: sensors, actuators and whatever else a world is made of, by form and name.

Each stands in a file of its own and registers itself there, under the name by which deployments ask for it. One of
foosim's own is in the folder of its form, in a module of its name; one of another package is in a module that the
package names as an entry point of the group `foosim.world`; and `module:Class` names one of any module on the path.
Modules are imported when one of theirs is asked for.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from importlib.util import find_spec
from pkgutil import iter_modules
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final, TypeAlias, TypeVar

from foosim.common.errors import Refused, UnknownName
from foosim.common.names import CLASS_PATTERN, NAME_RULE, is_name

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

    from msgspec import Struct

    from foosim.world.forms.settings import ComponentSettings

GROUP: Final = "foosim.world"
FOLDERS: Final[Mapping[str, str]] = {
    "sensor": "foosim.world.sensors",
    "actuator": "foosim.world.actuators",
    "modifier": "foosim.world.modifiers",
}
"""Where foosim's own are, by form."""
FORMS: Final = tuple(FOLDERS)

SAMPLES: Final = "samples"
"""The slot of each sensor that counts what it has sampled; no component declares one of this name."""
NO_SLOTS: Final[Mapping[str, int]] = MappingProxyType({})
NO_SETTINGS: Final[Mapping[str, float | None]] = MappingProxyType({})

Made = TypeVar("Made", bound=Callable[..., Any])


@dataclass(frozen=True, slots=True)
class Carrier:
    """What a modifier is on: how many numbers a value has, and in which time they come one after the other (ns).

    Commands come in a tick's time at the earliest.
    """

    size: int
    period_ns: int


SlotsOf: TypeAlias = Callable[[Any, Carrier], Mapping[str, int]]
"""The slots of a modifier, by its settings and what it is on. Raises BadValue for settings that do not fit that."""


@dataclass(frozen=True, slots=True)
class Component:
    """A registered class, and what there is to know of it without making one.

    `value` is the type of its readings or commands; a modifier has none. `slots` are the numbers that it remembers, by
    field: they are in the frame as `NAME.FIELD`, NAME being that of the component on its robot. `needs` are the fields
    that the model of its robot must have, `kit` is the section that a deployment must have; empty where any will do.
    `several` is the setting that says how many numbers the last field of a reading has, if it has several. `moves` says
    that an actuator commands the motors of its robot: one of a robot may. `per_field` are the settings with a number
    for each field (`forms.per_field`), and the least that is valid of each; None without a least one.
    """

    form: str
    name: str
    made: Callable[..., Any]
    settings: type[ComponentSettings]
    value: type[Struct] | None = None
    slots: Mapping[str, int] | SlotsOf = field(default_factory=dict)
    needs: tuple[str, ...] = ()
    kit: str = ""
    several: str = ""
    moves: bool = False
    per_field: Mapping[str, float | None] = field(default_factory=dict)

    def slots_on(self, settings: ComponentSettings, carrier: Carrier) -> Mapping[str, int]:
        """Return its slots with these settings. Raises BadValue where a modifier does not fit what it is on."""
        return self.slots(settings, carrier) if callable(self.slots) else self.slots

    @property
    def module(self) -> str:
        """The module that it is in."""
        return self.made.__module__

    @property
    def summary(self) -> str:
        """The first line of its docstring."""
        return (self.made.__doc__ or "").strip().partition("\n")[0]


_known: Final[dict[tuple[str, str], Component]] = {}
_loaded: Final[dict[str, str]] = {}
"""Of each entry point that was loaded: why that failed, empty if it did not."""


def sensor(
    name: str,
    settings: type[ComponentSettings],
    reading: type[Struct],
    *,
    slots: Mapping[str, int] = NO_SLOTS,
    needs: tuple[str, ...] = (),
    kit: str = "",
    several: str = "",
) -> Callable[[Made], Made]:
    """Register a sensor: a class with the methods of `components.view.Sensor`."""
    return _registering(lambda made: Component("sensor", name, made, settings, reading, slots, needs, kit, several))


def actuator(
    name: str,
    settings: type[ComponentSettings],
    command: type[Struct],
    *,
    slots: Mapping[str, int] = NO_SLOTS,
    needs: tuple[str, ...] = (),
    kit: str = "",
    moves: bool = True,
) -> Callable[[Made], Made]:
    """Register an actuator: a class with the methods of `components.view.Actuator`."""
    return _registering(
        lambda made: Component("actuator", name, made, settings, command, slots, needs, kit, moves=moves)
    )


def modifier(
    name: str,
    settings: type[ComponentSettings],
    *,
    slots: Mapping[str, int] | SlotsOf = NO_SLOTS,
    per_field: Mapping[str, float | None] = NO_SETTINGS,
) -> Callable[[Made], Made]:
    """Register a modifier: a class with the methods of `components.view.Modifier`."""
    return _registering(lambda made: Component("modifier", name, made, settings, slots=slots, per_field=per_field))


def _registering(describe: Callable[[Callable[..., Any]], Component]) -> Callable[[Made], Made]:
    def register(made: Made) -> Made:
        component = describe(made)
        key = component.form, component.name
        if not is_name(component.name):
            raise Refused(f"{component.module} registers a {component.form} as {component.name!r}: {NAME_RULE}")
        if not callable(component.slots) and SAMPLES in component.slots:
            raise Refused(f"{component.form} {component.name} has a slot {SAMPLES}, which each sensor has already")
        own = f"{FOLDERS[component.form]}.{component.name}"
        if component.module != own and _is_there(*key):
            raise Refused(f"{component.form} {component.name} is registered by {component.module}, and is in {own}")
        first = _known.setdefault(key, component)
        if (first.module, first.made.__qualname__) != (component.module, made.__qualname__):
            raise Refused(f"{component.form} {component.name} is registered by {first.module} and {component.module}")
        _known[key] = component
        return made

    return register


# --- finding ---------------------------------------------------------------------------------------------------------


def find(form: str, kind: str) -> Component:
    """Return what a deployment calls `kind`: a registered name, or `module:Class`.

    Raises UnknownName, which says what is nearest, and Refused for a module that cannot be imported, or a class in it
    that is not registered.
    """
    if ":" in kind:
        return _of_class(form, kind)
    found = _known.get((form, kind)) or _own(form, kind)
    if found is None:
        failures = load_entry_points()
        found = _known.get((form, kind))
        if found is None:
            raise UnknownName("; ".join([f"unknown {form}", *failures]), kind, names(form))
    return found


def names(form: str) -> list[str]:
    """Return the names of all that are installed here, in name order."""
    folder = import_module(FOLDERS[form])
    for module in iter_modules(folder.__path__):
        _own(form, module.name)
    load_entry_points()
    return sorted(name for known, name in _known if known == form)


def load_entry_points() -> list[str]:
    """Import the modules that other packages name; return why some could not be."""
    from importlib.metadata import entry_points  # brings the parser of e-mail

    for entry in sorted(entry_points(group=GROUP), key=lambda entry: entry.value):
        if entry.value not in _loaded:
            _loaded[entry.value] = _load(entry)
    return [failure for failure in _loaded.values() if failure]


def _load(entry: EntryPoint) -> str:
    known = dict(_known)
    try:
        entry.load()
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # noqa: BLE001  # SystemExit, too: a module may do anything
        _forget_new(known)
        giver = "a package" if entry.dist is None else f"{entry.dist.name} {entry.dist.version}"
        return f"{entry.value} of {giver} cannot be imported: {type(error).__name__}: {error}"
    return ""


def _own(form: str, name: str) -> Component | None:
    """Return one of foosim's own, imported from its module; None where there is none."""
    if _is_there(form, name):
        import_module(f"{FOLDERS[form]}.{name}")
    return _known.get((form, name))


def _is_there(form: str, name: str) -> bool:
    """Whether foosim has a module of that name for a form."""
    module = f"{FOLDERS[form]}.{name}"
    return name.isidentifier() and (module in sys.modules or find_spec(module) is not None)


def _of_class(form: str, path: str) -> Component:
    """Return the one that `module:Class` registered."""
    if not re.fullmatch(CLASS_PATTERN, path):
        raise Refused("not a class (module:Class)")
    module_name, _, class_name = path.partition(":")
    known = dict(_known)
    try:
        module = import_module(module_name)
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # SystemExit, too: a module may do anything
        _forget_new(known)
        raise Refused(f"cannot be imported: {type(error).__name__}: {error}") from error
    if not hasattr(module, class_name):
        there = [component.made.__qualname__ for component in _known.values() if component.module == module_name]
        raise UnknownName(f"{module_name} registers no such class", class_name, there)
    made = getattr(module, class_name)
    for component in _known.values():
        if component.form == form and component.made is made:
            return component
    raise Refused(f"registered as no {form}")


def _forget_new(known: Mapping[tuple[str, str], Component]) -> None:
    """Forget what a module has registered that then could not be imported."""
    for key in _known.keys() - known.keys():
        del _known[key]
