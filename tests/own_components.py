"""Modules with forms of somebody's own, as tests write them, and what is said of deployments that name these."""

from __future__ import annotations

import re
import sys
from importlib import invalidate_caches
from pathlib import Path
from typing import Final

import pytest

from foosim.common.errors import DeploymentError
from foosim.deployment import loader
from foosim.deployment.loader import apply_sets
from foosim.world.component_types import registry

TABLE: Final = Path(__file__).parents[1] / "deploy" / "table.yaml"
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
    for kept in (loader._applied, registry._entry_points):
        kept.cache_clear()
    invalidate_caches()


def written(folder: Path, *lines: str, name: str = "own_form") -> Path:
    """Return the file of a module that has these lines behind the usual imports and an empty class `Own`."""
    path = folder / f"{name}.py"
    path.write_text(HEAD + "\n".join(lines) + "\n")
    sys.modules.pop(name, None)
    invalidate_caches()
    return path


def problems(*sets: str, text: str = "") -> list[str]:
    """Return what is said of a deployment, the table if no other, with settings: without places in the text."""
    try:
        apply_sets(text or TABLE.read_text(), TABLE.name, sets)
    except DeploymentError as error:
        return [re.sub(r"^\S+:\d+:\d+: ", "", problem) for problem in error.problems]
    return []
