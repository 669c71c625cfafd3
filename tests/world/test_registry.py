"""Components of one's own: how a deployment's words find a class, what hurts nobody else, and a run that has them."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from math import nan
from pathlib import Path
from typing import Any, Final

import pytest
from jsonschema import Draft202012Validator

from foosim.capture.export import export_capture
from foosim.capture.info import capture_info
from foosim.capture.reader import open_capture
from foosim.common.errors import BadValue, DeploymentError, Refused, UnknownName
from foosim.deployment.json_schema import deployment_schema
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.deployment.text.yaml import locate_in, plain, read_tree
from foosim.simulation.run import Rehearsed, rehearse
from foosim.simulation.system import Settings
from foosim.world.component_types.per_field import codec_of
from foosim.world.component_types.registry import TYPE_NAMES, find, find_component, names
from foosim.world.frame import Frame
from tests.deployed import TABLE, TEXT, deployed
from tests.own_components import fresh, install, problems

GAUGES: Final = '''
from typing import Annotated

from msgspec import Struct
from pydantic import Field

from foosim.common.spec_base import LengthNoise
from foosim.world.component_types.settings import SensorSettings
from foosim.world.component_types.quantities import Metres
from foosim.world.components.base import Sensor
from foosim.world.component_types.registry import sensor


class ReachSettings(SensorSettings):
    """How far a rod is out."""

    scale: Annotated[float, Field(ge=0, le=10)]
    grain: LengthNoise = Field(default="0 m", validate_default=True)


class Reach(Struct, frozen=True):
    """How far a rod is out, and when that was, in numbers and in words."""

    slide: Metres
    tick: float
    text: str
    ticks: list[int]


@sensor("reach", ReachSettings, Reach, needs=("joint_positions",))
class ReachGauge(Sensor):
    """The slide of a rod, scaled."""

    def __init__(self, settings, at):
        self._joints, self._scale, self._name = at.slot("joint_positions"), settings.scale, at.robot.name

    def sample(self, view):
        slide = self._scale * view.read(self._joints)[0]
        return Reach(slide, float(view.tick), f"{self._name} at {view.tick} \u2713", [view.tick, -1])


class Idle:
    """Nobody registers it."""
'''
WINCH: Final = '''
from typing import Annotated

from msgspec import Meta, Struct
from pydantic import Field

from foosim.world.component_types.settings import ActuatorSettings
from foosim.world.components.base import Actuator, need, slot
from foosim.world.component_types.registry import actuator


class WinchSettings(ActuatorSettings):
    """Turns a rod as fast as it is told."""

    most: Annotated[float, Field(gt=0)] = 40.0


class Turn(Struct, frozen=True):
    """How fast."""

    rate: Annotated[float, Meta(extra={"unit": "rad/s"})]


@actuator("winch", WinchSettings, Turn)
class Winch(Actuator):
    """A rod's spin by its speed; it counts the commands that it took."""

    _rate, _taken = slot(), slot()
    _joints = need("joint_positions")

    def __init__(self, settings, at):
        self._most = settings.most

    def limits(self):
        return {"rate": (-self._most, self._most)}

    def accept(self, command, view):
        if abs(command.rate) > self._most:
            return False
        view.write(self._rate, command.rate)
        view.write(self._taken, view.read(self._taken)[0] + 1.0)
        return True

    def hold(self, view):
        view.write(self._rate, 0.0)

    def excite(self, view):
        view.write(self._rate, 1.0)

    def command(self, view):
        return (0.0, 100.0), (view.read(self._rate)[0], 2.0)
'''
LISTENER: Final = '''
from foosim import Player


class Listener(Player):
    """Keeps what it hears, by robot and channel, and commands what its parameters say."""

    heard = {}

    def __init__(self, deployment, parameters):
        self._commands = parameters.get("commands", {})

    def act(self, tick, samples):
        for pair, sample in samples.items():
            Listener.heard.setdefault(pair, {})[sample.sent_ns] = sample.value
        from own_winch import Turn
        return {robot: Turn(float(rate)) for robot, rate in self._commands.items()}
'''
MODULES: Final = {
    "own_gauges": GAUGES,
    "own_winch": WINCH,
    "own_listener": LISTENER,
    "own_broken": "def begin():\n    return 1 / 0\n\nbegin()\n",
    "own_importer": "import own_missing\n",
    "own_leaver": "import sys\nsys.exit(0)\n",
    "own_unwritten": "import sys\ndef : 1\n",
    "own_package/__init__": "",
    "own_package/broken": "import json\n\nraise RuntimeError('two\\nlines')\n",
}


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder on the path with modules of somebody's own."""
    for type_name in TYPE_NAMES:
        names(type_name)
    folder = tmp_path / "site"
    folder.mkdir()
    (folder / "own_package").mkdir()
    for name, source in MODULES.items():
        (folder / f"{name}.py").write_text(source)
    monkeypatch.syspath_prepend(str(folder))
    return folder


BEGIN: Final = """
import json, sys
from foosim.common.errors import Refused
from foosim.world.component_types.registry import find, names

def said(type_name, kind):
    try:
        return find(type_name, kind).module
    except Refused as error:
        return f"{type(error).__name__}: {error}"

"""


def printed(code: str, folder: Path | None = None) -> Any:
    return fresh(BEGIN + code, folder)


# --- foosim's own ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("type_name", TYPE_NAMES)
def test_each_is_in_a_module_of_its_name_and_has_a_summary(type_name: str) -> None:
    for name in names(type_name):
        component = find(type_name, name)
        assert (component.type_name, component.name, component.module.rpartition(".")[2]) == (type_name, name, name)
        assert component.summary.endswith(".")
        assert find(type_name, f"{component.module}:{component.factory.__qualname__}") is component


def test_finding_one_imports_its_module_only() -> None:
    """A node of a table does not import what rovers have."""
    code = """
found = find("sensor", "encoder").module
modules = [name for name in sys.modules if name.count(".") == 3 and name.startswith("foosim.library.")]
print(json.dumps([found, modules, "numpy" in sys.modules]))
"""
    assert printed(code) == ["foosim.library.table.encoder", ["foosim.library.table.encoder"], False]


@pytest.mark.parametrize(
    ("type_name", "kind", "nearest"),
    [
        ("sensor", "encodr", ", nearest is 'encoder'"),
        ("sensor", "Pose", ", nearest is 'pose'"),
        ("sensor", "joint_position", ", nearest is 'joint_state'"),
        ("sensor", "", ""),
        ("sensor", "..", ""),
        ("sensor", "pose.PoseTracker", ""),
        ("sensor", "__init__", ""),
        ("actuator", "wheel_speed", ", nearest is 'wheel_speeds'"),
    ],
)
def test_an_unknown_name_is_refused_with_the_names_and_the_nearest(type_name: str, kind: str, nearest: str) -> None:
    with pytest.raises(UnknownName) as error:
        find(type_name, kind)
    there = ", ".join(names(type_name))
    assert str(error.value) == f"unknown {type_name} (there are: {there}, or any module:Class), {kind!r}{nearest}"


# --- by module and class ---------------------------------------------------------------------------------------------


@pytest.mark.usefixtures("site")
def test_a_class_of_any_module_is_found_by_its_path() -> None:
    gauge = find("sensor", "own_gauges:ReachGauge")
    assert (gauge.type_name, gauge.name, gauge.module) == ("sensor", "reach", "own_gauges")
    assert gauge.factory is sys.modules["own_gauges"].ReachGauge and gauge.summary == "The slide of a rod, scaled."
    assert find("sensor", "reach") is gauge, "it has its name from then on"
    winch = find_component("actuator", "own_winch:Winch")
    assert winch.slots == {"rate": 1, "taken": 1} and "own_winch" in sys.modules


REFUSED: Final = {
    "own_gauges:Idle": "not registered as a sensor; own_gauges registers ReachGauge",
    "own_gauges:ReachSettings": "not registered as a sensor; own_gauges registers ReachGauge",
    "own_winch:Winch": "not registered as a sensor",
    "json:dumps": "not registered as a sensor",
    "own_gone:Gauge": "there is no module own_gone (it is not on PYTHONPATH)",
    "own_gauges.more:Gauge": "there is no module own_gauges.more (own_gauges is a module, not a package)",
    "own_importer:Gauge": "cannot be imported: ModuleNotFoundError: No module named 'own_missing' (own_importer.py:1)",
    "own_broken:Gauge": "cannot be imported: ZeroDivisionError: division by zero (own_broken.py:2)",
    "own_leaver:Gauge": "cannot be imported: SystemExit: 0 (own_leaver.py:2)",
    "own_unwritten:Gauge": "cannot be imported: SyntaxError: invalid syntax (own_unwritten.py:2)",
    "own_package.broken:Gauge": "cannot be imported: RuntimeError: two lines (own_package/broken.py:3)",
    "own_gauges:": "not of the form module:Class",
    ":ReachGauge": "not of the form module:Class",
    "own_gauges:ReachGauge.made": "not of the form module:Class",
    "own_gauges::ReachGauge": "not of the form module:Class",
    "own gauges:ReachGauge": "not of the form module:Class",
    "./own_gauges:ReachGauge": "not of the form module:Class",
    "own_gauges:ReachGauge\n": "not of the form module:Class",
}


@pytest.mark.usefixtures("site")
@pytest.mark.parametrize("path", REFUSED)
def test_a_path_without_a_component_is_refused_with_the_reason(path: str) -> None:
    try:
        with pytest.raises(BadValue) as error:
            find("sensor", path)
    except SystemExit:
        pytest.fail("a module that leaves takes the process with it")
    assert error.value.problem == REFUSED[path] and error.value.value == path


@pytest.mark.usefixtures("site")
def test_a_missing_class_is_refused_with_the_nearest() -> None:
    with pytest.raises(
        BadValue,
        match=r"there is no ReachGuage in own_gauges .*'own_gauges:ReachGuage', nearest is 'own_gauges:ReachGauge'",
    ):
        find("sensor", "own_gauges:ReachGuage")


# --- two of one name -------------------------------------------------------------------------------------------------


def test_two_modules_that_register_one_name_are_refused_with_both_named(site: Path) -> None:
    (site / "own_second.py").write_text(GAUGES)
    found = find("sensor", "own_gauges:ReachGauge")
    with pytest.raises(Refused) as error:
        find("sensor", "own_second:ReachGauge")
    assert all(word in str(error.value) for word in ("sensor reach", "own_gauges", "own_second"))
    assert find("sensor", "reach") is found, "the first one stays"
    (site / "own_second.py").unlink()


THIEF: Final = GAUGES.replace('"reach"', '"encoder"')
"""A module that takes a name of foosim's."""


@pytest.mark.parametrize("first", ["encoder", "own_thief:ReachGauge"])
def test_a_name_of_foosims_own_is_not_taken_whichever_comes_first(site: Path, first: str) -> None:
    """Which class a name means must not hang on what a process happened to import before."""
    (site / "own_thief.py").write_text(THIEF)
    second = {"encoder": "own_thief:ReachGauge", "own_thief:ReachGauge": "encoder"}[first]
    told = printed(f'print(json.dumps([said("sensor", {first!r}), said("sensor", {second!r})]))', site)
    both = ("own_thief", "foosim.library.table.encoder")
    assert any(all(word in text for word in both) for text in told), told
    assert printed('print(json.dumps(said("sensor", "encoder")))', site) == "foosim.library.table.encoder"


def test_a_package_that_takes_a_name_of_foosim_changes_no_other_component(site: Path) -> None:
    (site / "own_thief.py").write_text(THIEF)
    install(site, "thief", "1.2", "own_thief")
    code = """
told = [said("sensor", kind) for kind in ("encodr", "encoder", "pose")]
print(json.dumps([told, names("sensor")]))
"""
    (unknown, encoder, pose), there = printed(code, site)
    assert (encoder, pose) == ("foosim.library.table.encoder", "foosim.library.generic.pose")
    assert unknown.startswith("UnknownName: unknown sensor") and unknown.endswith("'encodr', nearest is 'encoder'")
    assert all(word in unknown for word in ("own_thief of thief 1.2", "foosim.library.table.encoder"))
    assert set(there) >= {"encoder", "pose"}


@pytest.mark.parametrize("key", ["cls", "self", "_fields_set", "model_config"])
def test_keys_of_any_name_beside_an_unknown_kind_are_no_more_than_that(key: str) -> None:
    with pytest.raises(DeploymentError, match="unknown sensor"):
        apply_sets(TEXT, TABLE.name, [f"robots.red.goal.sensors.own={{kind: nope, {key}: 1}}"])


# --- of installed packages -------------------------------------------------------------------------------------------


def test_a_package_gives_its_components_by_name(site: Path) -> None:
    install(site, "gauges", "1.2", "own_gauges", "own_winch")
    assert "own_gauges" not in sys.modules
    assert find("sensor", "reach").module == "own_gauges"
    assert find("actuator", "winch").module == "own_winch"
    assert {"reach", "encoder"} < set(names("sensor"))
    assert {"winch", "joint_position"} < set(names("actuator"))


def test_a_package_is_not_imported_for_what_is_foosims_own(site: Path) -> None:
    install(site, "gauges", "1.2", "own_gauges")
    code = 'print(json.dumps([said("sensor", "encoder"), "own_gauges" in sys.modules]))'
    assert printed(code, site) == ["foosim.library.table.encoder", False]


def test_the_schema_for_editors_has_what_is_installed(site: Path) -> None:
    before = deployment_schema()
    install(site, "own", "1.2", "own_gauges", "own_winch")
    assert deployment_schema() == before, "the one that is kept has foosim's own"
    reach = "robots.red.goal.sensors.own={kind: reach, rate: 100 Hz"
    winch = "robots.red.goal.actuators={own: {kind: winch"
    own, all_of_them = validator(installed=False), validator(installed=True)
    for setting, is_good in (
        (f"{reach}, scale: 2.0}}", True),
        (f"{reach}, scale: 11.0}}", False),
        (f"{reach}, scale: 2.0, grain: 2}}", False),
        (f"{reach}, scal: 2.0}}", False),
        (f"{winch}, most: 3.0}}}}", True),
        (f"{winch}, most: -3.0}}}}", False),
    ):
        assert is_valid(all_of_them, setting) is is_good, setting
        assert not is_valid(own, setting), setting


def validator(*, installed: bool) -> Draft202012Validator:
    """Of the JSON Schema, which is one."""
    schema = deployment_schema(installed=installed)
    Draft202012Validator.check_schema(schema)
    return Draft202012Validator(schema)


def is_valid(schema: Draft202012Validator, setting: str) -> bool:
    """Whether a JSON Schema takes the table with a setting."""
    data = data_of(TEXT)
    key, _, value = setting.partition("=")
    inner = data
    *path, last = key.replace("red.goal", "red/goal").split(".")
    for step in path:
        inner = inner[step.replace("/", ".")]
    inner[last] = data_of(value)
    return bool(schema.is_valid(data))


def data_of(text: str) -> Any:
    tree, problems = read_tree(text, locate_in("f"))
    assert tree is not None and not problems
    return plain(tree)


# --- a deployment with them ------------------------------------------------------------------------------------------

REACH: Final = "robots.red.goal.sensors.reach={kind: 'own_gauges:ReachGauge', rate: 100 Hz, scale: 2.0}"
WINCH_OF_GOAL: Final = "robots.red.goal.actuators={turn: {kind: 'own_winch:Winch', most: 20.0}}"


def listens(heard: Mapping[str, list[str]], commands: Mapping[str, float] | None = None) -> str:
    about = {
        "class": "own_listener:Listener",
        "rate": "50 Hz",
        "lockstep": True,
        "robots": dict(heard),
        "parameters": {"commands": dict(commands or {})},
    }
    return f"players={json.dumps({'ear': about})}"


def rehearsed(*sets: str, nodes: int = 1, capture: Path | None = None) -> tuple[Rehearsed, dict[int, Frame]]:
    """Return what came of 60 ticks, and all frames of it."""
    frames: dict[int, Frame] = {}

    def keep(frame: Frame) -> None:
        frames[frame.tick] = frame

    sets = ("engine=pure", "network.links=[]", *sets)
    done = rehearse(TEXT, TABLE.name, 60, nodes, sets, Settings(on_commit=keep), capture=capture)
    assert not done.json["failed"], done.json["reason"]
    return done, frames


@pytest.mark.usefixtures("site")
def test_readings_of_a_sensor_of_ones_own_reach_a_player_and_the_capture(tmp_path: Path) -> None:
    hears = listens({"red.goal": ["reach"]}, {"red.goal": 15.0})
    done, frames = rehearsed(REACH, WINCH_OF_GOAL, hears, capture=tmp_path / "run.mcap")
    deployment = deployed(REACH)
    heard = sys.modules["own_listener"].Listener.heard["red.goal", "reach"]
    assert len(heard) >= 5
    for sent_ns, value in heard.items():
        assert type(value) is sys.modules["own_gauges"].Reach
        tick = sent_ns // deployment.tick_ns
        slide = frames[tick].at("red.goal", "joint_positions") if tick else 0.0
        assert value == type(value)(2.0 * slide, float(tick), f"red.goal at {tick} \u2713", [tick, -1])
    assert frames[60].at("red.goal", "reach.samples") == 12.0, "100 Hz of 500"
    export_capture(tmp_path / "run.mcap", "packets", tmp_path / "packets.csv")
    sent = open_capture(tmp_path / "run.mcap").packets
    codec = codec_of(find_component("sensor", "reach"))
    values = [codec.decode(payload) for payload in sent.where(sent.channel == "reach").payload]
    assert len(values) == 12 and [value.tick for value in values] == [float(tick) for tick in range(0, 60, 5)]
    assert '""slide"":' in (tmp_path / "packets.csv").read_text(), "a table has them by name"
    assert rehearsed(REACH, WINCH_OF_GOAL, hears, nodes=3)[0].digests == done.digests, "law 1"


@pytest.mark.usefixtures("site")
@pytest.mark.parametrize("nodes", [1, 3])
def test_a_command_of_ones_own_beyond_its_limits_is_clamped_warned_of_once_and_counted(
    tmp_path: Path, nodes: int
) -> None:
    warned: list[str] = []
    said = Settings(on_log=lambda process, level, text: warned.append(text) if level == "warning" else None)
    sets = ("engine=pure", "network.links=[]", WINCH_OF_GOAL, listens({"red.goal": ["encoder"]}, {"red.goal": 20.5}))
    done = rehearse(TEXT, TABLE.name, 60, nodes, sets, said, capture=tmp_path / "run.mcap")
    commands = done.json["commands"]
    assert not done.json["failed"] and commands["clamped"] > 3 and commands["refused"] == 0
    assert f"commands clamped {commands['clamped']}" in done.json["summary"]
    limit = "rate 20.5 rad/s is above its limit, and is clamped to 20 rad/s"
    (warning,) = [text for text in warned if "clamped" in text]
    assert "red.goal, turn: " in warning and limit in warning and "sent by" in warning
    assert capture_info(tmp_path / "run.mcap").commands == commands


@pytest.mark.usefixtures("site")
def test_a_command_that_is_not_finite_names_robot_player_file_and_line() -> None:
    sets = ("engine=pure", WINCH_OF_GOAL, listens({"red.goal": ["encoder"]}, {"red.goal": nan}))
    reason = rehearse(TEXT, TABLE.name, 20, 1, sets).json["reason"]
    line = 1 + MODULES["own_listener"].splitlines().index("    def act(self, tick, samples):")
    assert "red.goal/turn takes rate" in reason and f"(own_listener.py:{line})" in reason


WRONG: Final = (
    ("kind: 'own_gauges:ReachGauge', rate: 100 Hz, scale: 11.0",
     [("11.0", ".scale: more than the most that is valid, 10.0, 11.0")]),
    ("kind: 'own_gauges:ReachGauge', rate: 100 Hz, scale: two", [("two", ".scale: not a number, 'two'")]),
    ("kind: 'own_gauges:ReachGauge', rate: 100 Hz, scal: 2.0",
     [("{", ": missing key, 'scale'"), ("scal", ": unknown key, 'scal', nearest is 'scale'")]),
    ("kind: 'own_gauges:ReachGauge', scale: 2.0, grain: 2 kg, rate: 3 mm",
     [("2 kg", ".grain: not a length (a number and one of m, cm, mm, um, km); kg measures a mass, '2 kg'"),
      ("3 mm", ".rate: not a rate (a number and one of Hz, kHz, mHz); mm measures a length, '3 mm'")]),
    ("rate: 100 Hz, kind: 'own_gauges:Idle'",
     [("'own", ".kind: not registered as a sensor; own_gauges registers ReachGauge, 'own_gauges:Idle'")]),
)  # fmt: skip
"""Settings, and what is said of them at which word."""


@pytest.mark.parametrize(("settings", "said"), WRONG)
@pytest.mark.usefixtures("site")
def test_what_is_wrong_with_settings_of_ones_own_has_its_place(settings: str, said: list[tuple[str, str]]) -> None:
    """In the file, by line and column, in the words that foosim's own settings have."""
    lines = TEXT.splitlines()
    number = lines.index("      encoder:") + 1
    line = f"      own: {{{settings}}}"
    text = "\n".join([*lines[: number - 1], line, *lines[number - 1 :]])
    with pytest.raises(DeploymentError) as error:
        load_deployment(text, "mine.yaml")
    assert list(error.value.problems) == [
        f"mine.yaml:{number}:{line.index(word) + 1}: robots.red.goal.sensors.own{what}" for word, what in said
    ]


@pytest.mark.usefixtures("site")
def test_a_model_that_lacks_what_a_component_needs_is_refused() -> None:
    (problem,) = problems(REACH.replace("red.goal.sensors.reach", "camera.sensors.own"))
    assert problem == (
        "robots.camera.sensors.own.kind: sensor that a camera cannot carry, for lack of joint_positions "
        "(valid on: differential_drive with dynamics: rigid, rod), 'own_gauges:ReachGauge'"
    )


LOOP: Final = "{kind: rod_position}"


@pytest.mark.parametrize("actuators", ["{}", "null", f"{{loop: {LOOP}}}", f"{{one: {LOOP}, two: {LOOP}}}"])
@pytest.mark.parametrize("engine", ["pure", "bullet"])
def test_actuators_that_validate_run(actuators: str, engine: str) -> None:
    """A deployment with other actuators than the model's is refused, or it runs."""
    sets = ("players={}", f"engine={engine}", f"robots.red.goal.actuators={actuators}")
    try:
        apply_sets(TEXT, TABLE.name, sets)
    except DeploymentError:
        return
    assert not rehearse(TEXT, TABLE.name, 5, 2, sets).json["failed"]


def test_a_sensor_may_have_the_name_of_an_actuator_that_its_robot_does_not_have() -> None:
    sensor = "robots.red.goal.sensors={position: {kind: ball, rate: 100 Hz}}"
    for actuators in ("{}", f"{{loop: {LOOP}}}"):
        sets = ["players={}", f"robots.red.goal.actuators={actuators}", sensor]
        robot = deployed(*sets).robots["red.goal"]
        assert list(robot.sensors) == ["position"] and "position" not in robot.actuators
