"""Wrong worlds of components of other packages are refused with the place and what is valid."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from copy import deepcopy
from pathlib import Path
from typing import Any, Final

import pytest
import yaml
from jsonschema import Draft202012Validator

from foosim.common.errors import DeploymentError
from foosim.common.names import NAME_RULE
from foosim.deployment.json_schema import deployment_schema, deployment_schema_text
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.simulation.run import rehearse
from foosim.world.component_types import registry
from foosim.world.layout import build_layout
from tests.deployed import TABLE
from tests.kinematic_yard import yard_text
from tests.own_components import folder_on_path, problems, written

TEXT: Final = TABLE.read_text()
WAREHOUSE: Final = (TABLE.parent / "warehouse.yaml").read_text()


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder on the path."""
    return folder_on_path(tmp_path, monkeypatch)


# --- slots -----------------------------------------------------------------------------------------------------------

SENSOR: Final = "robots.red.goal.sensors.own={kind: 'own_form:OwnSensor', rate: 100 Hz}"
RULE: Final = "robots.red.goal.rules={own: {kind: 'own_form:OwnRule'}}"
WORLD: Final = "rules={own: {kind: 'own_form:World'}}"
TWO: Final = (
    "class OwnSensor(Sensor):",
    "    SENSOR",
    "    def sample(self, view): return Number(0.0)",
    "class OwnRule(EntityRule): RULE",
    "class World(Own): pass",
    "sensor('own-sensor', Settings, Number)(OwnSensor)",
    "rule('own-rule', EntityRuleSettings)(OwnRule)",
    "rule('own-world', RuleSettings, each=WORLD)(World)",
)


@pytest.mark.parametrize(
    ("sensor", "rule", "world", "told"),
    [
        ("a = slot()", "b = slot()", "{ROBOTS: {'c': 1}}", []),
        ("a = slot()", "a = slot()", "{}", [
            "robots.red.goal.sensors: the sensor own declares the slot own.a of red.goal, which the rule own has "
            "already, 'a'"]),
        ("a = slot(2)", "pass", "{ROBOTS: {'a': 1}}", [
            "robots.red.goal.sensors: the sensor own declares the slot own.a of red.goal, which the rule own of the "
            "world has already, 'a'"]),
        ("pass", "a = slot()", "{'rod': {'a': 1}}", [
            "robots.red.goal.rules: the rule own declares the slot own.a of red.goal, which the rule own of the world "
            "has already, 'a'"]),
        ("pass", "pass", "{'camera': {'a': 1}, ROBOTS: {'a': 2}}", [
            "rules: the rule own of the world declares the slot own.a of camera, which the rule own of the world has "
            "already, 'a'"]),
        ("pass", "pass", "{ROBOTS: {'samples': 2}}", [
            "robots.red.goal.sensors: the sensor own declares the slot own.samples of red.goal, which the rule own of "
            "the world has already, 'samples'"]),
    ],
)  # fmt: skip
def test_a_slot_is_declared_once(site: Path, sensor: str, rule: str, world: str, told: list[str]) -> None:
    """Names of components may be equal where their slots are not."""
    written(site, *(line.replace("SENSOR", sensor).replace("RULE", rule).replace("WORLD", world) for line in TWO))
    assert problems(SENSOR, RULE, WORLD) == told


def test_modifiers_of_like_names_have_labels_of_their_own(site: Path) -> None:
    """A kind may be called as the second of another kind is."""
    written(site, "class Two(Own): values = slot()", "modifier('delay2', ModifierSettings)(Two)")
    delay = "{kind: delay, time: 20 ms}"
    text = apply_sets(TEXT, "t.yaml", [f"robots.camera.sensors.ball.modifiers=[{delay}, {{kind: 'own_form:Two'}}, "
                                       f"{delay}]"])  # fmt: skip
    counts = build_layout(load_deployment(text, "t.yaml"))["camera"].counts
    found = {slot: count for slot, count in counts.items() if slot.endswith(".values")}
    assert set(found) == {"ball.delay.values", "ball.delay2.values", "ball.delay3.values"}
    assert found["ball.delay2.values"] == 1 < found["ball.delay.values"] == found["ball.delay3.values"]


# --- models and their motions ----------------------------------------------------------------------------------------

DRONE: Final = "robots.camera={model: 'own_form:Own'}"


def installed(type_name: str) -> str:
    """The names of a component type, as messages list them."""
    return ", ".join(registry.names(type_name))


OF_ENTITY: Final = ("class Own(EntityRule):", "    def __init__(self, *made_with): pass", "")


def test_a_rigid_model_that_may_not_share_a_solve_is_refused(site: Path) -> None:
    written(site, "model('crate', RobotSettings, is_rigid=True, couples=False)(Own)")
    assert problems(DRONE, "players={}") == [
        "robots.camera.model: a rigid model with couples=False, which is valid of rod, ball alone, 'own_form:Own'"
    ]


@pytest.mark.parametrize(
    ("about", "told"),
    [
        ("needs=('contacts',), writes=('contacts',)", ""),
        ("writes=('contact',)", "rule of entities that writes contact: a rod has joint_positions, joint_velocities, "
         "joint_efforts, quarantined, down, contacts, refused, unmoved, clamped, nearest to contact is contacts"),
        ("needs=('contact',)", "rule of entities that a rod cannot carry, for lack of contact (valid on: none; a rod "
         "has joint_positions, joint_velocities, joint_efforts, quarantined, down, contacts, refused, unmoved, "
         "clamped, nearest to contact is contacts)"),
    ],
)  # fmt: skip
def test_a_rule_of_robots_reads_and_writes_fields_that_there_are(site: Path, about: str, told: str) -> None:
    written(site, *OF_ENTITY, f"rule('fade', EntityRuleSettings, {about})(Own)")
    expected = [f"robots.red.goal.rules.fade.kind: {told}, 'own_form:Own'"] if told else []
    assert problems("robots.red.goal.rules={fade: {kind: 'own_form:Own'}}") == expected


# --- rules of the world ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("about", "told"),
    [
        ("each={ROBOTS: {'x': 1}, 'rod': {'y': 1}}, writes=('ball',)", ""),
        ("each={'rood': {'y': 1}}", "rule of worlds that remembers something of each rood: unknown model (there are: "
         f"{installed('model')}), 'rood', nearest is 'rod'"),
        ("writes=('bal',)", "rule of worlds that writes bal: unknown model (there are: "
         f"{installed('model')}), 'bal', nearest is 'ball'"),
        ("writes=(ROBOTS,)", "rule of worlds that writes *: unknown model (there are: "
         f"{installed('model')}), '*'"),
    ],
)  # fmt: skip
def test_a_rule_of_worlds_names_models_that_there_are(site: Path, about: str, told: str) -> None:
    written(site, f"rule('laps', RuleSettings, {about})(Own)")
    expected = [f"rules.laps.kind: {told}, 'own_form:Own'"] if told else []
    assert problems("rules={laps: {kind: 'own_form:Own'}}") == expected


def test_a_rule_that_a_kit_has_already_is_refused() -> None:
    assert problems("rules={football: {kind: football}}") == [
        "rules: a rule that the kit table has already: each world with a table has it, 'football'"
    ]


# --- kits ------------------------------------------------------------------------------------------------------------

KIT: Final = (
    "class Zoo(Kit):",
    "    def __init__(self, section, spec): pass",
    "    def shapes(self): return ()",
    "    def physics(self): return None",
    "    def findings(self): return iter(())",
    "class Beast(Own):",
    "    pass",
    "class RuleOf(RuleSettings):",
    "    count: int = 1",
    "class Feed(Own): pass",
    "rule('feed', RuleOf)(Feed)",
    "class InHall(Own): pass",
    "rule('in-hall', RuleSettings, kit='hall')(InHall)",
    "model('beast', RobotSettings, is_robot=False, slots={'position': 3})(Beast)",
    "class Crate(Own): pass",
    "model('crate', RobotSettings, is_robot=False, is_rigid=True, couples=False)(Crate)",
)
KITS: Final = {
    "entities={'leo': 'beast'}, rules={'feed': {'kind': 'feed', 'count': 2}}": [],
    "spares=lambda section: {'egg': 'ball'}": [],
    "entities={'leo': 'rod'}": ["its entity leo is of the model rod, which is one of robots: these have owners, and "
                                "are in robots:"],
    "entities={'leo': 'beest'}": ["its entity leo is of an unknown model: unknown model (there are: "
                                  f"{installed('model')}, or any module:Class), 'beest'"],
    "entities={'leo': 'crate'}": ["its entity leo is a rigid model with couples=False, which is valid of rod, ball "
                                  "alone"],
    "entities={'world': 'beast'}": ["its entity world has a reserved name"],
    "entities={'ball': 'beast'}": ["its entity ball has a name that is also one of the kit table's"],
    "rules={'football': {'kind': 'feed'}}": ["its rule football has a name that is also one of the kit table's"],
    "rules={'feed': {'kind': 'fed'}}": ["its rule feed: unknown rule of worlds (there are: "
                                        f"{installed('rule')}, or any module:Class), 'fed'"],
    "rules={'feed': {'kind': 'feed', 'count': 'two'}}": ["its rule feed: count: not a whole number, 'two'"],
    "rules={'feed': {'kind': 'feed', 'coun': 2}}": ["its rule feed: unknown key, 'coun', nearest is 'count'"],
    "rules={'feed': {'kind': 'own_none:X'}}": ["its rule feed: there is no module own_none (it is not on PYTHONPATH), "
                                               "'own_none:X', nearest is 'own_form:X'"],
    "rules={'feed': {'kind': 'in-hall'}}": ["its rule feed: rule of worlds of a hall in a world without one"],
    "spares=lambda section: {'leo': 'lion'}": ["its entity leo is of an unknown model: unknown model (there "
                                               f"are: {installed('model')}, or any module:Class), 'lion'"],
    "spares=lambda section: {'leo': 'beast'}": ["leo, a spare that could not be absent: a beast without a place of its "
                                                "own"],
    "spares=lambda section: {'ball-2': 'ball'}": ["its entity ball-2 has a name that is also one of the kit table's"],
    "spares=lambda section: {'Leo': 'ball'}": [f"spares returns the entity 'Leo': {NAME_RULE}"],
    "spares=lambda section: ['ball']": ["spares fails: ValueError: dictionary update sequence element #0 has length "
                                      "4; 2 is required"],
    "spares=lambda section: 1 / 0": ["spares fails: ZeroDivisionError: division by zero (own_form.py:73)"],
}  # fmt: skip
"""Kits, and what is said of a table with each."""


@pytest.mark.parametrize("about", KITS)
def test_what_a_kit_brings_can_be_in_its_world(site: Path, about: str) -> None:
    written(site, *KIT, f"kit('zoo', SpecBase, {about})(Zoo)")
    registry.find("kit", "own_form:Zoo")
    assert problems("zoo={}") == [f"kit zoo: {told}, 'zoo'" for told in KITS[about]]


def test_models_of_a_kit_of_another_kit_need_it(site: Path) -> None:
    written(site, *KIT, "kit('zoo', SpecBase, entities={'egg': 'ball'})(Zoo)")
    registry.find("kit", "own_form:Zoo")
    told = "its entity egg is of a model that cannot be there: ball of a table in a world without one"
    assert problems("zoo={}", text=WAREHOUSE) == [f"kit zoo: {told}, 'zoo'"]


FAILING: Final = {
    "    def __init__(self, section, spec): pass": "    def __init__(self, section): pass",
    "    def shapes(self): return ()": "    def shapes(self): return (1 / 0,)",
    "    def physics(self): return None": "    def physics(self): return self.nothing",
    "    def findings(self): return iter(())": "    def findings(self): yield from 3",
    "class Zoo(Kit):": "class Zoo(Own):\n    check = staticmethod(lambda section, spec: 1 / 0)",
}
"""Lines of a kit, and others that raise."""


@pytest.mark.parametrize("line", FAILING)
def test_a_kit_that_fails_is_named_with_the_place_in_its_file(site: Path, line: str) -> None:
    lines = [FAILING[line] if one == line else one for one in KIT]
    written(site, *lines, "kit('zoo', SpecBase)(Zoo)")
    registry.find("kit", "own_form:Zoo")
    (told,) = problems("zoo={}")
    assert re.match(r"kit zoo(: check fails| failed at tick 0): \w+Error: .*, 'zoo'$", told), told
    assert "__init__" in told or re.search(r"\(own_form\.py:\d+\)", told), told


# --- components of one world in another ------------------------------------------------------------------------


def test_free_bodies_are_not_those_of_kits_alone(site: Path, fleet_text: Callable[..., str]) -> None:
    """A surface is of use where a robot is one; that no such robot is solved yet is another matter."""
    written(site, "model('crate', RobotSettings, is_rigid=True, slots={'linear_velocity': 3})(Own)")
    sets = ("scenery.goods-1.surface=floor", "players={}", "nodes={one: {robots: ['*']}}", "network={}")
    surface = "scenery.goods-1.surface: a surface for free bodies, in a world without any, 'floor'"
    assert surface in problems(*sets, text=fleet_text(1))
    assert surface not in problems(*sets, "robots.crate={model: 'own_form:Own'}", text=fleet_text(1))


@pytest.mark.parametrize(
    ("things", "is_free"),
    [
        ({"robots": {"a": {"model": "holonomic"}}}, False),
        ({"robots": {"a": {"model": "differential_drive"}}}, False),
        ({"robots": {"a": {"model": "differential_drive", "dynamics": "rigid"}}}, True),
        ({"objects": {"a": {"model": "box", "size": ["20 cm"] * 3, "mass": "1 kg", "at": {"z": "10 cm"}}}}, True),
    ],
)
def test_objects_and_rigid_drives_are_free_bodies(things: dict[str, Any], is_free: bool) -> None:
    """Scenery may have a surface, and the engine must have its meshes."""
    robots = {"watcher": {"model": "holonomic", "at": {"x": "-5 m"}}, **things.get("robots", {})}
    ramp = {"shape": "box", "length": "6 m", "width": "4 m", "height": "20 cm", "x": "10 m", "z": "1 m"}
    text = yard_text(robots, engine="mujoco", objects=things.get("objects", {}), scenery={"ramp": ramp})
    surface = "scenery.ramp.surface: a surface for free bodies, in a world without any, 'floor'"
    assert problems("scenery.ramp.surface=floor", text=text) == [surface] * (not is_free)
    no_meshes = "scenery.ramp.shape: the engine pure has no meshes"
    mesh = ("engine=pure", "scenery.ramp={shape: mesh, file: a.obj}")
    assert any(said.startswith(no_meshes) for said in problems(*mesh, text=text)) == is_free


def test_objects_have_names_of_their_own() -> None:
    crate = "{model: box, size: [20 cm, 20 cm, 20 cm], mass: 1 kg, at: {x: 3 m, z: 10 cm}}"
    wall = "{shape: box, length: 1 m, width: 1 m, height: 1 m, x: -4 m, z: 1 m}"
    text = yard_text({"a": {"model": "holonomic"}}, engine="mujoco")
    assert problems(f"objects.b={crate}", f"scenery.c={wall}", text=text) == []
    for sets, what in (
        ([f"objects.a={crate}"], "objects: a name that is also one of robots, 'a'"),
        ([f"objects.world={crate}"], "objects: a reserved name, 'world'"),
        ([f"objects.b={crate}", f"scenery.b={wall}"], "scenery: a name that is also an object's, 'b'"),
    ):
        assert problems(*sets, text=text) == [what]


def test_rays_start_on_robots_that_are_no_rovers(site: Path, fleet_text: Callable[..., str]) -> None:
    mast = (
        "class Mast(Own):",
        "    def __init__(self, settings, at): self.at = at",
        "    def body(self):",
        "        pole = Shape(Cylinder(0.1, 1.0), '', (0.5, 0.5, 0.5, 1.0), (0.0, 0.0, 0.5))",
        "        return Body('mast', 'mast', ORIGIN, (Link('mast', 'free', (pole,), 0.0, ORIGIN),))",
        "    def place(self, view):",
        "        view.write(self.at.slot('position'), 6.0, 0.0, 0.0)",
        "        view.write(self.at.slot('orientation'), 0.0, 0.0, 0.0, 1.0)",
        "    def is_plausible(self, numbers, before): return True",
        "model('mast', RobotSettings, slots={'position': 3, 'orientation': 4})(Mast)",
        "class Ghost(Mast):",
        "    def body(self): return None",
        "model('ghost', RobotSettings, slots={'position': 3, 'orientation': 4})(Ghost)",
    )
    written(site, "from foosim.world.scene import ORIGIN, Body, Cylinder, Link, Shape", *mast)
    rays = "{kind: proximity, rate: 50 Hz, rays: 4, range: 3 m}"
    robot = f"robots.mast={{model: 'own_form:Mast', sensors: {{rays: {rays}}}}}"
    text = fleet_text(1, robot, "players={}", "nodes={one: {robots: ['*']}}", "network={}")
    done = rehearse(text, "x.yaml", 20, 1)
    assert not done.json["failed"], done.json["reason"]
    with pytest.raises(DeploymentError, match=r"robots.mast.sensors: .*mast has no body to carry it, 'ghost'"):
        load_deployment(text.replace("own_form:Mast", "own_form:Ghost"), "x.yaml")


# --- sensors that speak ----------------------------------------------------------------------------------------------


# --- scenery ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("surface", "told"),
    [
        ("floor", ""),
        ("", ""),
        ("flor", "scene own_form:shapes has an unknown surface (there are: figures, floor, goal, ramps, "
         "rods, walls; and '' without contacts), 'flor', nearest is 'floor'"),
    ],
)  # fmt: skip
def test_surfaces_of_a_scene_are_those_that_rigid_bodies_feel(site: Path, surface: str, told: str) -> None:
    """A name that is misspelt would be scenery that balls fly through."""
    scene = (
        "from foosim.world.scene import Box, Shape",
        "def shapes(settings):",
        f"    return (Shape(Box((0.1, 0.1, 0.1)), {surface!r}, (0.0, 0.0, 0.0, 1.0), (5.0, 0.0, 5.0)),)",
        "scene('plain', SceneSettings)(shapes)",
    )
    written(site, *scene)
    assert problems("scene={kind: 'own_form:shapes'}") == ([f"scene.kind: {told}"] if told else [])


# --- the JSON Schema -------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def validators() -> list[Draft202012Validator]:
    """Of what a file is expanded to, and of a file."""
    return [Draft202012Validator(schema) for schema in (deployment_schema(), json.loads(deployment_schema_text()))]


@pytest.mark.parametrize(
    ("place", "value", "is_valid"),
    [
        (("robots", "camera"), {"model": "own_form:Own", "arms": 2}, True),
        (("robots", "camera"), {"model": "own_form.Own", "arms": 2}, False),
        (("robots", "camera"), {"arms": 2}, False),
        (("robots", "red.goal", "sensors", "own"), {"kind": "own_form:Own", "scale": 2.0}, True),
        (("robots", "red.goal", "sensors", "own"), {"kind": "own:form:Own"}, False),
        (("robots", "red.goal", "sensors", "own"), {"scale": 2.0}, False),
        (("robots", "red.goal", "sensors", "encoder", "modifiers"), [{"kind": "own_form:Own"}], True),
        (("robots", "red.goal", "actuators"), {"own": {"kind": "own_form:Own"}}, True),
        (("robots", "red.goal", "rules"), {"own": {"kind": "own_form:Own"}}, True),
        (("rules",), {"own": {"kind": "own_form:Own"}}, True),
        (("rules",), {"own": {"kind": "own_form"}}, False),
        (("scene",), {"kind": "own_form:own", "radius": "1 m"}, True),
    ],
)
def test_the_schema_takes_forms_by_their_class(
    validators: list[Draft202012Validator], place: tuple[str, ...], value: object, is_valid: bool
) -> None:
    """In a file and in what it is expanded to; what the settings of such are, no schema knows."""
    data = yaml.safe_load(TEXT)
    inner = data
    for step in place[:-1]:
        inner = inner[step]
    inner[place[-1]] = value
    assert [validator.is_valid(data) for validator in validators] == [is_valid, is_valid]


OWN_CLASSES: Final = (
    "class Wheel(SpecBase):",
    '    """Of a kit."""',
    "    spokes: int",
    "class Table(SpecBase):",
    '    """Called as a section of foosim is."""',
    "    wheel: Wheel",
    "class Zoo(Own): pass",
    "kit('zoo', Table)(Zoo)",
    "class Goal(SpecBase):",
    '    """Called as a part of a section of foosim is."""',
    "    nets: int",
    "class SensorOfGoals(SensorSettings):",
    "    goal: Goal",
    "sensor('goals', SensorOfGoals, Number)(Own)",
)


def test_the_schema_keeps_classes_of_other_packages_apart(site: Path) -> None:
    """They may be called as foosim's own are, and as each other's."""
    before = deployment_schema()
    written(site, *OWN_CLASSES)
    second = [line.replace("nets", "posts").replace("'goals'", "'posts'") for line in OWN_CLASSES[-6:]]
    written(site, *second, name="own_second")
    for module in ("own_form", "own_second"):
        about = site / f"{module}-1.0.dist-info"
        about.mkdir()
        (about / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {module}\nVersion: 1.0\n")
        (about / "entry_points.txt").write_text(f"[foosim.world]\n{module} = {module}\n")
    registry._entry_points.cache_clear()
    assert deployment_schema() == before, "the one that is kept has foosim's own"
    schema = deployment_schema(installed=True)
    assert before["$defs"]["Table"] == schema["$defs"]["Table"] and before["$defs"]["Goal"] == schema["$defs"]["Goal"]
    sensors = {"goals": {"kind": "goals", "rate": "100 Hz", "goal": {"nets": 1}}}
    sensors |= {"posts": {"kind": "posts", "rate": "100 Hz", "goal": {"posts": 1}}}
    for valid in (schema, json.loads(deployment_schema_text(installed=True))):
        validator = Draft202012Validator(valid)
        data = yaml.safe_load(TEXT)
        data["robots"]["camera"]["sensors"] |= deepcopy(sensors)
        data["zoo"] = {"wheel": {"spokes": 12}}
        assert [error.message for error in validator.iter_errors(data)] == []
        data["zoo"] = {"wheel": {"spokes": "many"}}
        assert not validator.is_valid(data)
        data["zoo"] = {"wheel": {"spokes": 12}}
        data["robots"]["camera"]["sensors"]["posts"]["goal"] = {"nets": 1}
        assert not validator.is_valid(data)
