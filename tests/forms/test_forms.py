"""Each of foosim's forms in a world of its own: its settings beyond their limits.

`make forms` has the long part: the laws, thousands of ticks by several seeds, and runs with settings at their limits.
`make test` has the laws of all forms together, in the worlds of tests/whole_worlds.py, and of those alone that these
cannot have.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cache
from typing import Final

import pytest

from foosim.cli.rehearse import elsewhere
from foosim.common.errors import DeploymentError
from foosim.deployment.loader import load_deployment
from foosim.simulation.check.component_check import ComponentCheck
from foosim.simulation.run import rehearse
from foosim.simulation.system import Settings
from foosim.world.assembly.used_forms import forms_of
from foosim.world.forms import registry
from foosim.world.forms.registry import FORMS
from tests.forms.limits import Edge, edges
from tests.forms.worlds import VARIANTS, WORLDS, World, changed_slots
from tests.frames import Frames, broken_laws

Key = tuple[str, ...]
TICKS: Final = 100
NAME: Final = "world.yaml"
OF_FILES: Final = [("model", "urdf"), *(("actuator", name) for name in ("joint_torque", "look_at", "pan_tilt"))]
"""What only a robot from a file has, which a text alone does not bring: tests/whole_worlds.py has them."""
ALL: Final[Mapping[Key, World]] = dict[Key, World]([*WORLDS.items(), *VARIANTS.items()])
EACH: Final = pytest.mark.parametrize("key", ALL, ids="-".join)
ALONE: Final = {("scene", "football_table"), ("scene", "hall")}
"""What no world of tests/whole_worlds.py has: each has one engine and one scene."""
EACH_ALONE: Final = pytest.mark.parametrize(
    "key", [pytest.param(key, marks=() if key in ALONE else pytest.mark.campaign) for key in ALL], ids="-".join
)


@cache
def own() -> list[tuple[str, str]]:
    found = [registry.find(form, name) for form in FORMS for name in registry.names(form)]
    return sorted((form.type_name, form.name) for form in found if form.is_own)


def test_every_form_has_a_world_of_its_own() -> None:
    assert sorted([*WORLDS, *OF_FILES]) == own()
    for (form, name), world in WORLDS.items():
        used = {(found.type_name, found.name) for found in forms_of(load_deployment(world.text(), NAME))}
        assert (form, name) in used


@cache
def broken(text: str) -> list[str]:
    """Return which laws a world breaks; several forms share one."""
    return [str(law) for law in broken_laws(text, NAME, TICKS)]


@cache
def changed(text: str) -> set[str]:
    """Return which slots of a world change."""
    frames = Frames()
    rehearse(text, NAME, TICKS, 1, settings=Settings(on_commit=frames))
    return changed_slots(frames.frames[0], frames.frames[-1])


@EACH_ALONE
def test_it_obeys_the_laws(key: Key) -> None:
    assert broken(ALL[key].text()) == []


@EACH_ALONE
def test_its_world_moves(key: Key) -> None:
    """A world in which nothing happens would prove nothing: robots go where they are told, sensors measure."""
    moved = changed(ALL[key].text())
    assert any(slot.endswith(("joint_positions", "wheel_travel", "angular_velocity")) for slot in moved)
    if key[0] == "sensor" or key[0] == "modifier":
        assert any(slot.endswith("own.samples") for slot in moved)


@EACH
def test_settings_beyond_their_limits_are_refused_at_their_place(key: Key) -> None:
    """Those of different settings together, where each is told of; the others one by one."""
    waiting = [edge for edge in edges(registry.find(*key[:2]), ALL[key]) if not edge.is_within]
    while waiting:
        together = list({edge.place: edge for edge in reversed(waiting)}.values())
        told = problem_of(key, *together).splitlines()
        for edge in together:
            waiting.remove(edge)
            place = place_of(key, edge)
            if not any(f" {place}: " in line and str(edge.value) in line for line in told):
                problem = problem_of(key, edge)
                assert f" {place}: " in problem or f" {place.rpartition('.')[0]}: " in problem, (edge.label, problem)


def place_of(key: Key, edge: Edge) -> str:
    return re.sub(r"\.(\d+)", r"[\1]", ".".join(map(str, (*ALL[key].place, *edge.place))))


def problem_of(key: Key, *changed: Edge) -> str:
    """Return why a deployment with these settings is refused; nothing where it is not."""
    try:
        load_deployment(ALL[key].text(*[(edge.place, edge.value) for edge in changed]), NAME)
    except DeploymentError as error:
        return str(error)
    return ""


@pytest.mark.campaign
@pytest.mark.parametrize("seed", range(1, 4))
@EACH
def test_it_obeys_the_laws_for_long(key: Key, seed: int) -> None:
    text = ALL[key].text().replace("seed: 1\n", f"seed: {seed}\n")
    check = ComponentCheck(text, NAME, 2_000, seed)
    assert [*check.broken(), *elsewhere(text, NAME, 2_000, check.first)] == []


@pytest.mark.campaign
@EACH
def test_settings_at_their_limits_run_or_are_refused(key: Key) -> None:
    """On two nodes as on one."""
    for edge in edges(registry.find(*key[:2]), ALL[key]):
        if edge.is_within and not problem_of(key, edge):
            text = ALL[key].text((edge.place, edge.value))
            one, two = (rehearse(text, NAME, 200, nodes) for nodes in (1, 2))
            assert not one.json["failed"], (edge.label, one.json["reason"])
            assert one.digests == two.digests, edge.label
