"""Components of other packages that cannot work: a problem of the deployment that names them, at its place, in a line.

What one does at any later tick ends the run by an error with its name, its entity, the tick and its line.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import pytest

from foosim.common.errors import DeploymentError
from foosim.deployment.loader import read_deployment
from foosim.simulation.check.component_check import ComponentCheck
from foosim.simulation.run import rehearse
from foosim.simulation.settings import Settings
from tests.components.worlds import HALL, ROVERS, World
from tests.conftest import Typed
from tests.own_components import folder_on_path

NAME: Final = "own.yaml"
GOOD: Final = """
from msgspec import Struct
from foosim import Player
from foosim.world.components.entities import RuleMounting
from foosim.world.component_types.quantities import Metres
from foosim.world.components.base import Actuator, EntityRule, Model, Modifier, Motion, Rule, Sensor, need, slot
from foosim.world.component_types.registry import actuator, model, modifier, rule, scene, sensor
from foosim.world.component_types.settings import (
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


@model("slider", Mover, motion=Slides, actuators={"speed": {"kind": "own_parts:Speed"}}, slots={
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


@actuator("speed", ActuatorSettings, Wanted)
class Speed(Actuator):
    wanted = slot()

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


@sensor("places", SensorSettings, Reading)
class Places(Sensor):
    position, count = need(), slot()

    def __init__(self, settings, at):
        self.left = at.slot("quarantined")

    def sample(self, view):
        view.write(self.count, view.read(self.count)[0] + 1.0)
        return Reading(*view.read(self.position)[:2])


@modifier("halves", ModifierSettings)
class Halves(Modifier):
    def __init__(self, settings, at):
        pass

    def apply(self, values, view):
        return [value / 2.0 for value in values]


@rule("wears", EntityRuleSettings)
class Wears(EntityRule):
    way, velocity = slot(), need()

    def apply(self, view):
        view.write(self.way, view.read(self.way)[0] + abs(view.read(self.velocity)[0]))


@rule("counts", RuleSettings)
class Counts(Rule):
    ticks = slot()

    def place(self, view):
        view.write(self.ticks, 5.0)

    def apply(self, view):
        view.write(self.ticks, view.read(self.ticks)[0] + 1.0)

    def status(self, view):
        return {"ticks": view.read(self.ticks)[0]}

    @staticmethod
    def text(status):
        return f"{status['ticks']:.0f} ticks"


class Drives(Player):
    def act(self, tick, samples):
        return {"mover": {"speed": 0.5}}


@scene("pillar", SceneSettings)
def pillar(settings):
    return (Shape(Box((0.1, 0.1, 1.0)), "", GREY, (3.0, -2.0, 1.0), name="pillar"),)
"""
SENSOR: Final = {"kind": "own_parts:Places", "rate": "50 Hz", "modifiers": [{"kind": "own_parts:Halves"}]}


def own_world() -> World:
    """A hall with rovers, and all of own components."""
    world = HALL.with_(("robots", "mover"), {"model": "own_parts:Moves"}, ())
    world = world.with_(("robots", "mover", "sensors"), {"places": SENSOR}, ())
    world = world.with_(("robots", "mover", "rules"), {"wears": {"kind": "own_parts:Wears"}}, ())
    world = world.with_(("robots", ROVERS[0], "sensors", "places"), SENSOR, ())
    world = world.with_(("scene",), {"kind": "own_parts:pillar"}, ())
    own = {"class": "own_parts:Drives", "rate": "50 Hz", "lockstep": True, "robots": {"mover": []}}
    world = world.with_(("players", "own"), own, ())
    return world.with_(("rules",), {"counts": {"kind": "own_parts:Counts"}}, ())


def planted(folder: Path, monkeypatch: pytest.MonkeyPatch, source: str) -> None:
    (folder / "own_parts.py").write_text(source)
    folder_on_path(folder, monkeypatch)
    sys.modules.pop("own_parts", None)


def test_what_works_is_valid_and_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    planted(tmp_path, monkeypatch, GOOD)
    done = rehearse(own_world().text(), NAME, 50, 2)
    assert not done.json["failed"] and done.json["ticks"] == 50 and done.json["failed_component"] is None


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
    assert "ZeroDivisionError" in problem and f"(own_parts.py:{line})" in problem
    assert method in ("status", "text") or f": {PLACES[component]}" in problem


BROKEN: Final = {
    "a place of two": ("3.0, 2.0, 0.1)", "3.0, 2.0)", "robots:", "2 numbers for mover position, which has 3"),
    "a place that is not finite": ("3.0, 2.0, 0.1)", "3.0, float('nan'), 0.1)", "robots:", "nan"),
    "no answer": (
        "return True\n\n\nclass Wanted",
        "pass\n\n\nclass Wanted",
        "robots:",
        "is_plausible() returned None; expected True or False (own_parts.py:",
    ),
    "a motion into nowhere": (
        "x + speed * dt",
        "float('inf')",
        "",
        "inf, 2.0, 0.1 for mover position: numbers of a frame",
    ),
    "a rule that writes what is not finite": (
        "abs(view.read(self.velocity)[0])",
        "float('nan')",
        "robots.mover.rules",
        "nan for mover wears.way: numbers of a frame are finite (own_parts.py:",
    ),
    "a slot that is none": ('at.slot("quarantined")', 'at.slot("quarantind")', "robots.mover.sensors:", "quarantind"),
    "a reading of another type": (
        "Reading(*view",
        "tuple(view",
        "robots.mover.sensors:",
        "sample() returned (3.0, 2.0); expected a Reading (own_parts.py:",
    ),
    "too few numbers": (
        "for value in values]",
        "for value in values[1:]]",
        "robots.mover.sensors:",
        "; expected a list of 2 numbers, or None (own_parts.py:",
    ),
    "limits of no field": (
        '{"speed": (',
        '{"sped": (',
        "robots.mover.actuators",
        "; expected a mapping of fields (speed) to least and greatest value (own_parts.py:",
    ),
    "one motor, flat": (
        "[0], 1.0),)",
        "[0], 1.0))",
        "robots.mover.actuators",
        "; expected a tuple of (target, greatest force) (own_parts.py:",
    ),
    "a rule's place that writes by hand": (
        "        view.write(self.ticks, 5.0)",
        "        view.write(self.ticks, 5.0)\n        view.numbers[0] = 0.125",
        "rule counts of the world failed",
        "TypeError: numbers of a frame are written by view.write alone (own_parts.py:",
    ),
    "a status that is none": (
        'return {"ticks": view.read(self.ticks)[0]}',
        "return None",
        "rules: ",
        "status() returned None; expected a mapping of names to JSON values (own_parts.py:",
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


# --- in a run --------------------------------------------------------------------------------------------------------

TICK: Final = 10
MISDEEDS: Final = {
    "1 / 0": "ZeroDivisionError: ",
    "raise SystemExit(0)": "SystemExit: 0",
    "return 3.0": "returned 3.0; expected ",
    "return [3.0]": "returned [3.0]; expected ",
}
AT_TICKS: Final = {
    ("Slides", "move"): "motion",
    ("Speed", "accept"): "actuator speed of mover",
    ("Speed", "command"): "actuator speed of mover",
    ("Places", "sample"): "sensor places of ",
    ("Halves", "apply"): "modifier halves of places of ",
    ("Wears", "apply"): "rule wears of mover",
    ("Counts", "apply"): "rule counts of the world",
}
"""Methods that are called at ticks, and what their error names. Those of rules and motions return nothing."""
NOTHING: Final = ("Slides", "Wears", "Counts")
NOT_FINITE: Final = {
    ("Wears", "apply", "view.write(self.way, float('nan'))"): "nan for mover wears.way: numbers of a frame are finite",
    ("Places", "sample", "view.write(self.count, float('nan'))"): "nan for rover-1 places.count: numbers of a frame",
}
IN_A_RUN: Final = NOT_FINITE | {
    (*where, line): error
    for where in AT_TICKS
    for line, error in MISDEEDS.items()
    if not (line.startswith("return") and where[0] in NOTHING)
}
"""By component, method and line: the error."""


def misdeed(component: str, method: str, line: str) -> tuple[str, int]:
    """Return the source with a line that a method begins with from a tick on, and its number."""
    lines = GOOD.splitlines()
    begin = next(n for n, one in enumerate(lines) if one.startswith(f"class {component}("))
    at = next(n for n in range(begin, len(lines)) if f"def {method}(" in lines[n]) + 1
    lines[at:at] = [f"        if view.tick >= {TICK}:", f"            {line}"]
    return "\n".join(lines), at + 2


@pytest.mark.parametrize(("component", "method", "line"), IN_A_RUN)
def test_a_misdeed_at_any_tick_ends_the_run_with_its_name_its_tick_and_its_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, component: str, method: str, line: str
) -> None:
    source, number = misdeed(component, method, line)
    planted(tmp_path, monkeypatch, source)
    logged: list[str] = []
    settings = Settings(on_log=lambda process, level, text: logged.append(text) if process == "supervisor" else None)
    done = rehearse(own_world().text(), NAME, 30, 2, settings=settings).json
    name, failed = AT_TICKS[component, method], done["failed_component"]
    error = re.escape(IN_A_RUN[component, method, line])
    found = re.search(rf"{name}.* failed at tick (\d+): .*{error}", done["reason"])
    assert done["failed"] and found is not None and TICK <= int(found[1]) == failed["tick"] <= TICK + 5, done["reason"]
    assert any(failed["traceback"] in text for text in logged)
    if not line.startswith("return"):
        assert f"(own_parts.py:{number})" in done["reason"] and failed["traceback"].startswith("Traceback")


@pytest.mark.parametrize(("component", "method"), [key for key in AT_TICKS if key[0] != "Slides"])
def test_a_direct_write_to_the_frame_is_found_by_the_check_of_components(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, component: str, method: str
) -> None:
    source, number = misdeed(component, method, "view.numbers[0] = 0.125")
    planted(tmp_path, monkeypatch, source)
    check = ComponentCheck(own_world().text(), NAME, 20)
    (line,) = check.broken()
    assert check.has_failed and AT_TICKS[component, method] in line
    assert f"TypeError: numbers of a frame are written by view.write alone (own_parts.py:{number})" in line


def test_an_interrupt_is_no_misdeed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    planted(tmp_path, monkeypatch, misdeed("Places", "sample", "raise KeyboardInterrupt")[0])
    with pytest.raises(KeyboardInterrupt):
        rehearse(own_world().text(), NAME, 30, 1)


ARRAY: Final = "expected an array of float64 of the shape (2, 2)"


@pytest.mark.parametrize(
    ("made", "said"), [("np.zeros((2, 1))", ARRAY), ("[[1.0, 2.0]] * 2", ARRAY), ("exit(0)", "SystemExit: 0")]
)
def test_sensors_that_measure_together_give_an_array(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, made: str, said: str
) -> None:
    together = f"""
class Batch:
    def sample(self, view):
        return {made}


Places.together = staticmethod(lambda sensors: Batch())
"""
    lines = refused(tmp_path, monkeypatch, f"import numpy as np\n{GOOD}{together}")
    assert any(said in line and "sensor places of" in line for line in lines), lines


@pytest.mark.parametrize(("command", "tick"), [("check", 0), ("components check", 0), ("rehearse", 10)])
def test_no_command_is_done_where_a_component_leaves(
    tmp_path: Path, typed: Typed, monkeypatch: pytest.MonkeyPatch, command: str, tick: int
) -> None:
    """`sys.exit(0)` in a sensor: at the trial of a deployment, and in a run."""
    source, number = misdeed("Places", "sample", "raise SystemExit(0)")
    planted(tmp_path, monkeypatch, source.replace(f">= {TICK}", f">= {tick}"))
    (tmp_path / NAME).write_text(own_world().text())
    words = {"check": [], "components check": ["places", "--in"], "rehearse": ["--for", "500ms"]}[command]
    done = typed(*command.split())(*words, str(tmp_path / NAME))
    assert done.code == (1 if tick else 2), done
    assert f"failed at tick {tick or 1}: SystemExit: 0 (own_parts.py:{number})" in done.out + done.err
