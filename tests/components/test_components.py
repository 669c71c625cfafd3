"""Each of foosim's component types in the worlds of tests/whole_worlds.py: its settings beyond their limits.

`make components` has the long part: the laws over thousands of ticks by several seeds, and runs with settings at their
limits. `make test` has the laws in tests/laws/test_one_world.py.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any, Final, NamedTuple

import pytest
import yaml

from foosim.cli.components import as_json
from foosim.cli.rehearse import elsewhere
from foosim.common.errors import DeploymentError
from foosim.deployment.assets import pin_assets
from foosim.deployment.loader import load_deployment
from foosim.simulation.check.component_check import ComponentCheck
from foosim.simulation.run import rehearse
from foosim.world.component_types import registry
from foosim.world.component_types.descriptions import ComponentType
from foosim.world.component_types.registry import TYPE_NAMES
from tests.components.worlds import DEPLOY, HALL, SCENE, TABLE, Place, World, scene
from tests.frames import broken_laws
from tests.whole_worlds import NAME, assets, mixed, written, yard

Key = tuple[str, str]
TICKS: Final = 60
WHOLE: Final[Mapping[str, tuple[Any, Any]]] = {"mixed": (mixed, lambda: DEPLOY), "everything": (yard, assets)}
EACH: Final = pytest.mark.parametrize("whole", WHOLE)
ALONE: Final[Mapping[Key, World]] = {
    ("scene", "football_table"): scene(HALL, "football_table", {key: TABLE.data["table"][key] for key in SCENE}),
    ("scene", "hall"): scene(TABLE, "hall", {key: HALL.data["hall"][key] for key in ("length", "width", "walls")}),
}
"""Scenes that no world of tests/whole_worlds.py has, which have one each."""
QUANTITY: Final = re.compile(r"[\w ]+, (-?[\d.e+-]+) (.+?) to (-?[\d.e+-]+) (.+?): a number and one of .*")
NUMBER: Final = re.compile(r"(number|integer)(?:, at least ([\d.]+))?(?:, at most ([\d.]+))?")
NOTHING: Final[tuple[Any, ...]] = ("nonsense", "1 furlong", [], True, "nan", "inf")
"""Values that no setting with limits takes; each of these settings is given one of them."""


TOGETHER: Final = 60
"""Settings changed in one text: of more than 100 problems the rest is not told."""


class Edge(NamedTuple):
    """A value of a setting at its place in the deployment; whether it is within the limits."""

    place: Place
    value: Any
    is_within: bool


@cache
def own() -> list[Key]:
    found = [registry.find(type_name, name) for type_name in TYPE_NAMES for name in registry.names(type_name)]
    return sorted((one.type_name, one.name) for one in found if one.is_own and one.type_name != "gateway")


@cache
def parsed(whole: str) -> str:
    return json.dumps(yaml.safe_load(WHOLE[whole][0]()))


def data_of(whole: str) -> dict[str, Any]:
    data: dict[str, Any] = json.loads(parsed(whole))
    return data


def folder_of(whole: str) -> Path:
    folder: Path = WHOLE[whole][1]()
    return folder


def places(data: Mapping[str, Any]) -> Iterator[tuple[Key, Place]]:
    """Yield each component that a deployment names, with the place of its settings."""
    for kit in ("table", "hall"):
        if kit in data:
            yield ("kit", kit), (kit,)
    yield ("scene", data["scene"]["kind"]), ("scene",)
    for name, rule in data.get("rules", {}).items():
        yield ("rule", rule["kind"]), ("rules", name)
    for section in ("objects", "robots"):
        for name, thing in data[section].items():
            yield ("model", thing["model"]), (section, name)
            for what in ("sensor", "actuator", "rule"):
                for label, component in thing.get(f"{what}s", {}).items():
                    place = (section, name, f"{what}s", label)
                    yield ("entity_rule" if what == "rule" else what, component["kind"]), place
                    for at, modifier in enumerate(component.get("modifiers", ())):
                        yield ("modifier", modifier["kind"]), (*place, "modifiers", at)


def section(data: Mapping[str, Any], place: Place) -> Any:
    found: Any = data
    for key in place:
        found = found[key]
    return found


def edges(component_type: ComponentType, data: Mapping[str, Any], place: Place) -> Iterator[Edge]:
    """Yield the limits of each of a component's settings that has any, and what lies just beyond."""
    for count, setting in enumerate(as_json(component_type)["settings"]):
        at = (*place, *_placed(setting["key"].split("."), section(data, place)))
        quantity, number = QUANTITY.fullmatch(setting["value"]), NUMBER.fullmatch(setting["value"])
        if quantity is not None:
            low, unit, high, other = quantity.groups()
            yield Edge(at, f"{low} {unit}", is_within=True)
            yield Edge(at, f"{high} {other}", is_within=True)
            yield Edge(at, f"{_less(float(low)):.9g} {unit}", is_within=False)
            yield Edge(at, f"{-_less(-float(high)):.9g} {other}", is_within=False)
        elif number is not None:
            kind, least, most = number.groups()
            made, step = (int, 1) if kind == "integer" else (float, 0.001)
            for limit, beyond in ((least, -step), (most, step)):
                if limit is not None:
                    yield Edge(at, made(limit), is_within=True)
                    yield Edge(at, made(limit) + beyond, is_within=False)
        else:
            continue
        yield Edge(at, NOTHING[count % len(NOTHING)], is_within=False)
    yield Edge((*place, "unheard_of"), "1 m", is_within=False)


def _less(number: float) -> float:
    return number - max(abs(number) * 0.01, 0.001)


def _placed(keys: Sequence[str], settings: Any) -> Place:
    """Return the place of a setting; of one that any name may have, in the first that the world has."""
    place: list[str | int] = []
    for key in keys:
        name = next(iter(settings)) if key == "NAME" and settings else key
        place.append(name)
        settings = settings.get(name, {}) if isinstance(settings, dict) else {}
    return tuple(place)


def edges_of(whole: str) -> list[Edge]:
    """Return those of each component that a world names, once."""
    data = data_of(whole)
    first: dict[Key, Place] = {}
    for key, place in places(data):
        first.setdefault(key, place)
    return [edge for key, place in first.items() for edge in edges(registry.find(*key), data, place)]


def with_settings(whole: str, *changed: Edge) -> str:
    """Return a world's text with other settings."""
    data = data_of(whole)
    for edge in changed:
        inner: Any = data
        for key in edge.place[:-1]:
            inner = inner.setdefault(key, {}) if isinstance(inner, dict) else inner[key]
        inner[edge.place[-1]] = json.loads(json.dumps(edge.value))
    return written(data)


def problem_of(whole: str, *changed: Edge) -> str:
    """Return why a world with these settings is refused; nothing where it is not."""
    try:
        text, files = pin_assets(with_settings(whole, *changed), NAME, folder_of(whole))
        load_deployment(text, NAME).with_assets(files)
    except DeploymentError as error:
        return str(error)
    return ""


@EACH
def test_settings_beyond_their_limits_are_refused_at_their_place(whole: str) -> None:
    """Those of different settings together, as long as some of them are told of; the others one by one."""
    waiting = [edge for edge in edges_of(whole) if not edge.is_within]
    assert len(waiting) > 100
    while waiting:
        together = list({edge.place: edge for edge in reversed(waiting)}.values())[:TOGETHER]
        lines = problem_of(whole, *together).splitlines()
        told = [edge for edge in together if is_told(edge.place, lines)]
        if not told:
            told = together[:1]
            (edge,), lines = told, problem_of(whole, *told).splitlines()
            assert is_told(edge.place, lines) or is_told(edge.place[:-1], lines), (edge, lines)
        for edge in told:
            waiting.remove(edge)


def is_told(place: Place, lines: Sequence[str]) -> bool:
    """Return whether a line is about a place: of an unknown key, about the section that it is in."""
    *names, last = (rf"\[{key}\]" if isinstance(key, int) else f".{re.escape(key)}" for key in place)
    names += ["" if last == ".unheard_of" else last]
    names[1:2] = [rf"{name}(-\d+)?" for name in names[1:2]]
    pattern = re.compile(f" {''.join(names)[1:]}: ")
    return any(pattern.search(line) for line in lines)


@pytest.mark.parametrize("key", ALONE, ids="-".join)
def test_a_scene_of_a_world_of_its_own_obeys_the_laws(key: Key) -> None:
    assert list(broken_laws(ALONE[key].text(), NAME, TICKS)) == []


@pytest.mark.campaign
@pytest.mark.parametrize("seed", range(1, 7))
@EACH
def test_the_laws_hold_for_long(whole: str, seed: int) -> None:
    text, files = pin_assets(written(data_of(whole) | {"seed": seed}), NAME, folder_of(whole))
    check = ComponentCheck(text, NAME, 2_000, seed, files=files)
    assert list(check.broken()) == []
    assert whole != "mixed" or list(elsewhere(text, NAME, 2_000, check.first)) == []


@pytest.mark.campaign
@EACH
def test_settings_at_their_limits_run_or_are_refused(whole: str) -> None:
    """On two nodes as on one."""
    for edge in edges_of(whole):
        if edge.is_within and not problem_of(whole, edge):
            text = with_settings(whole, edge)
            one, two = (rehearse(text, NAME, 100, nodes, folder=folder_of(whole)) for nodes in (1, 2))
            assert not one.json["failed"], (edge, one.json["reason"])
            assert one.digests == two.digests, edge
