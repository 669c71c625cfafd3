"""What the version of a form depends on: its module, those of its base classes, and what these import of their own.

A module's own are those of its top-level package, and of its folder where modules lie beside each other; of an
installed one those of its distribution. Imports are read from the source, so that one within a function counts.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator, Mapping
from contextlib import suppress
from functools import cache
from importlib.machinery import ModuleSpec
from importlib.util import find_spec, resolve_name
from typing import Any

from foosim.world.forms.failures import OURS, in_library


def sources_of(made: Any) -> dict[str, bytes]:
    """Return the sources that a form is made of, by module: text, or the bytes of what is compiled."""
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
    with suppress(Exception):  # a parent that is none, a module without a description
        return find_spec(module)
    return None


@cache
def _source(module: str) -> bytes:
    """Return the source of a module, or its file as it is where there is none; nothing of a namespace."""
    spec = _spec(module)
    loader: Any = None if spec is None else spec.loader
    text = None
    with suppress(Exception):  # of a loader that can do anything
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
    with suppress(SyntaxError, ValueError):  # of what is compiled
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
    """Whether a module is of the same package, folder or distribution as another."""
    if _top(other) == _top(module):
        return True
    here, there = _folder(_top(module)), _folder(_top(other))
    if not here or here != there:
        return False
    return not in_library(f"{here}/") or _distribution(_top(other)) == _distribution(_top(module))


@cache
def _folder(top: str) -> str:
    """Return the folder in which a module or package lies; empty where that is not known."""
    spec = _spec(top)
    if spec is None:
        return ""
    places = [*(spec.submodule_search_locations or ())]
    place = places[0] if places else (spec.origin or "") if spec.has_location else ""
    return place.rpartition("/")[0]


def _distribution(top: str) -> tuple[str, ...]:
    return tuple(sorted(set(distributions().get(top, ()))))


@cache
def distributions() -> Mapping[str, list[str]]:
    """Return the installed distributions by the top names of their modules; all their files are read, once."""
    from importlib.metadata import packages_distributions  # brings the parser of e-mail

    return packages_distributions()
