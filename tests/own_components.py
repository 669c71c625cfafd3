"""Modules with components of other packages, as tests write them, and the problems of deployments that name these."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from importlib import invalidate_caches
from pathlib import Path
from typing import Any, Final

import pytest

from foosim.common.errors import DeploymentError
from foosim.deployment import loader
from foosim.deployment.loader import apply_sets
from foosim.world.assembly import versions
from foosim.world.component_types import registry
from tests.deployed import TABLE, TEXT

HEAD: Final = """
from typing import Annotated

from msgspec import Struct
from pydantic import Field

from foosim.common import units
from foosim.common.errors import BadValue
from foosim.common.spec_base import SpecBase
from foosim.common.units import Quantity
from foosim.world.component_types.descriptions import ENTITY, ROBOTS
from foosim.world.component_types.quantities import Metres
from foosim.world.component_types.registry import *
from foosim.world.component_types.settings import *
from foosim.world.components.base import *


class Number(Struct, frozen=True):
    value: Metres


class Scan(Struct, frozen=True):
    distances: tuple[float, ...]


class Nothing(Struct, frozen=True):
    pass


class Settings(SensorSettings):
    count: Annotated[int, Field(gt=0)] = 1


class Own(Sensor, Actuator, Modifier, Model, Rule, Kit):
    def __init__(self, *made_with):
        pass

    def sample(self, view):
        return Number(0.0)

    def apply(self, values, view=None):
        return values

    def body(self):
        return None

    def place(self, view):
        pass

    def is_plausible(self, numbers, before):
        return True

    def move(self, entities, motors, view):
        pass


"""


def folder_on_path(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a folder, which is on the path now; a module of one name is another one in each test."""
    monkeypatch.syspath_prepend(str(folder))
    forget_modules()
    return folder


def forget_modules() -> None:
    """Modules, and deployments that name theirs, are looked for anew: another one of the same name is elsewhere now."""
    loader._kept.clear()
    of_versions = versions._version, versions._spec, versions._source, versions._imports, versions._folder
    for kept in (loader._applied, registry._entry_points, *of_versions):
        kept.cache_clear()
    invalidate_caches()


def written(folder: Path, *lines: str, name: str = "own_form") -> Path:
    """Return the file of a module that has these lines behind the usual imports and an empty class `Own`."""
    path = folder / f"{name}.py"
    path.write_text(HEAD + "\n".join(lines) + "\n")
    sys.modules.pop(name, None)
    invalidate_caches()
    return path


def install(folder: Path, name: str, version: str, *modules: str) -> None:
    """Leave in a folder what pip leaves there of a package whose entry points are modules in the folder."""
    about = folder / f"{name}-{version}.dist-info"
    about.mkdir()
    (about / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n")
    entries = "\n".join(f"{module.removeprefix('own_')} = {module}" for module in modules)
    (about / "entry_points.txt").write_text(f"[foosim.world]\n{entries}\n")
    registry._entry_points.cache_clear()


def fresh(code: str, folder: Path | None = None) -> Any:
    """Return what a new process, with a folder on its path, prints as JSON."""
    path = {} if folder is None else {"PYTHONPATH": str(folder)}
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, check=False, env={**os.environ, **path})
    assert done.returncode == 0, done.stderr
    assert done.stdout, "it ended without a word"
    return json.loads(done.stdout)


def problems(*sets: str, text: str = "") -> list[str]:
    """Return what is said of a deployment, the table if no other, with settings: without places in the text."""
    try:
        apply_sets(text or TEXT, TABLE.name, sets)
    except DeploymentError as error:
        return [re.sub(r"^\S+:\d+:\d+: ", "", problem) for problem in error.problems]
    return []
