"""What cannot work of other packages' forms is a problem of the deployment that names them, at its place, in a line."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from importlib import invalidate_caches
from pathlib import Path
from typing import Final

import pytest

from foosim.common.errors import DeploymentError
from foosim.deployment.loader import read_deployment
from foosim.simulation.run import rehearse
from tests.forms.worlds import HALL, ROVERS, World

NAME: Final = "own.yaml"
GOOD: Final = """
from msgspec import Struct
from foosim.world.components.entities import RuleMounting
from foosim.world.forms.quantities import Metres
from foosim.world.components.base import Actuator, EntityRule, Model, Modifier, Motion, Rule, Sensor
from foosim.world.forms.registry import actuator, model, modifier, rule, scene, sensor
from foosim.world.forms.settings import (
    ActuatorSettings, EntityRuleSettings, ModifierSettings, RobotSettings, RuleSettings, SceneSettings, SensorSettings)
from foosim.world.scene import Body, Box, Link, Shape

GREY = (0.5, 0.5, 0.5, 1.0)


class Mover(RobotSettings):
    pass


class Slides(Motion):
    def __init__(self, at):
        self.slots = {e.index: (at.slot(e, "position"), at.slot(e, "velocity")) for e in at.entities}

    def move(self, entities, motors, view):
        for entity, asked in zip(entities, motors):
            position, velocity = self.slots[entity.index]
            (x, y, z), dt = view.read(position), 0.02
            speed = asked[0][0] if asked else 0.0
            view.write(position, x + speed * dt, y, z)
            view.write(velocity, speed, 0.0, 0.0)


@model("slider", Mover, motion=Slides, actuators={"speed": {"kind": "own_forms:Speed"}}, slots={
    "position": 3, "orientation": 4, "velocity": 3, "quarantined": 1, "down": 1, "refused": 1})
class Moves(Model):
    def __init__(self, settings, at):
        self.at = at

    def body(self):
        shape = Shape(Box((0.1, 0.1, 0.1)), "", GREY)
        return Body(self.at.robot.name, "slider", (0.0, 0.0, 0.0), (Link("hull", "free", (shape,), 0.0, (0.0,) * 3),))

    def place(self, view):
        view.write(self.at.slot("position"), 3.0, 2.0, 0.1)
        view.write(self.at.slot("orientation"), 0.0, 0.0, 0.0, 1.0)

    def is_plausible(self, numbers, before):
        return True


class Wanted(Struct, frozen=True):
    speed: Metres


@actuator("speed", ActuatorSettings, Wanted, slots={"wanted": 1})
class Speed(Actuator):
    def __init__(self, settings, at):
        self.wanted = at.slot("wanted")

    def accept(self, command, view):
        view.write(self.wanted, command.speed)
        return True

    def limits(self):
        return {"speed": (-1.0, 1.0)}

    def hold(self, view):
        view.write(self.wanted, 0.0)

    def excite(self, view):
        view.write(self.wanted, 1.0)

    def command(self, view):
        return ((view.read(self.wanted)[0], 1.0),)


class Reading(Struct, frozen=True):
    x: Metres
    y: Metres


@sensor("places", SensorSettings, Reading, needs=("position",), slots={"count": 1})
class Places(Sensor):
    def __init__(self, settings, at):
        self.position, self.count = at.slot("position"), at.slot("count")

    def sample(self, view):
        view.write(self.count, view.read(self.count)[0] + 1.0)
        return Reading(*view.read(self.position)[:2])


@modifier("halves", ModifierSettings)
class Halves(Modifier):
    def __init__(self, settings, at):
        pass

    def apply(self, values, view):
        return [value / 2.0 for value in values]


@rule("wears", EntityRuleSettings, slots={"way": 1}, needs=("velocity",))
class Wears(EntityRule):
    def __init__(self, settings, at):
        self.way, self.velocity = at.slot("way"), at.slot("velocity")

    def apply(self, view):
        view.write(self.way, view.read(self.way)[0] + abs(view.read(self.velocity)[0]))


@rule("counts", RuleSettings, slots={"ticks": 1})
class Counts(Rule):
    def __init__(self, settings, at):
        self.ticks = at.slot("ticks")

    def place(self, view):
        view.write(self.ticks, 5.0)

    def apply(self, view):
        view.write(self.ticks, view.read(self.ticks)[0] + 1.0)

    def status(self, view):
        return {"ticks": view.read(self.ticks)[0]}

    @staticmethod
    def text(status):
        return f"{status['ticks']:.0f} ticks"


@scene("pillar", SceneSettings)
def pillar(settings):
    return (Shape(Box((0.1, 0.1, 1.0)), "", GREY, (3.0, -2.0, 1.0), name="pillar"),)
"""
SENSOR: Final = {"kind": "own_forms:Places", "rate": "50 Hz", "modifiers": [{"kind": "own_forms:Halves"}]}


def own_world() -> World:
    """A hall with rovers, and all of somebody's own forms."""
    world = HALL.with_(("robots", "mover"), {"model": "own_forms:Moves"}, ())
    world = world.with_(("robots", "mover", "sensors"), {"places": SENSOR}, ())
    world = world.with_(("robots", "mover", "rules"), {"wears": {"kind": "own_forms:Wears"}}, ())
    world = world.with_(("robots", ROVERS[0], "sensors", "places"), SENSOR, ())
    world = world.with_(("scene",), {"kind": "own_forms:pillar"}, ())
    return world.with_(("rules",), {"counts": {"kind": "own_forms:Counts"}}, ())


def planted(folder: Path, monkeypatch: pytest.MonkeyPatch, source: str) -> None:
    (folder / "own_forms.py").write_text(source)
    monkeypatch.syspath_prepend(str(folder))
    sys.modules.pop("own_forms", None)
    invalidate_caches()


def test_what_works_is_valid_and_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    planted(tmp_path, monkeypatch, GOOD)
    done = rehearse(own_world().text(), NAME, 50, 2)
    assert not done.json["failed"] and done.json["ticks"] == 50


PLACES: Final = {
    "Slides": "",
    "Moves": "robots: ",
    "Speed": "robots.mover.actuators",
    "Places": "robots.mover.sensors",
    "Halves": "robots.mover.sensors",
    "Wears": "robots.mover.rules",
    "Counts": "rules: ",
    "pillar": "scene",
}
"""Where the world has each component; a motion is not named there."""
NOT_CALLED: Final = ("accept", "limits")
"""What a tick without commands does not call, and what is called of a class before it is tried."""


def raising() -> Iterator[tuple[str, str, int]]:
    """Yield each method of each component, and the line of its source in which it raises."""
    component = ""
    for number, line in enumerate(GOOD.splitlines(), 1):
        component = found[2] if (found := re.match(r"(class|def) (\w+)", line)) else component
        method = re.match(r"    def (\w+)\(|def pillar", line)
        if component in PLACES and method and method[1] not in NOT_CALLED:
            yield component, method[1] or component, number + 1


@pytest.mark.parametrize(("component", "method", "line"), list(raising()))
def test_a_component_that_raises_is_refused_by_name_at_its_place_with_its_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, component: str, method: str, line: int
) -> None:
    lines = GOOD.splitlines()
    lines[line - 1 : line - 1] = ["        1 / 0" if component != "pillar" else "    1 / 0"]
    (problem,) = refused(tmp_path, monkeypatch, "\n".join(lines))
    assert "ZeroDivisionError" in problem and f"(own_forms.py:{line})" in problem
    assert method in ("status", "text") or f": {PLACES[component]}" in problem


BROKEN: Final = {
    "a place of two": ("3.0, 2.0, 0.1)", "3.0, 2.0)", "robots:", "2 numbers for mover position, which has 3"),
    "a place that is not finite": ("3.0, 2.0, 0.1)", "3.0, float('nan'), 0.1)", "robots:", "nan"),
    "no answer": (
        "return True\n\n\nclass Wanted",
        "pass\n\n\nclass Wanted",
        "robots:",
        "is_plausible() returned None; expected True or False (own_forms.py:",
    ),
    "a motion into nowhere": (
        "x + speed * dt",
        "float('inf')",
        "",
        "inf, 2.0, 0.1 for mover position: numbers of a frame",
    ),
    "a slot that is none": ('at.slot("count")', 'at.slot("cuont")', "robots.mover.sensors:", "cuont"),
    "a reading of another type": (
        "Reading(*view",
        "tuple(view",
        "robots.mover.sensors:",
        "sample() returned (3.0, 2.0); expected a Reading (own_forms.py:",
    ),
    "too few numbers": (
        "for value in values]",
        "for value in values[1:]]",
        "robots.mover.sensors:",
        "; expected a list of 2 numbers, or None (own_forms.py:",
    ),
    "limits of no field": (
        '{"speed": (',
        '{"sped": (',
        "robots.mover.actuators",
        "; expected a mapping of fields (speed) to least and greatest value (own_forms.py:",
    ),
    "one motor, flat": (
        "[0], 1.0),)",
        "[0], 1.0))",
        "robots.mover.actuators",
        "; expected a tuple of (target, greatest force) (own_forms.py:",
    ),
    "a rule's place that writes by hand": (
        "        view.write(self.ticks, 5.0)",
        "        view.write(self.ticks, 5.0)\n        view.numbers[0] = 0.125",
        "rule counts of the world failed",
        "TypeError: numbers of a frame are written by view.write alone (own_forms.py:",
    ),
    "a status with an object": (
        '{"ticks": view.read(self.ticks)[0]}',
        '{"ticks": 5, "self": self}',
        "",
        "status failed at tick 1: TypeError",
    ),
}


@pytest.mark.parametrize("what", BROKEN)
def test_what_cannot_work_is_refused_at_its_place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, what: str) -> None:
    good, bad, place, said = BROKEN[what]
    assert good in GOOD
    lines = refused(tmp_path, monkeypatch, GOOD.replace(good, bad, 1))
    assert any(said in line and f": {place}" in line for line in lines), lines


def refused(folder: Path, monkeypatch: pytest.MonkeyPatch, source: str) -> list[str]:
    """Return what is said of the world with these components: a line for each problem, with its place."""
    planted(folder, monkeypatch, source)
    with pytest.raises(DeploymentError) as error:
        read_deployment(own_world().text(), NAME)
    lines = str(error.value).splitlines()
    assert all(line.startswith(f"{NAME}:") and "Traceback" not in line for line in lines)
    return lines
