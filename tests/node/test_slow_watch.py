"""A tick that takes long is named with the line of the component that computes, once a file."""

from __future__ import annotations

import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import FrameType
from typing import Any, Final

import numpy as np
import pytest

from foosim.deployment.loader import load_deployment
from foosim.node.slow_watch import LOOKS, SlowTicks, SlowWatch, place_in
from foosim.node.tick import Stepper
from foosim.world.assembly.world import initial_numbers
from foosim.world.frame import Frame
from foosim.world.layout import build_layout

DEPLOY: Final = Path(__file__).parents[2] / "deploy"
PLACE: Final = "currents.py:27 in sample"


def helper() -> FrameType:
    return sys._getframe()


@pytest.mark.parametrize("file", ["table.yaml", "warehouse.yaml"])
def test_a_user_s_sensor_is_found_on_the_stack_of_a_node_that_senses(
    file: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    deployment = load_deployment((DEPLOY / file).read_text(), file)
    layout = build_layout(deployment)
    stepper = Stepper(deployment, layout)
    frame = Frame(0, layout, np.array(initial_numbers(deployment, layout)))
    due = [one.sensor for fitted in stepper._sensors.values() for one in fitted if one.is_due(0, frame.numbers)]
    places: list[str] = []
    for kind in {type(sensor) for sensor in due}:

        def sample(self: Any, *arguments: Any, original: Any = kind.sample) -> Any:
            places.append(place_in(sys._getframe()))
            return original(self, *arguments)

        monkeypatch.setattr(kind, "sample", sample)
    stepper.sense(frame, layout.robots)
    assert places and all(place.startswith("test_slow_watch.py:") and place.endswith(" in sample") for place in places)


def test_a_user_s_module_comes_before_the_world_and_libraries_are_no_place() -> None:
    def stack(*calls: tuple[str, str]) -> FrameType:
        """The stack of functions that call one another, outermost first: name of the module, and file."""
        frame = None
        call: Any = sys._getframe
        for module, file in reversed(calls):
            space: dict[str, Any] = {"__name__": module, "inner": call}
            exec(compile("def f():\n    return inner()\n", file, "exec"), space)
            call = space["f"]
        with ThreadPoolExecutor(1) as thread:  # whose stack has nothing of this file
            frame = thread.submit(call).result()
        assert isinstance(frame, FrameType)
        return frame

    ours, own = ("foosim.world.sensors.odd", "/w/odd.py"), ("own.lidar", "/home/me/lidar.py")
    library = ("threading", threading.__file__)
    loop = [("__main__", "/bin/node"), ("foosim.node.main", "/w/main.py")]
    assert place_in(stack(*loop, ours, library)) == "odd.py:2 in f"
    assert place_in(stack(*loop, own, ours, library)) == "lidar.py:2 in f"
    assert place_in(None) == ""


class Looks:
    """Looks at one tick after the other."""

    def __init__(self) -> None:
        self.ticks = SlowTicks()
        self.searched = 0

    def look(self, tick: int, place: str = PLACE) -> str:
        def find() -> str:
            self.searched += 1
            return place

        return self.ticks.look(tick, find)


def test_a_place_is_named_when_it_was_seen_often_at_one_tick_and_its_file_only_once() -> None:
    looks = Looks()
    text = "currents.py:27 in sample has taken more than 0.2 s at tick 250"
    assert [looks.look(250) for _ in range(8)] == [*[""] * LOOKS, text, *[""] * (7 - LOOKS)]
    assert not any(looks.look(300) for _ in range(8))
    assert any(looks.look(300, "wind.py:9 in apply") for _ in range(LOOKS))


def test_ticks_that_advance_are_not_searched_and_a_node_that_waits_is_not_slow() -> None:
    looks = Looks()
    assert not any(looks.look(tick) for tick in range(100)) and looks.searched == 0
    assert not any(looks.look(-1) for _ in range(10)) and looks.searched == 0
    assert not any(looks.look(100, "") for _ in range(10))
    assert not any(looks.look(100, PLACE if n % LOOKS else "") for n in range(10)), "it waits now and then"


def test_a_tick_that_hangs_is_named_while_it_hangs() -> None:
    named = threading.Event()
    texts: list[str] = []

    def name(text: str) -> None:
        texts.append(text)
        named.set()

    watch = SlowWatch(lambda: 7, name)
    assert named.wait(60), "the thread of this test hangs here"
    watch.stop()
    assert len(texts) == 1 and texts[0].startswith("test_slow_watch.py:")
