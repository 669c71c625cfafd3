"""The component types of a world, and the versions of those of other packages.

Two nodes with different versions of a component would compute different worlds, and a capture is only repeated by the
version of its run.

A version depends on a component's module, those of its base classes, and what these import of their own: modules of
their top-level package, and of its folder where modules lie beside each other. Imports are read from the source, so
that one within a function counts.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import cache
from hashlib import blake2b
from importlib.machinery import ModuleSpec
from importlib.util import find_spec, resolve_name
from typing import Any, Final

from foosim.world.component_types import registry
from foosim.world.component_types.descriptions import ComponentType
from foosim.world.component_types.failures import OURS, in_library
from foosim.world.component_types.settings import ActuatorSettings, SensorSettings
from foosim.world.layout import spares_of
from foosim.world.spec import WorldSpec

DIGEST_BYTES: Final = 8


def component_types_of(spec: WorldSpec) -> list[ComponentType]:
    """Return the component types of a world, each once, by type and name."""
    found = {(one.type_name, one.name): one for one in _component_types_of(spec)}
    return [one for _, one in sorted(found.items())]


def _component_types_of(spec: WorldSpec) -> Iterator[ComponentType]:
    for kit in spec.kit_types.values():
        yield kit
        yield from map(registry.find_model, (*kit.entities.values(), *spares_of(spec, kit).values()))
    for rule in spec.world_rules.values():
        yield rule.component_type
    if spec.scene is not None:
        yield spec.scene.component_type
    for thing in spec.objects.values():
        yield thing.component_type
    for robot in spec.robots.values():
        yield robot.component_type
        for sensor in robot.sensors.values():
            yield from _with_modifiers(sensor)
        for actuator in robot.actuators.values():
            yield from _with_modifiers(actuator)
        for of_entity in robot.rules.values():
            yield of_entity.component_type


def _with_modifiers(settings: SensorSettings | ActuatorSettings) -> Iterator[ComponentType]:
    yield settings.component_type
    for modifier in settings.modifiers:
        yield modifier.component_type


def foreign_versions(spec: WorldSpec) -> dict[str, str]:
    """Return the versions of the component types of a world that other packages bring, by type and class.

    A version is a digest of the sources.
    """
    foreign = [one for one in component_types_of(spec) if not one.is_own]
    return {f"{one.type_name} {one.module}:{one.factory.__qualname__}": _version(one.factory) for one in foreign}


@cache
def _version(made: Callable[..., Any]) -> str:
    digest = blake2b(digest_size=DIGEST_BYTES)
    for module, source in sources_of(made).items():
        digest.update(f"{len(module)} {module} {len(source)} ".encode() + source)
    return digest.hexdigest()


# --- sources ---------------------------------------------------------------------------------------------------------


def sources_of(made: Any) -> dict[str, bytes]:
    """Return the sources of a component, by module: text, or the bytes of a compiled module."""
    bases = [base.__module__ for base in getattr(made, "__mro__", ())]
    modules = [module for module in (made.__module__, *bases) if _is_foreign(module)]
    found: dict[str, bytes] = {}
    waiting = list(dict.fromkeys(modules))
    while waiting:
        module = waiting.pop()
        if module in found:
            continue
        found[module] = _source(module)
        waiting += [other for other in _imports(module) if other not in found and _belongs(other, module)]
    return dict(sorted(found.items()))


def _is_foreign(module: str) -> bool:
    return _top(module) not in (OURS, *sys.stdlib_module_names, "__main__")


def _top(module: str) -> str:
    return module.partition(".")[0]


@cache
def _spec(module: str) -> ModuleSpec | None:
    with suppress(Exception):  # a parent without submodules, a module without a spec
        return find_spec(module)
    return None


@cache
def _source(module: str) -> bytes:
    """Return the source of a module, or the bytes of its file without source; nothing of a namespace."""
    spec = _spec(module)
    loader: Any = None if spec is None else spec.loader
    text = None
    with suppress(Exception):  # a loader may raise anything
        text = loader.get_source(module)
    if text is not None:
        return str(text).encode()
    with suppress(Exception):
        return bytes(loader.get_data(spec.origin if spec is not None else ""))
    return b""


@cache
def _imports(module: str) -> tuple[str, ...]:
    """Return the modules that one may import, and the packages that it is in."""
    spec = _spec(module)
    found = dict.fromkeys(_parents(module))
    with suppress(SyntaxError, ValueError):  # of a compiled module
        for node in ast.walk(ast.parse(_source(module))):
            for name in _names(node, "" if spec is None else spec.parent or ""):
                found |= dict.fromkeys([*_parents(name), name])
    return tuple(name for name in found if _is_foreign(name) and _spec(name) is not None)


def _parents(module: str) -> list[str]:
    parts = module.split(".")
    return [".".join(parts[:count]) for count in range(1, len(parts))]


def _names(node: ast.AST, package: str) -> Iterator[str]:
    """Yield the modules that a statement may import: a name that is imported from a package may be one."""
    if isinstance(node, ast.Import):
        yield from (alias.name for alias in node.names)
    elif isinstance(node, ast.ImportFrom):
        base = "." * node.level + (node.module or "")
        with suppress(ImportError):  # above its top
            base = resolve_name(base, package or None)
        if base and not base.startswith("."):
            yield base
            yield from (f"{base}.{alias.name}" for alias in node.names if alias.name != "*")


def _belongs(other: str, module: str) -> bool:
    """Whether a module is of the same package as another, or lies in the same folder outside of the libraries."""
    here, there = _folder(_top(module)), _folder(_top(other))
    return _top(other) == _top(module) or (bool(here) and here == there and not in_library(f"{here}/"))


@cache
def _folder(top: str) -> str:
    """Return the folder of a module or package; empty where it is unknown."""
    spec = _spec(top)
    if spec is None:
        return ""
    places = [*(spec.submodule_search_locations or ())]
    place = places[0] if places else (spec.origin or "") if spec.has_location else ""
    return place.rpartition("/")[0]
