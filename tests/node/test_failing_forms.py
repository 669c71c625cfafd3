"""Whatever a form does at any tick ends the run by an error with its name, its entity, the tick and its line."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from importlib import import_module, invalidate_caches
from pathlib import Path
from typing import Any, Final

import msgspec
import numpy as np
import pytest

from foosim.common.errors import DeploymentError
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.node.physics.making import make_engine
from foosim.node.tick import Stepper, Work
from foosim.simulation.check.component_check import ComponentCheck
from foosim.simulation.run import rehearse
from foosim.simulation.system import Settings
from foosim.world.assembly.world import initial_numbers
from foosim.world.components.view import ComponentError
from foosim.world.frame import Frame
from foosim.world.layout import build_layout
from foosim.world.robot_packets import Delivered
from tests.conftest import Typed
from tests.own_forms import folder_on_path

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
TICK: Final = 25
FORMS: Final = """
import sys
import numpy as np
from msgspec import Struct
from foosim.library.table.rod_position import Command, RodPositionSettings, PositionActuator
from foosim.world.forms.quantities import Metres
from foosim.world.components.base import EntityRule, Modifier, Rule, Sensor
from foosim.world.forms.registry import actuator, modifier, rule, sensor
from foosim.world.forms.settings import EntityRuleSettings, ModifierSettings, RuleSettings, SensorSettings

acts = {}


def act(name, view, good):
    return acts[name](view) if name in acts and view.tick >= 25 else good


class Reading(Struct, frozen=True):
    x: Metres


class Words(Struct, frozen=True):
    text: str
    x: float


class Pair(Struct, frozen=True):
    x: Metres
    y: Metres


@sensor("misdeed", SensorSettings, Reading)
class Own(Sensor):
    def __init__(self, settings, at):
        pass

    def sample(self, view):
        return act("sensor", view, Reading(1.0))


@sensor("misdeed_says", SensorSettings, Words)
class Says(Sensor):
    def __init__(self, settings, at):
        pass

    def sample(self, view):
        return act("words", view, Words("so", 1.0))


@sensor("misdeed_batched", SensorSettings, Pair)
class Batched(Sensor):
    def __init__(self, settings, at):
        pass

    def sample(self, view):
        return Pair(1.0, 2.0)

    @staticmethod
    def together(sensors):
        return Batch()


class Batch:
    def sample(self, view):
        return act("batch", view, np.array([[1.0, 2.0]] * 2))


@modifier("misdeed_bends", ModifierSettings)
class Bends(Modifier):
    def __init__(self, settings, at):
        pass

    def apply(self, values, view):
        return act("modifier", view, values)


@actuator("misdeed_drive", RodPositionSettings, Command, slots={"set_point": 2}, kit="table")
class Drive(PositionActuator):
    def accept(self, command, view):
        return act("accept", view, True)

    def command(self, view):
        return act("command", view, ((0.0, 1.0), (0.0, 1.0)))


@rule("misdeed_rules", RuleSettings)
class Rules(Rule):
    def __init__(self, settings, at):
        pass

    def apply(self, view):
        act("rule", view, None)


@rule("misdeed_wears", EntityRuleSettings)
class Wears(EntityRule):
    def __init__(self, settings, at):
        pass

    def apply(self, view):
        act("wears", view, None)
"""
KIND: Final = "kind: 'misdeeds:{}', rate: 500 Hz"
SETS: Final = (
    "engine=pure",
    "players={}",
    f"robots.red.goal.sensors.own={{{KIND.format('Own')}, modifiers: [{{kind: 'misdeeds:Bends'}}]}}",
    f"robots.red.goal.sensors.plain={{{KIND.format('Own')}}}",
    f"robots.red.goal.sensors.says={{{KIND.format('Says')}}}",
    f"robots.red.goal.sensors.pair={{{KIND.format('Batched')}}}",
    f"robots.red.attack.sensors.pair={{{KIND.format('Batched')}}}",
    "robots.red.goal.actuators={motors: {kind: 'misdeeds:Drive', modifiers: [{kind: 'misdeeds:Bends'}]}}",
    "robots.red.goal.rules={wears: {kind: 'misdeeds:Wears'}}",
    "rules={rules: {kind: 'misdeeds:Rules'}}",
)


class World:
    """The table with forms that misbehave on demand, a tick of it as a node computes it."""

    def __init__(self, module: Any) -> None:
        self.module = module
        self.text = apply_sets(TABLE.read_text(), TABLE.name, SETS)
        self.deployment = load_deployment(self.text, TABLE.name)
        self.layout = build_layout(self.deployment)
        self.engine = make_engine(self.deployment, self.layout)

    def tick(self, tick: int = TICK, *, is_guarded: bool = False) -> Stepper:
        stepper = Stepper(self.deployment, self.layout, is_guarded=is_guarded)
        frame = Frame(tick, self.layout, np.array(initial_numbers(self.deployment, self.layout)))
        stepper.sense(frame, self.layout.robots)
        layout = self.layout
        numbers, _ = stepper.edited(frame, [], {})
        solved = tuple(entity.index for entity in layout.entities if entity.is_solved)
        bodies = tuple(layout.entities[index] for index in solved)
        packet = Delivered(0, "hand", 0, 0, "red.goal", "motors", np.array([0.01, 0.5]).tobytes())
        stepper.deliver([packet], solved, numbers, tick)
        stepper.solve(self.engine, Work(tick, layout, (bodies,), solved, numbers, {}))
        return stepper


@pytest.fixture(scope="module")
def planted(tmp_path_factory: pytest.TempPathFactory) -> Iterator[World]:
    folder = tmp_path_factory.mktemp("misdeeds")
    (folder / "misdeeds.py").write_text(FORMS)
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(folder))
        patch.setenv("PYTHONPATH", str(folder))
        invalidate_caches()
        yield World(import_module("misdeeds"))
    sys.modules.pop("misdeeds")


@pytest.fixture
def world(planted: World) -> Iterator[World]:
    yield planted
    planted.module.acts.clear()


def leave(view: Any) -> None:
    sys.exit(0)


def fails(view: Any) -> None:
    raise ValueError("no more")


Act = Callable[[Any], Any]


def gives(value: Any) -> Act:
    return lambda view: value


OWN: Final = "sensor own of red.goal"
BENT: Final = "modifier misdeed_bends of own of red.goal"
MOTORS: Final = "actuator motors of red.goal"
SAMPLE: Final = "sample() returned {}; expected a Reading (misdeeds.py:"
MISDEEDS: Final[dict[str, tuple[str, Act, str]]] = {
    "a sensor that raises": ("sensor", fails, f"{OWN} failed at tick 25: ValueError: no more ("),
    "a sensor that leaves": ("sensor", leave, f"{OWN} failed at tick 25: SystemExit: 0 ("),
    "a sensor without a reading": ("sensor", gives(None), f"{OWN} failed at tick 25: {SAMPLE.format(None)}"),
    "a sensor with a number": ("sensor", gives(3.0), f"{OWN} failed at tick 25: {SAMPLE.format(3.0)}"),
    "another type in words": ("words", gives(3.0), "sensor says of red.goal failed at tick 25: sample() returned 3.0"),
    "an array of another shape": (
        "batch",
        gives(np.zeros((2, 1))),
        "sensor pair of red.attack, pair of red.goal failed at tick 25: sample() returned array([[0.],",
    ),
    "a list in place of an array": (
        "batch",
        gives([[1.0, 2.0]] * 2),
        "pair of red.goal failed at tick 25: sample() returned [[1.0, 2.0], [1.0, 2.0]]; expected an array "
        "of float64 of the shape (2, 2) (misdeeds.py:",
    ),
    "a modifier that gives a number": (
        "modifier",
        gives(3.0),
        f"{BENT} failed at tick 25: apply() returned 3.0; expected a ",
    ),
    "a modifier that gives texts": (
        "modifier",
        gives(["x"]),
        f"{BENT} failed at tick 25: apply() returned ['x']; expected a ",
    ),
    "a modifier that gives too few": (
        "modifier",
        gives([]),
        f"{BENT} failed at tick 25: apply() returned []; expected a list of 1 numbers, or None (misdeeds.py:",
    ),
    "a modifier that leaves": ("modifier", leave, f"{BENT} failed at tick 25: SystemExit: 0 ("),
    "a command neither taken nor refused": (
        "accept",
        gives(None),
        f"{MOTORS} failed at tick 25: accept() returned None; expected True or False (misdeeds.py:",
    ),
    "an actuator that leaves": ("accept", leave, f"{MOTORS} failed at tick 25: SystemExit: 0 ("),
    "motors of texts": (
        "command",
        gives((("x", 1.0), (0.0, 1.0))),
        f"{MOTORS} failed at tick 25: command() returned (('x', 1.0), (0.0, 1.0)); expected a tuple of "
        "(target, greatest force) for 2 motors (misdeeds.py:",
    ),
    "one motor of two": (
        "command",
        gives(((0.0, 1.0),)),
        f"{MOTORS} failed at tick 25: command() returned ((0.0, 1.0),)",
    ),
    "no motors": ("command", gives(None), f"{MOTORS} failed at tick 25: command() returned None; expected a tuple of "),
    "a rule that leaves": ("rule", leave, "rule rules of the world failed at tick 25: SystemExit: 0 ("),
    "a rule of a robot that leaves": ("wears", leave, "rule wears of red.goal failed at tick 25: SystemExit: 0 ("),
    "a write to the array of a frame": (
        "sensor",
        lambda view: view.values.__setitem__(0, 0.3),
        f"{OWN} failed at tick 25: ValueError: assignment destination is read-only (",
    ),
}
MISDEEDS["a text in a number"] = (
    "sensor",
    lambda view: import_module("misdeeds").Reading("x"),
    f"{OWN} failed at tick 25: sample() returned Reading(x='x'); expected a reading of 1 numbers (misdeeds.py:",
)
MISDEEDS["a text in a number of words"] = (
    "words",
    lambda view: import_module("misdeeds").Words("so", "x"),
    "says of red.goal failed at tick 25: sample() returned Words(text='so', x='x'); expected misdeed_says: "
    "Expected `float`, got `str` - at `$.x` (misdeeds.py:",
)


@pytest.mark.parametrize("what", MISDEEDS)
def test_a_misdeed_is_an_error_with_its_place(world: World, what: str) -> None:
    name, misdeed, said = MISDEEDS[what]
    world.module.acts[name] = misdeed
    world.tick(TICK - 1)
    with pytest.raises(ComponentError) as error:
        world.tick()
    assert said in str(error.value)


def test_an_interrupt_is_none(world: World) -> None:
    def interrupted(view: Any) -> None:
        raise KeyboardInterrupt

    for name in ("sensor", "modifier", "batch", "accept", "command", "rule", "wears"):
        world.module.acts[name] = interrupted
        with pytest.raises(KeyboardInterrupt):
            world.tick()
        del world.module.acts[name]


def test_a_number_of_words_that_is_not_finite_is_counted_and_not_sent(world: World) -> None:
    world.module.acts["words"] = lambda view: msgspec.structs.replace(world.module.Words("so", 1.0), x=float("inf"))
    assert world.tick().not_finite == {"red.goal says": 1}


# --- numbers of the frame --------------------------------------------------------------------------------------------


def overwrites(place: int) -> Act:
    def act(view: Any) -> Any:
        view.numbers[place] = 0.125
        return view.read  # of the wrong type, which nobody comes to see

    return act


DIRECT: Final = {
    "sensor": f"{OWN} failed at tick 25: TypeError: numbers of a frame are written by view.write alone (",
    "batch": "sensor pair of red.attack, pair of red.goal failed at tick 25: TypeError: numbers of a frame are ",
    "modifier": f"{BENT} failed at tick 25: TypeError: numbers of a frame are written by view.write alone (",
    "accept": f"{MOTORS} failed at tick 25: TypeError: numbers of a frame are written by view.write alone (",
    "command": f"{MOTORS} failed at tick 25: TypeError: numbers of a frame are written by view.write alone (",
    "rule": "rule rules of the world failed at tick 25: TypeError: numbers of a frame are written by view.write alo",
    "wears": "rule wears of red.goal failed at tick 25: TypeError: numbers of a frame are written by view.write al",
}


@pytest.mark.parametrize("name", DIRECT)
def test_a_direct_write_to_the_frame_is_found_where_forms_are_watched(world: World, name: str) -> None:
    world.module.acts[name] = overwrites(world.layout["blue.attack"].offsets["joint_positions"])
    with pytest.raises(ComponentError) as error:
        world.tick(is_guarded=True)
    assert DIRECT[name] in str(error.value)


def test_forms_that_are_watched_may_write_what_is_theirs(world: World) -> None:
    world.tick(is_guarded=True)


@pytest.mark.parametrize("name", ["sensor", "rule"])
def test_a_direct_write_is_named_by_the_check_of_components(world: World, name: str) -> None:
    """At its tick, in whatever the frame has there."""
    world.module.acts[name] = overwrites(world.layout["blue.attack"].offsets["joint_positions"])
    check = ComponentCheck(world.text, TABLE.name, 40)
    (line,) = check.broken()
    assert DIRECT[name].split(":")[0] in line and check.has_failed


# --- a run -----------------------------------------------------------------------------------------------------------


def test_a_form_that_leaves_ends_a_rehearsal_in_order(world: World) -> None:
    world.module.acts["sensor"] = leave
    done = rehearse(world.text, TABLE.name, 40, 2).json
    assert done["failed"] and f"{OWN} failed at tick 25: SystemExit: 0 (" in done["reason"] and done["ticks"] <= TICK


def test_the_result_and_the_supervisors_log_have_form_and_traceback(world: World) -> None:
    world.module.acts["sensor"] = fails
    logged: list[str] = []
    settings = Settings(on_log=lambda process, level, text: logged.append(text) if process == "supervisor" else None)
    done = rehearse(world.text, TABLE.name, 40, 2, settings=settings).json
    form = done["failed_form"]
    assert (form["entity"], form["component"], form["tick"]) == ("red.goal", "sensor own", TICK)
    assert form["traceback"].startswith("Traceback") and form["traceback"].endswith("ValueError: no more\n")
    assert any(form["traceback"] in text for text in logged)


def test_a_run_without_such_a_form_has_none(world: World) -> None:
    assert rehearse(world.text, TABLE.name, 5, 1).json["failed_form"] is None


COMMANDS: Final = ("check", "components check", "rehearse")


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("tick", [0, TICK])
def test_no_command_is_done_where_a_form_leaves(
    tmp_path: Path, typed: Typed, monkeypatch: pytest.MonkeyPatch, command: str, tick: int
) -> None:
    """`sys.exit(0)` in a sensor: at the trial of a deployment, and in a run."""
    if (command, tick) == ("check", TICK):
        return  # it computes one tick
    source = f"{FORMS}\nacts['sensor'] = lambda view: sys.exit(0)\n".replace("view.tick >= 25", f"view.tick >= {tick}")
    (tmp_path / "leavers.py").write_text(source.replace("misdeed", "leaver"))
    sets = [
        "engine=pure",
        "players={}",
        f"robots.red.goal.sensors.own={{{KIND.format('Own')}}}".replace("misdeeds", "leavers"),
    ]
    options = [word for one in sets for word in ("--set", one)]
    words = {
        "check": [str(TABLE)],
        "components check": ["leaver", "--in", str(TABLE), "--ticks", "40"],
        "rehearse": [str(TABLE), "--for", "80ms"],
    }[command]
    folder_on_path(tmp_path, monkeypatch)
    done = typed(*command.split())(*words, *options)
    assert done.code == (1 if tick else 2), done
    assert f"{OWN} failed at tick {tick or 1}: SystemExit: 0 (leavers.py:" in done.out + done.err


def test_a_deployment_with_a_text_in_a_number_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """And not said to be not finite."""
    source = FORMS.replace("Reading(1.0))", "Reading('x'))").replace('"misdeed"', '"misdeed_texts"')
    (tmp_path / "says_texts.py").write_text(source.partition('@sensor("misdeed_says"')[0])
    monkeypatch.syspath_prepend(str(tmp_path))
    own = f"robots.red.goal.sensors.own={{{KIND.format('Own')}}}".replace("misdeeds", "says_texts")
    with pytest.raises(
        DeploymentError, match=r"sensor own of red\.goal failed at tick 1: sample\(\) returned Reading\(x='x'\)"
    ):
        load_deployment(apply_sets(TABLE.read_text(), TABLE.name, ["engine=pure", own]), TABLE.name)
