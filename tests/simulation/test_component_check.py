"""The check of a component's laws: what obeys them passes, and each way to break them is found and named."""

from __future__ import annotations

import os
import pty
import re
import signal
import subprocess
import sys
from contextlib import suppress
from importlib import invalidate_caches
from pathlib import Path
from typing import Any, Final

import pytest
from numpy.typing import NDArray

from foosim.cli.rehearse import elsewhere
from foosim.common.errors import BadValue, DeploymentError
from foosim.deployment import loader
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.library.mobile.set_points import MotionSetPoints
from foosim.simulation.check.component_check import ComponentCheck, used_component_type
from foosim.simulation.run import rehearse
from foosim.simulation.system import Settings
from foosim.world.components.view import View
from tests.conftest import Command, Typed
from tests.frames import Frames, broken_laws
from tests.kinematic_yard import yard_text

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
TICKS: Final = 40
HEAD: Final = """
import random, time
from msgspec import Struct
from foosim.common.keyed_random import draw_key, draw_words
from foosim.world.components.entities import RuleMounting
from foosim.world.components.view import Mounting
from foosim.world.component_types.descriptions import ENTITY
from foosim.world.component_types.quantities import Metres
from foosim.world.components.base import EntityRule, Rule, Sensor, need, slot
from foosim.world.component_types.registry import rule, sensor
from foosim.world.component_types.settings import RuleSettings, SensorSettings


class Number(Struct, frozen=True):
    value: Metres


class Settings(SensorSettings):
    pass
"""
SENSOR: Final = """

@sensor("own", Settings, Number)
class Own(Sensor):
    kept, joints = slot(), need("joint_positions")

    def __init__(self, settings, at):
        self.at = at
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


@rule("own", OwnSettings)
class Own(Rule):
    sum = slot(16)

    def __init__(self, settings, at):
        self.joints = [at.of(rod, "joint_positions") for rod in at.layout.of("rod")]
        self.ball = at.of(at.layout["ball"], "position")
        self.index, self.robots = at.layout["ball"].index, list(at.spec.robots)

    def apply(self, view):
        APPLY
"""
GOOD: Final = "view.read(self.joints)[0] + view.read(self.kept)[0]"
BESIDE: Final = "beside a robot that does nothing and comes first the world is another one"
SETS: Final = ("engine=pure", "substeps=1", "players={}", "table.rules.kickoff_delay=20 ms")
TETRAHEDRON: Final = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
OF_ROD: Final = "robots.red.goal.sensors.own={kind: 'own_form:Own', rate: 100 Hz}"
OF_WORLD: Final = "rules={own: {kind: 'own_form:Own'}}"


@pytest.fixture
def planted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder on the path, and on that of further processes."""
    loader._kept.clear()
    sys.modules.pop("own_form", None)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    return tmp_path


def broken(planted: Path, source: str, sets: str, *, processes: bool = False, ticks: int = TICKS) -> list[str]:
    (planted / "own_form.py").write_text(HEAD + source)
    sys.modules.pop("own_form", None)
    loader._kept.clear()  # deployments of the module before have its classes
    invalidate_caches()
    text = apply_sets(TABLE.read_text(), TABLE.name, [*SETS, sets])
    check = ComponentCheck(text, TABLE.name, ticks)
    return [*check.broken(), *(elsewhere(text, TABLE.name, ticks, check.first) if processes else ())]


def test_what_obeys_passes_also_in_another_process_whatever_it_prints(planted: Path) -> None:
    assert broken(planted, 'print("said at import")\n' + SENSOR.format(value=GOOD), OF_ROD, processes=True) == []


MOVED: Final = r"on one node, with robots moved and objects made anew, the world is another one: tick \d+, "
ORDER: Final = "sum(10.0 ** (ord(name[-1]) % 17) / 3.0 * (-1) ** len(name) for name in self.robots)"
BAD: Final = {
    "memory in an object": ("float(self.count)", f"{MOVED}red.goal own.kept"),
    "a running generator": ("self.random.random()", f"{MOVED}red.goal own.kept"),
    "a clock": ("time.perf_counter()", f"{MOVED}red.goal own.kept"),
    "a draw by the place among others": (
        "draw_words(draw_key(1, str(self.at.robot.index)), view.tick)[0] / 2.0 ** 32",
        f"{BESIDE}: tick 1, red.goal own.kept",
    ),
    "a reading by the place among others, of which nothing is in the frame": (
        "float(self.at.robot.index)",
        f"{BESIDE}: tick 5, the reading of own of red.goal",
    ),
    "a count of its like": (
        "float(len([slot for slot in self.at.robot.offsets if slot.endswith('.samples')]))",
        "beside a second one of each sensor the world is another one: .*red.goal own.kept",
    ),
    "a sum in the order of the file": (
        RULE.replace("APPLY", f"view.write(self.sum, *[{ORDER}] * 16)"),
        "named in another order, the world is another one: .*world own.sum",
    ),
}
"""The value of a sensor, or a rule, and the first finding."""


@pytest.mark.parametrize("what", BAD)
def test_what_breaks_a_law_is_found_and_named(planted: Path, what: str) -> None:
    value, finding = BAD[what]
    source, sets = (value, OF_WORLD) if "class" in value else (SENSOR.format(value=value), OF_ROD)
    if "nothing is in the frame" in what:
        source = source.replace("view.write(self.kept", "(self.kept")
    found = broken(planted, source, sets)
    assert any(re.match(finding, line) for line in found), found


def test_a_sum_in_the_order_of_hashes_is_found_by_another_process(planted: Path) -> None:
    """Two orders of one set give the same sum once in ten times; of 16 sets, never."""
    one = "sum((-1.1) ** (int(name) % 301) for name in {f'{k}' for k in range(400 + n)})"
    apply = f"view.write(self.sum, *({one} for n in range(16)))"
    found = broken(planted, RULE.replace("APPLY", apply), OF_WORLD, processes=True, ticks=20)
    assert found == ["another process computes another world"]


def test_an_entity_that_is_kept_as_a_number_is_found_beside_one_more(planted: Path) -> None:
    """A slot that refers to entities is compared by names."""
    found = broken(planted, RULE.replace("APPLY", "view.write(self.sum, *[float(self.index)] * 16)"), OF_WORLD)
    (line,) = found
    assert line.startswith(BESIDE) and line.endswith("world own.sum")
    declared = RULE.replace("slot(16)", "slot(ENTITY)")
    assert broken(planted, declared.replace("APPLY", "view.write(self.sum, float(self.index))"), OF_WORLD) == []


def test_a_write_to_anothers_slot_is_refused_with_both_names(planted: Path) -> None:
    with pytest.raises(
        DeploymentError, match=r"rule own of the world failed.* ball position, neither its own slot nor"
    ):
        broken(planted, RULE.replace("APPLY", "view.write(self.ball, 0.0, 0.0, 1.0)"), OF_WORLD)


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


def test_an_actuator_that_asks_for_something_else_beside_its_like_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """Three robots, which a run asks one after the other."""
    right = MotionSetPoints.command

    def wrong(self: MotionSetPoints, view: View) -> NDArray[Any]:
        asked = right(self, view)
        asked[-1, 0, 0] += 1e-9 * len(asked)
        return asked

    robots = {f"r{n}": {"model": "differential_drive", "at": {"x": f"{n} m"}} for n in range(3)}
    text = yard_text(robots)
    assert list(broken_laws(text, "yard.yaml", 3)) == []
    monkeypatch.setattr(MotionSetPoints, "command", wrong)
    (found,) = broken_laws(text, "yard.yaml", 3)
    assert found == "actuator motion of r0 has other set-points alone than with others, at tick 1"
    monkeypatch.setattr(MotionSetPoints, "command", lambda self, view: right(self, view)[1:])
    (found,) = broken_laws(text, "yard.yaml", 3)
    assert "actuators motion of r0, motion of r1, motion of r2" in found and "of the shape (3, motors, 2)" in found


def test_a_form_is_named_as_deployments_do() -> None:
    text = TABLE.read_text()
    assert used_component_type(text, TABLE.name, "encoder").type_name == "sensor"
    assert used_component_type(text, TABLE.name, "rule football").name == "football"
    assert used_component_type(text, TABLE.name, "foosim.library.table.rod:Rod").type_name == "model"
    assert used_component_type(text, TABLE.name, "model foosim.library.table.rod:Rod").type_name == "model"


WRONG: Final = {
    "encodr": "table.yaml uses no component called this (there are: ball, camera, delay, encoder, football, "
    "gaussian_noise, rod, rod_position, table), 'encodr', nearest is 'encoder'",
    "sensor encodr": "'sensor encodr', nearest is 'sensor encoder'",
    "rule encoder": "'rule encoder', nearest is 'sensor encoder'",
    "foosim.library.table.rod:Rot": "nearest is 'foosim.library.table.rod:Rod'",
    "own_gone:Own": "no module own_gone (it is not on PYTHONPATH), 'own_gone:Own'",
}


@pytest.mark.parametrize("wanted", WRONG)
def test_a_wrong_name_says_what_there_is_and_the_nearest(wanted: str) -> None:
    text = apply_sets(TABLE.read_text(), TABLE.name, ["engine=pure"])
    with pytest.raises(BadValue) as error:
        used_component_type(text, TABLE.name, wanted)
    assert WRONG[wanted] in str(error.value) and error.value.exit_code == 2


def test_a_name_of_several_forms_says_which(planted: Path) -> None:
    (planted / "own_form.py").write_text(
        HEAD + SENSOR.format(value=GOOD) + "\n\nFirst = Own\n" + RULE.replace("APPLY", "pass")
    )
    text = apply_sets(TABLE.read_text(), TABLE.name, [OF_ROD.replace(":Own", ":First"), OF_WORLD])
    with pytest.raises(BadValue, match=r"several components of table\.yaml are called this: rule own or sensor own"):
        used_component_type(text, TABLE.name, "own")
    assert used_component_type(text, TABLE.name, "rule own").type_name == "rule"


def test_a_class_is_the_one_that_its_path_leads_to(planted: Path) -> None:
    """Wherever it was imported from, in the deployment and in the question."""
    (planted / "mine.py").write_text("from foosim.library.table.encoder import Encoder as Mine\n")
    text = apply_sets(TABLE.read_text(), TABLE.name, ["robots.red.goal.sensors.encoder.kind=mine:Mine"])
    assert used_component_type(text, TABLE.name, "mine:Mine").name == "encoder"
    assert used_component_type(TABLE.read_text(), TABLE.name, "sensor mine:Mine").name == "encoder"


ALARMS: Final = """

@sensor("own", Settings, Number, trigger="TRIGGER")
class Own(Sensor):
    alarm = slot()

    def sample(self, view):
        view.write(self.alarm, float(view.tick % 10 == 0))
        return Number(0.0)


class Alarming(EntityRuleSettings):
    pass


@rule("own", Alarming)
class Alarms(EntityRule):
    alarm = slot()

    def apply(self, view):
        view.write(self.alarm, float(view.tick % 7 == 0))
"""
HEARD: Final = {
    "alarm": [*range(0, 31, 5), 1, 11, 21],
    "beeps.alarm": [*range(0, 31, 5), 1, 8, 15, 22, 29],
}


@pytest.mark.parametrize("trigger", HEARD)
def test_the_trigger_of_a_sensor_is_a_slot_of_its_own_or_of_a_rule(planted: Path, trigger: str) -> None:
    """Its own slot is set for the tick after the one at which it measures, a rule's for the tick after it applied."""
    head = HEAD.replace("import RuleSettings", "import EntityRuleSettings, RuleSettings")
    (planted / "own_form.py").write_text(head + ALARMS.replace("TRIGGER", trigger))
    rules = "robots.red.goal.rules={beeps: {kind: 'own_form:Alarms'}}"
    frames = Frames()
    done = rehearse(TABLE.read_text(), TABLE.name, 31, 2, [*SETS, OF_ROD, rules], Settings(on_commit=frames))
    assert not done.json["failed"]
    measured = [frame.at("red.goal", "own.samples") for frame in frames.frames]
    ticks = [tick for tick, (before, now) in enumerate(zip([0.0, *measured], measured, strict=False)) if now > before]
    assert ticks == sorted(set(HEARD[trigger]))


def test_a_slot_that_nobody_has_is_refused_with_what_may_be_named(planted: Path) -> None:
    (planted / "own_form.py").write_text(
        HEAD.replace("import RuleSettings", "import EntityRuleSettings, RuleSettings")
        + ALARMS.replace("TRIGGER", "beeps.alarm")
    )
    with pytest.raises(
        DeploymentError, match=r"whose trigger is beeps\.alarm, which red\.goal does not have: it is a slot of"
    ):
        load_deployment(apply_sets(TABLE.read_text(), TABLE.name, [*SETS, OF_ROD, "seed=5"]), TABLE.name)


# --- the command -----------------------------------------------------------------------------------------------------

COMMAND: Final = "from foosim.cli import main; main()"


@pytest.fixture
def command(typed: Typed, planted: Path) -> Command:
    """Runs `foosim`."""
    return typed()


def checking(*sets: str, ticks: int = 60) -> list[str]:
    words = [word for setting in (*SETS, *sets) for word in ("--set", setting)]
    return [
        "check-component",
        "own",
        "--in",
        str(TABLE),
        *words,
        "--ticks",
        str(ticks),
    ]


NEVER: Final = ["sensor own of red.goal has a non-finite number in each of its 8 readings"]


@pytest.mark.parametrize(("value", "said"), [("float('inf')", NEVER), ("1.0 if view.tick else float('inf')", [])])
def test_a_sensor_without_one_finite_reading_is_found(planted: Path, value: str, said: list[str]) -> None:
    """One that has none at times is as it should be."""
    source = SENSOR.format(value=value).replace("view.write(self.kept", "(self.kept")
    assert broken(planted, source, OF_ROD) == said


def test_readings_that_were_not_finite_or_none_are_noted(planted: Path) -> None:
    """They may be meant, so that nothing is broken; a sensor that gives none was not compared."""
    source = SENSOR.format(value="1.0 if view.tick % 10 else float('inf')").replace(
        "view.write(self.kept", "(self.kept"
    )
    (planted / "own_form.py").write_text(HEAD + source)
    drops = "robots.red.attack.sensors.encoder.modifiers=[{kind: drop_out, probability: 100 %}]"
    check = ComponentCheck(apply_sets(TABLE.read_text(), TABLE.name, [*SETS, OF_ROD, drops]), TABLE.name, 40)
    assert list(check.broken()) == [] and check.compared == check.sensors - 1
    assert check.notes == [
        "sensor encoder of red.attack never gives a reading: its modifiers drop each of 8",
        "sensor own of red.goal has a non-finite number in 4 of its 8 readings",
    ]


def test_the_end_says_how_many_sensors_were_compared(planted: Path, command: Command) -> None:
    """One at 1 Hz measures once in a second, and not at tick 0 where it has an offset."""
    (planted / "own_form.py").write_text(HEAD + SENSOR.format(value=GOOD))
    rare = OF_ROD.replace("100 Hz", "1 Hz, offset: 500 ms")
    done = command(*checking(rare))
    assert (done.code, done.err) == (0, "")
    there = sum(len(robot.sensors) for robot in load_deployment(TABLE.read_text(), TABLE.name).robots.values())
    *_, last = done.out.splitlines()
    assert last == f"{there} of {there + 1} sensors of {TABLE} measured, and were compared alone and with others"


FAILS_ELSEWHERE: Final = """
import os, sys
print("said at import")
if os.environ.get("PYTHONHASHSEED") == "4711":
    for number in range(30):
        print(f"line {number} of what it says, none of which is cut in the middle", file=sys.stderr)
    sys.exit("that was it")
"""


def test_the_last_words_of_another_process_are_whole_lines(planted: Path) -> None:
    found = broken(planted, FAILS_ELSEWHERE + SENSOR.format(value=GOOD), OF_ROD, processes=True, ticks=20)
    (line,) = found
    first, *said = line.splitlines()
    assert first.startswith("in another process it fails, with exit code ") and len(said) == 10
    assert said[0].strip() == "line 21 of what it says, none of which is cut in the middle"
    assert "that was it" in said[-1] or "SystemExit" in said[-1]


def test_a_terminal_shows_where_it_is_and_an_interrupt_says_so(planted: Path) -> None:
    (planted / "own_form.py").write_text(HEAD + SENSOR.format(value=GOOD))
    ours, theirs = pty.openpty()
    with subprocess.Popen(
        [sys.executable, "-P", "-c", COMMAND, *checking(OF_ROD, ticks=1_000_000)],
        stdout=subprocess.PIPE,
        stderr=theirs,
        text=True,
    ) as process:
        os.close(theirs)
        with os.fdopen(ours, "rb", buffering=0) as terminal:
            shown = b""
            while b"rehearsal 1 of 10: on one node\r\n" not in shown:
                shown += terminal.read(4096)
            process.send_signal(signal.SIGINT)
            with suppress(OSError):  # the other end is closed
                while more := terminal.read(4096):
                    shown += more
        assert process.wait() == 130
    first = "rehearsal 1 of 10: on one node"
    assert shown.decode().splitlines() == [first, f"sensor own: interrupted, {first}"]


def test_files_beside_the_deployment_are_found_from_any_folder(planted: Path, command: Command) -> None:
    """Meshes are relative to the folder of the deployment."""
    folder = planted / "elsewhere"
    folder.mkdir()
    (folder / "thing.obj").write_text(TETRAHEDRON)
    thing = {"shape": "mesh", "file": "thing.obj", "x": "3 m", "z": "1 m", "radio": "wood"}
    base = {"model": "holonomic", "sensors": {"where": {"kind": "pose", "rate": "10 Hz"}}}
    (folder / "yard.yaml").write_text(yard_text({"base": base}, engine="mujoco", scenery={"thing": thing}))
    done = command("check-component", "pose", "--in", folder / "yard.yaml", "--ticks", "20")
    assert done.code == 0, done
