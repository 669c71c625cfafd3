"""The component types of a world, and the versions of components of other packages.

Two nodes with different versions of a component would compute different worlds, and a capture is only repeated by the
version of its run.

A version depends on a component's module, those of its base classes, and what these import of their own: modules of
their top-level package, and of its folder where modules lie beside each other. Imports are read from the source, so
that one within a function counts.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import cache
from hashlib import blake2b
from importlib.machinery import PathFinder, SourceFileLoader
from modulefinder import ModuleFinder
from typing import Any, Final

from foosim.world.component_types import registry
from foosim.world.component_types.descriptions import ComponentType
from foosim.world.component_types.failures import OURS, in_library
from foosim.world.component_types.settings import ActuatorSettings, SensorSettings
from foosim.world.layout import spares_of
from foosim.world.spec import WorldSpec

DIGEST_BYTES: Final = 8
PACKAGE: Final = 5
"""The kind of a package in `modulefinder`."""


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
    """Return the files of a component's class and its base classes, and of what they import of their own, by module."""
    found: dict[str, bytes] = {}
    for module in dict.fromkeys(base.__module__ for base in getattr(made, "__mro__", (made,))):
        if _top(module) not in (OURS, *sys.stdlib_module_names, "__main__") and module not in found:
            found |= _Imports(module).sources()
    return dict(sorted(found.items()))


def _top(module: str) -> str:
    return module.partition(".")[0]


class _Imports(ModuleFinder):
    """The modules that a module may import of its top-level package, and of its folder outside of the libraries."""

    def __init__(self, module: str) -> None:
        top = sys.modules[_top(module)]
        self._module = module
        folder = [*getattr(top, "__path__", ()), top.__file__ or ""][0].rpartition("/")[0]
        self._is_library = in_library(f"{folder}/")
        super().__init__(path=[folder], excludes=[OURS, *sys.stdlib_module_names])
        with suppress(ImportError):  # of an editable install: it is found in another way than by its folder
            self.import_hook(module)

    def find_module(self, name: str, path: Any, parent: Any = None) -> Any:
        """Find a module: a namespace is a package without a file, which the base class does not know."""
        spec = PathFinder.find_spec(name, path or self.path)
        if spec is None or spec.loader is not None or not spec.submodule_search_locations:
            return super().find_module(name, path, parent)
        return None, next(iter(spec.submodule_search_locations)), ("", "", PACKAGE)

    def load_package(self, fqname: str, pathname: str) -> Any:
        """Load a package; a namespace has no file."""
        try:
            return super().load_package(fqname, pathname)
        except ImportError:
            found: Any = self.modules[fqname]
            found.__file__ = None
            return found

    def import_module(self, partname: str, fqname: str, parent: Any) -> Any:
        """Find a module of its own; None for any other."""
        if self._is_library and _top(fqname) != _top(self._module):
            return None
        return super().import_module(partname, fqname, parent)

    def sources(self) -> dict[str, bytes]:
        """Return the files of these modules."""
        files = {name: getattr(module, "__file__", None) for name, module in self.modules.items()}
        files.setdefault(self._module, sys.modules[self._module].__file__)
        return {name: SourceFileLoader(name, file).get_data(file) for name, file in files.items() if file}
