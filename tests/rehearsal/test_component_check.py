"""The check of a form's laws: what obeys them passes, and each way to break them is found and named."""

from __future__ import annotations

import sys
from importlib import invalidate_caches
from pathlib import Path
from typing import Final

import pytest

from foosim.cli.rehearse import elsewhere
from foosim.common.errors import Refused
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.rehearsal.check.component_check import broken_laws, used_form
from foosim.rehearsal.check.differences import Frames
from foosim.rehearsal.run import rehearse
from foosim.rehearsal.system import Settings

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
TICKS: Final = 120
HEAD: Final = """
import random, time
from msgspec import Struct
from foosim.common.keyed_random import draw_key, draw_words
from foosim.world.components.entities import RuleMounting
from foosim.world.components.view import Mounting
from foosim.world.forms.forms import ENTITY
from foosim.world.forms.quantities import Metres
from foosim.world.forms.registry import rule, sensor
from foosim.world.forms.settings import RuleSettings, SensorSettings


class Number(Struct, frozen=True):
    value: Metres


class Settings(SensorSettings):
    pass
"""
SENSOR: Final = """

@sensor("own", Settings, Number, slots={{"kept": 1}}, needs=("joint_positions",))
class Own:
    def __init__(self, settings, at):
        self.at, self.kept, self.joints = at, at.slot("kept"), at.slot("joint_positions")
        self.count = 0
        self.random = random.Random(1)

    def sample(self, view):
        self.count += 1
        view.write(self.kept, {value})
        return Number({value})
"""
RULE: Final = """

class OwnSettings(RuleSettings):
    pass


@rule("own", OwnSettings, slots={"sum": 16})
class Own:
    def __init__(self, settings, at):
        self.sum = at.slot("sum")
        self.joints = [at.of(rod, "joint_positions") for rod in at.layout.of("rod")]
        self.ball = at.of(at.layout["ball"], "position")
        self.index, self.robots = at.layout["ball"].index, list(at.spec.robots)

    def apply(self, view):
        APPLY
"""
GOOD: Final = "view.read(self.joints)[0] + view.read(self.kept)[0]"
BAD: Final = {
    "memory in an object": ("float(self.count)", "red.goal own.kept"),
    "a running generator": ("self.random.random()", "red.goal own.kept"),
    "a clock": ("time.perf_counter()", "red.goal own.kept"),
}
BESIDE: Final = "beside a robot that does nothing and comes first the world is another one"
SETS: Final = ("engine=pure", "substeps=1", "players={}", "table.rules.kickoff_delay=20 ms")
OF_ROD: Final = "robots.red.goal.sensors.own={kind: 'own_form:Own', rate: 100 Hz}"
OF_WORLD: Final = "rules={own: {kind: 'own_form:Own'}}"


@pytest.fixture
def planted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder on the path, and on that of further processes."""
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    return tmp_path


def broken(planted: Path, source: str, sets: str, *, processes: bool = False) -> list[str]:
    (planted / "own_form.py").write_text(HEAD + source)
    sys.modules.pop("own_form", None)
    invalidate_caches()
    text = apply_sets(TABLE.read_text(), TABLE.name, [*SETS, sets])
    return [*broken_laws(text, TABLE.name, TICKS), *(elsewhere(text, TABLE.name, TICKS) if processes else ())]


def test_what_obeys_passes_also_in_another_process(planted: Path) -> None:
    assert broken(planted, SENSOR.format(value=GOOD), OF_ROD, processes=True) == []


@pytest.mark.parametrize("what", BAD)
def test_what_a_sensor_has_outside_of_the_frame_is_found_and_named(planted: Path, what: str) -> None:
    value, slot = BAD[what]
    found = broken(planted, SENSOR.format(value=value), OF_ROD)
    assert any("moved and objects made anew" in line and slot in line for line in found), found


def test_a_sum_in_the_order_of_hashes_is_found_by_another_process(planted: Path) -> None:
    """Two orders of one set give the same sum once in ten times; of 16 sets, never."""
    one = "sum((-1.1) ** (int(name) % 301) for name in {f'{k}' for k in range(400 + n)})"
    apply = f"view.write(self.sum, *({one} for n in range(16)))"
    found = broken(planted, RULE.replace("APPLY", apply), OF_WORLD, processes=True)
    assert found == ["another process computes another world"]


def test_a_draw_by_the_place_among_others_is_found_beside_one_more(planted: Path) -> None:
    value = "draw_words(draw_key(1, str(self.at.robot.index)), view.tick)[0] / 2.0 ** 32"
    found = broken(planted, SENSOR.format(value=value), OF_ROD)
    assert found == [f"{BESIDE}: tick 1, red.goal own.kept"]


def test_a_reading_by_the_place_among_others_is_found_beside_one_more(planted: Path) -> None:
    """Nothing of it is in the frame."""
    source = SENSOR.format(value="float(self.at.robot.index)").replace("view.write(self.kept", "(self.kept")
    found = broken(planted, source, OF_ROD)
    assert found == [f"{BESIDE}: tick 5, the reading of own of red.goal"]


def test_an_entity_that_is_kept_as_a_number_is_found_beside_one_more(planted: Path) -> None:
    """A slot that refers to entities is compared by names."""
    found = broken(planted, RULE.replace("APPLY", "view.write(self.sum, *[float(self.index)] * 16)"), OF_WORLD)
    (line,) = found
    assert line.startswith(BESIDE) and line.endswith("world own.sum")
    declared = RULE.replace('slots={"sum": 16}', 'slots={"sum": ENTITY}')
    assert broken(planted, declared.replace("APPLY", "view.write(self.sum, float(self.index))"), OF_WORLD) == []


def test_a_sum_in_the_order_of_the_file_is_found_by_another_order(planted: Path) -> None:
    one = "sum(10.0 ** (ord(name[-1]) % 17) / 3.0 * (-1) ** len(name) for name in self.robots)"
    line, *_ = broken(planted, RULE.replace("APPLY", f"view.write(self.sum, *[{one}] * 16)"), OF_WORLD)
    assert line.startswith("named in another order, the world is another one") and line.endswith("world own.sum")


def test_a_sensor_that_counts_its_like_is_found_beside_a_second_one(planted: Path) -> None:
    value = "float(len([slot for slot in self.at.robot.offsets if slot.endswith('.samples')]))"
    (line,) = broken(planted, SENSOR.format(value=value), OF_ROD)
    assert line.startswith("beside a second one of each sensor the world is another one")
    assert "red.goal own.kept" in line


def test_a_write_to_anothers_slot_ends_the_run_with_both_names(planted: Path) -> None:
    (line,) = broken(planted, RULE.replace("APPLY", "view.write(self.ball, 0.0, 0.0, 1.0)"), OF_WORLD)
    assert "rule own of the world failed" in line and "ball position, which is not its own" in line


def test_a_reading_that_is_another_beside_its_like_is_found(planted: Path) -> None:
    together = """
    @staticmethod
    def together(sensors):
        return Together(sensors)


class Together:
    def __init__(self, sensors):
        self.sensors = sensors

    def sample(self, view):
        import numpy as np
        for one in self.sensors:
            view.write(one.kept, 0.0)
        return np.array([[float(len(self.sensors))] for _ in self.sensors])
"""
    more = "robots.red.attack.sensors.own={kind: 'own_form:Own', rate: 100 Hz}"
    (planted / "own_form.py").write_text(HEAD + SENSOR.format(value="0.0") + together)
    text = apply_sets(TABLE.read_text(), TABLE.name, [*SETS, OF_ROD, more])
    found = list(broken_laws(text, TABLE.name, TICKS))
    assert any("sensor own of red.attack gives another reading alone than with others" in line for line in found)


def test_a_form_is_named_as_deployments_do() -> None:
    text = TABLE.read_text()
    assert used_form(text, TABLE.name, "encoder").form == "sensor"
    assert used_form(text, TABLE.name, "rule football").name == "football"
    assert used_form(text, TABLE.name, "foosim.world.models.rod:Rod").form == "model"
    with pytest.raises(Refused, match="uses no form called 'proximity'; there are actuator joint_position, engine"):
        used_form(text, TABLE.name, "proximity")


SPEAKS: Final = """

@sensor("own", Settings, Number, needs=("contacts",), speaks="contacts")
class Own:
    def __init__(self, settings, at):
        self.contacts = at.slot("contacts")

    def sample(self, view):
        return Number(view.read(self.contacts)[1])
"""


def test_a_sensor_that_speaks_is_heard_at_each_tick_of_a_contact(planted: Path) -> None:
    """Beside its rate, at which it says the impulse, whatever it is; with three nodes as with one."""
    (planted / "own_form.py").write_text(HEAD + SPEAKS)
    rods = [name for name in load_deployment(TABLE.read_text(), TABLE.name).robots if name != "camera"]
    sensors = [f"robots.{rod}.sensors.own={{kind: 'own_form:Own', rate: 1 Hz}}" for rod in rods]
    fast = ["table.rules.kickoff_speed=4 m/s", "substeps=4"]
    text = apply_sets(TABLE.read_text(), TABLE.name, [*SETS, *fast, *sensors])
    assert list(broken_laws(text, TABLE.name, 400)) == []
    frames = Frames()
    rehearse(text, TABLE.name, 400, 2, settings=Settings(on_commit=frames))
    touched = {rod: sum(frame.at(rod, "contacts") != 0.0 for frame in frames.frames[:-1]) for rod in rods}
    assert sum(touched.values()) > 0, "the ball meets a rod"
    last = frames.frames[-1]
    assert {rod: last.at(rod, "own.samples") for rod in rods} == {rod: 1.0 + touched[rod] for rod in rods}
