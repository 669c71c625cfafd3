"""A form that takes long is named by the stack of its thread, once, and only when it is in one call for long."""

from __future__ import annotations

import sys
from pathlib import Path
from types import FrameType
from typing import Any, Final

import numpy as np
import pytest

from foosim.deployment.loader import load_deployment
from foosim.node.slow_forms import LATE_NS, LOOK_NS, SLOW_NS, Names, SlowForms, form_in
from foosim.node.tick import Stepper
from foosim.world.assembly.world import initial_numbers
from foosim.world.frame import Frame
from foosim.world.layout import build_layout

DEPLOY: Final = Path(__file__).parents[2] / "deploy"
FOUND: Final = ("sensor current of red.goal", "currents.py:27 in sample")


def stepper_and_frame(name: str) -> tuple[Stepper, Frame]:
    deployment = load_deployment((DEPLOY / name).read_text(), name)
    layout = build_layout(deployment)
    return Stepper(deployment, layout), Frame(0, layout, np.array(initial_numbers(deployment, layout)))


def caught(monkeypatch: pytest.MonkeyPatch, kind: type[Any], method: str) -> list[FrameType]:
    """Have a method of a class keep the stacks of its calls, as another thread would see them."""
    frames: list[FrameType] = []
    original = getattr(kind, method)

    def sample(self: Any, *arguments: Any) -> Any:
        frames.append(helper())
        return original(self, *arguments)

    monkeypatch.setattr(kind, method, sample)
    return frames


def helper() -> FrameType:
    return sys._getframe()


@pytest.mark.parametrize("file", ["table.yaml", "warehouse.yaml"])
def test_each_form_of_a_world_has_a_name_and_each_sensor_is_found_on_the_stack(
    file: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    stepper, frame = stepper_and_frame(file)
    names = Names(stepper)
    for made, what in stepper.forms():
        assert what and names.name_of(made)
    fitted = [one for sensors in stepper._sensors.values() for one in sensors if one.is_due(0, frame.numbers)]
    kept = {kind: caught(monkeypatch, kind, "sample") for kind in dict.fromkeys(type(one.sensor) for one in fitted)}
    stepper.sense(frame, stepper.layout.robots)
    places = [form_in(stack, names.name_of, names.files | {__file__}) for frames in kept.values() for stack in frames]
    alone = {what for what, _ in places}
    assert alone and alone <= {f"sensor {one.channel} of {one.robot}" for one in fitted}
    assert {where.partition(":")[0] for _, where in places} == {"test_slow_forms.py"}
    assert {where.partition(" in ")[2] for _, where in places} == {"sample"}, "the helper is no form"


def test_sensors_that_are_computed_together_are_named_together() -> None:
    stepper, frame = stepper_and_frame("warehouse.yaml")
    stepper.sense(frame, stepper.layout.robots)
    names = Names(stepper)
    together = stepper.forms_together()
    assert together and all(names.name_of(made) == what and " of " in what for made, what in together)


def test_a_stack_without_a_form_names_nothing() -> None:
    stepper, _ = stepper_and_frame("table.yaml")
    names = Names(stepper)
    assert form_in(helper(), names.name_of, names.files) == ("", "")
    assert form_in(None, names.name_of, names.files) == ("", "")


class Looks:
    """Looks at one tick after the other, at times of its own clock."""

    def __init__(self) -> None:
        self.now_ns = 0
        self.forms = SlowForms(0)
        self.searched = 0

    def look(self, tick: int, found: tuple[str, str] = FOUND, after_ns: int = LOOK_NS) -> str:
        self.now_ns += after_ns

        def find() -> tuple[str, str]:
            self.searched += 1
            return found

        slow = self.forms.look(tick, find, self.now_ns)
        return "" if slow is None else str(slow)


def test_a_form_is_named_once_it_was_seen_for_long_and_only_once() -> None:
    looks = Looks()
    said = [looks.look(250) for _ in range(8)]
    text = "sensor current of red.goal has taken 0.1 s at tick 250 so far: currents.py:27 in sample"
    assert said == ["", "", *[""] * (SLOW_NS // LOOK_NS - 1), text, *[""] * 4]
    assert [looks.look(300) for _ in range(8)] == [""] * 8
    assert any(looks.look(300, ("rule wind of the world", "wind.py:9 in apply")) for _ in range(4))


def test_ticks_that_advance_are_not_searched() -> None:
    looks = Looks()
    assert not any(looks.look(tick) for tick in range(100)) and looks.searched == 0
    assert not any(looks.look(-1) for _ in range(10)) and looks.searched == 0


def test_one_form_after_the_other_is_not_slow() -> None:
    looks = Looks()
    assert not any(looks.look(7, (f"sensor s{n % 2} of r", "s.py:1 in sample")) for n in range(20))


def test_a_standstill_of_the_process_blames_no_form() -> None:
    looks = Looks()
    assert not any(looks.look(7, after_ns=LOOK_NS + LATE_NS + 1) for _ in range(20))
    assert not looks.look(7) and not looks.look(7) and looks.look(7)
