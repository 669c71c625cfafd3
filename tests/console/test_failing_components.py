"""Components that raise in what is only shown: they are named, with their place, and all else is drawn."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path
from typing import Any, Final

import numpy as np
import pytest

from foosim.console.shown.drawing import Drawing
from foosim.console.shown.timeline import Mark, WorldEvents
from foosim.deployment.loader import apply_sets, read_deployment
from foosim.world.assembly.initial_state import initial_frame
from foosim.world.assembly.world import FAILED, mark_kinds
from foosim.world.frame import Frame
from tests.console.memory import TABLE
from tests.own_components import folder_on_path

PARTS: Final = """
import sys
import numpy as np
from msgspec import Struct
from foosim.world.component_types.quantities import Metres
from foosim.world.components.base import EntityRule, Rule, Sensor
from foosim.world.component_types.registry import rule, sensor
from foosim.world.component_types.settings import *

acts = {}


def act(name, good):
    if acts.get(name) == "raise":
        raise ValueError("no more")
    return acts[name]() if name in acts else good


class Reading(Struct, frozen=True):
    x: Metres


@sensor("shown_beam", SensorSettings, Reading)
class Beam(Sensor):
    def __init__(self, settings, at):
        self.robot = at.robot.name

    def sample(self, view):
        return Reading(1.0)

    @staticmethod
    def rays(sensors, numbers):
        return np.array([act(one.robot, [0.0, 0.0, 0.0, 1.0, 2.0, 3.0]) for one in sensors])


@rule("shown_rule", RuleSettings)
class Marks(Rule):
    def __init__(self, settings, at):
        pass

    def apply(self, view):
        pass

    def marks(self, before, after):
        yield act("rule", (after.tick, "tells", "all is well"))


@rule("shown_wears", EntityRuleSettings)
class Wears(EntityRule):
    def __init__(self, settings, at):
        self.robot = at.robot.name

    def apply(self, view):
        pass

    def marks(self, before, after):
        yield act(f"wears of {self.robot}", (after.tick, "wears", f"{self.robot} wears"))
"""
SETS: Final = (
    "engine=pure",
    "players={}",
    *(f"robots.{robot}.sensors.beam={{kind: 'shown_parts:Beam', rate: 50 Hz}}" for robot in ("red.goal", "blue.goal")),
    *(f"robots.{robot}.rules={{wears: {{kind: 'shown_parts:Wears'}}}}" for robot in ("red.goal", "blue.goal")),
    "rules={told: {kind: 'shown_parts:Marks'}}",
)
RAY: Final = [0.0, 0.0, 0.0, 1.0, 2.0, 3.0]


@pytest.fixture
def components(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    (tmp_path / "shown_parts.py").write_text(PARTS)
    folder_on_path(tmp_path, monkeypatch)
    module = import_module("shown_parts")
    yield module
    sys.modules.pop("shown_parts")


def line_of(text: str) -> str:
    """The place of the line of the module that has this text."""
    number = next(n for n, line in enumerate(PARTS.splitlines(), 1) if text in line)
    return f"(shown_parts.py:{number})"


def deployment() -> Any:
    return read_deployment(apply_sets(TABLE.read_text(), TABLE.name, SETS), TABLE.name)


ACT: Final = line_of("raise ValueError")
Act = str | Callable[[], Any]
"""What a component does: it raises, or gives what this gives."""


@pytest.mark.parametrize(
    ("act", "said"),
    [
        ("raise", f"ValueError: no more {ACT}"),
        (lambda: sys.exit(0), "SystemExit: 0"),
        (
            lambda: [0.0] * 5,
            "rays() returned array([[0., 0., 0., 0., 0.]]); expected an array ",
        ),
        (
            lambda: [float("nan")] * 6,
            "rays() returned array([[nan, nan, nan, nan, nan, nan]]); expected an ",
        ),
    ],
)
def test_rays_that_fail_are_named_once_and_the_others_drawn(components: Any, act: Act, said: str) -> None:
    components.acts["red.goal"] = act
    frame = initial_frame(deployment())
    drawing = Drawing(deployment())
    content, note = drawing.overlays(frame, {"rays", "contacts"})
    assert content["rays"] == [RAY]
    assert note["type"] == "note" and note["level"] == "error"
    assert note["text"].startswith(f"rays of sensor beam of red.goal failed at tick 0: {said}")
    assert ".py:" in note["text"]
    (content,) = drawing.overlays(frame, {"rays"})
    assert content["rays"] == [RAY]


def marks(tick: int, events: WorldEvents, frame: Frame) -> list[Mark]:
    return events.take(Frame(tick, frame.layout, np.array(frame.values)))


@pytest.mark.parametrize("name", ["rule", "wears of red.goal"])
@pytest.mark.parametrize(
    ("act", "said"),
    [
        ("raise", f"ValueError: no more {ACT}"),
        (lambda: 3, "marks() returned 3; expected a mark (tick, kind, text) {}"),
        (lambda: (1.5, "tells", "x"), "marks() returned (1.5, 'tells', 'x'); expected a mark (tick, kind, text) {}"),
    ],
)
def test_marks_that_fail_are_a_mark_and_the_others_told(components: Any, name: str, act: Act, said: str) -> None:
    found = deployment()
    frame, events = initial_frame(found), WorldEvents(found)
    every = [
        Mark(2, "tells", "all is well"),
        Mark(2, "wears", "blue.goal wears"),
        Mark(2, "wears", "red.goal wears"),
    ]
    assert marks(1, events, frame) == [] and sorted(marks(2, events, frame), key=str) == every
    components.acts[name] = act
    told = marks(3, events, frame)
    (failed,) = [mark for mark in told if mark.kind == FAILED]
    place = line_of("def marks(" if name == "rule" else "def __init__(self, settings, at):")
    if name != "rule":
        lines = [n for n, line in enumerate(PARTS.splitlines(), 1) if "def marks(" in line]
        place = f"(shown_parts.py:{lines[1]})"
    called = "rule told of the world" if name == "rule" else "rule wears of red.goal"
    assert failed == Mark(3, FAILED, f"marks of {called} failed at tick 3: {said.format(place)}")
    assert len(told) == 3 and FAILED in mark_kinds(found)
    assert len(marks(4, events, frame)) == 2
