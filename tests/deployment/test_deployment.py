"""The schema: what table.yaml becomes, what defaults are, and that the committed JSON Schema is the current one."""

import json
import math
import re
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft202012Validator
from pydantic import ValidationError

from foosim.common.units import Pace
from foosim.deployment.components import read_components
from foosim.deployment.json_schema import deployment_schema_text
from foosim.deployment.loader import DEPLOYMENT_KEYS, apply_sets, expanded_text, load_deployment, read_deployment
from foosim.deployment.network.impairments import GammaJitter
from foosim.deployment.network.link_settings import Profiles
from foosim.deployment.schema import Deployment
from foosim.deployment.text.yaml import locate_in, plain, read_tree
from foosim.launcher.liveness import WAITS_S
from foosim.library.generic.gaussian_noise import GaussianNoiseSettings
from foosim.library.table.ball import BallSettings
from foosim.library.table.camera import CameraRobot
from foosim.library.table.encoder import EncoderSettings
from foosim.library.table.rod import RodRobot
from foosim.library.table.settings import table_of
from foosim.runtime.supervisor_timeout import UNKNOWN_NS
from foosim.world.component_types.per_field import numbers_of, read_per_field
from foosim.world.component_types.registry import find, find_component, find_engine, find_model
from foosim.world.component_types.settings import ComponentSettings
from tests.deployment.halls import BATTERY, PATROL, POSE, hall
from tests.turns import BY_PERIOD

DEPLOY = Path(__file__).parents[2] / "deploy"
TABLE_TEXT = (DEPLOY / "table.yaml").read_text()
REGENERATE = "python docs/generate.py"


@pytest.fixture(scope="module")
def table() -> Deployment:
    """The deployment of deploy/table.yaml."""
    return load_deployment(TABLE_TEXT, "table.yaml")


def links_of(deployment: Deployment) -> Profiles:
    """What the links of a deployment are made from."""
    return deployment.profiles()


def data_of(text: str) -> Any:
    """A YAML text as plain data."""
    tree, problems = read_tree(text, locate_in("f"))
    assert tree is not None
    assert problems == []
    return plain(tree)


def test_quantities_are_si_numbers_and_times_are_nanoseconds(table: Deployment) -> None:
    assert (table.tick_ns, table.substeps, table.pace) == (2_000_000, 4, Pace("realtime"))
    assert (table_of(table).ball.radius, table_of(table).ball.mass, table_of(table).gravity) == (0.0175, 0.021, 9.81)
    assert (table_of(table).lines["goal"].x, table_of(table).lines["midfield"].half_stroke) == (-0.522, 0.0615)
    assert table_of(table).surfaces.floor.rolling_friction == 0.00015
    assert (table_of(table).drive.slide.speed, table_of(table).drive.spin.torque) == (3.5, 2.0)
    camera, rod = table.robots["camera"], table.robots["red.goal"]
    assert isinstance(camera, CameraRobot)
    assert isinstance(rod, RodRobot)
    ball, encoder = camera.sensors["ball"], rod.sensors["encoder"]
    assert isinstance(ball, BallSettings)
    assert ball.rate_hz == Fraction(100)
    assert isinstance(encoder, EncoderSettings)
    (noise,) = encoder.modifiers
    numbers = numbers_of(find_component("sensor", "encoder"), encoder)
    assert isinstance(noise, GaussianNoiseSettings) and numbers is not None
    assert read_per_field(noise.std, numbers) == [0.0002, math.radians(0.5)]
    rule = links_of(table).rule_for("player-red", "red.goal")
    assert rule is not None
    assert isinstance(rule.jitter, GammaJitter)
    assert (rule.delay_ns, rule.jitter.mean_ns, rule.jitter.sd_ns) == (1_000_000, 300_000, 300_000)
    assert (rule.loss, rule.order) == (0.005, "fifo")
    assert (table.capture.frames_every, table.capture.poses_hz, table.capture.flush_ns) == (
        10,
        Fraction(50),
        100_000_000,
    )


def test_what_is_left_out_has_its_default(table: Deployment) -> None:
    data = data_of(TABLE_TEXT)
    for section in ("network", "capture", "deadlines", "players", "mixed_cpu"):
        del data[section]
    read, findings = read_components(data, DEPLOYMENT_KEYS)
    bare = Deployment.model_validate(read)
    assert findings == []
    assert bare.capture == table.capture
    assert bare.deadlines == table.deadlines
    assert bare.network.links == []
    assert bare.players == {}
    assert bare.clients == {}
    assert bare.mixed_cpu is False
    assert links_of(bare).rule_for("red.goal", "camera") is None


def test_a_jitters_mean_is_its_spread_unless_said_otherwise() -> None:
    text = apply_sets(TABLE_TEXT, "f", ["network.links.everything.jitter={shape: gamma, sd: 0.2 ms}"])
    jitter = load_deployment(text, "f").network.links[0].jitter
    assert isinstance(jitter, GammaJitter)
    assert (jitter.mean_ns, jitter.sd_ns) == (200_000, 200_000)


def test_the_first_rule_that_matches_wins_and_links_are_directed() -> None:
    rules = "[{id: a, from: player-red, to: [camera, red.*]}, {id: b, from: '*', to: 'red.goa?'}]"
    links = links_of(load_deployment(apply_sets(TABLE_TEXT, "f", [f"network.links={rules}"]), "f"))
    matched = {
        (source, destination): rule.id if (rule := links.rule_for(source, destination)) else None
        for source in ("player-red", "player-blue", "red.goal")
        for destination in ("red.goal", "red.attack", "player-red")
    }
    assert matched == {
        ("player-red", "red.goal"): "a",
        ("player-red", "red.attack"): "a",
        ("player-red", "player-red"): None,
        ("player-blue", "red.goal"): "b",
        ("player-blue", "red.attack"): None,
        ("player-blue", "player-red"): None,
        ("red.goal", "red.goal"): "b",
        ("red.goal", "red.attack"): None,
        ("red.goal", "player-red"): None,
    }


def test_a_rule_without_effects_is_a_perfect_link() -> None:
    rules = "[{id: a, from: '*', to: '*'}]"
    rule = load_deployment(apply_sets(TABLE_TEXT, "f", [f"network.links={rules}"]), "f").network.links[0]
    assert (rule.delay_ns, rule.jitter, rule.loss, rule.order) == (0, None, 0.0, "fifo")


DEPLOYMENTS = ("table.yaml", "table_sensors.yaml", "warehouse.yaml", "yard.yaml")


@pytest.mark.parametrize("name", DEPLOYMENTS)
@pytest.mark.parametrize("sets", [(), ("seed=5", "network.defaults={in_flight_on_partition: deliver}", "pace=fast")])
def test_all_texts_of_a_deployment_are_the_same_deployment(name: str, sets: tuple[str, ...]) -> None:
    """The canonical one, which keeps what is abbreviated, the expanded one, and that in SI units."""
    text = (DEPLOY / name).read_text()
    canonical, expanded = apply_sets(text, name, sets), expanded_text(text, name, sets)
    assert apply_sets(canonical, "c", []) == canonical and "#" not in canonical
    assert canonical.count("like:") == sum("like:" in line.partition("#")[0] for line in text.splitlines())
    assert not any(sign in expanded for sign in ("templates", "like", "$", "count:"))
    kept = load_deployment(canonical, name)
    assert kept is load_deployment(canonical, name)
    written = kept.model_dump(mode="json", by_alias=True, exclude_unset=True)
    data, findings = read_components(written | written.pop("kits"), DEPLOYMENT_KEYS)
    assert findings == []
    for other in (read_deployment(canonical, name), load_deployment(expanded, "e")):
        assert kept == other and repr(kept) == repr(other)
    assert Deployment.model_validate(data).model_dump() == kept.model_dump()
    assert load_deployment(text, name).seed == 1, "settings change no other text"


@pytest.mark.parametrize("name", DEPLOYMENTS)
def test_settings_know_their_component_type_and_so_do_copies(name: str) -> None:
    loaded = load_deployment((DEPLOY / name).read_text(), name)
    for one in (loaded, loaded.model_copy(update={"seed": 9})):
        assert one.engine_type is find_engine(one.engine) and [*one.kit_types] == sorted(one.kits)
        typed: list[tuple[str, ComponentSettings]] = [("rule", rule) for rule in one.world_rules.values()]
        for robot in one.robots.values():
            model = find_model(robot.model).variant(getattr(robot, "dynamics", None))
            assert robot.model_copy(update={"spare": True}).component_type is robot.component_type is model
            typed += [("entity_rule", rule) for rule in robot.rules.values()]
            for type_name, components in (("sensor", robot.sensors), ("actuator", robot.actuators)):
                typed += [(type_name, its) for its in components.values()]
                typed += [("modifier", modifier) for its in components.values() for modifier in its.modifiers]
        assert typed and all(its.component_type is find(type_name, its.kind) for type_name, its in typed)


def test_values_do_not_change(table: Deployment) -> None:
    with pytest.raises(ValidationError, match="frozen"):
        table.tick_ns = 1


def test_the_committed_json_schema_is_current() -> None:
    assert (DEPLOY / "deployment.schema.json").read_text() == deployment_schema_text(), f"write it anew: {REGENERATE}"


@pytest.fixture(scope="module")
def validator() -> Draft202012Validator:
    """Of the JSON Schema of files."""
    return Draft202012Validator(json.loads(deployment_schema_text()))


def test_the_json_schema_takes_the_table_and_refuses_what_the_models_refuse(validator: Draft202012Validator) -> None:
    Draft202012Validator.check_schema(validator.schema)
    assert list(validator.iter_errors(data_of(TABLE_TEXT))) == []
    for change in (
        "tick=2",
        "engine=bulet",
        "tik=2 ms",
        "table.ball.mass=21 mm",
        "network.links.0.loss=0.5",
        "format=3",
    ):
        key, _, value = change.partition("=")
        data = data_of(TABLE_TEXT)
        *path, last = key.split(".")
        inner = data
        for step in path:
            inner = inner[int(step)] if step.isdigit() else inner[step]
        inner[last] = data_of(value)
        assert not validator.is_valid(data), change


SHORT = hall(
    f"""\
include: [a.yaml]
templates:
  rover: {{model: rover, sensors: {{pose: {POSE}, battery: {BATTERY}}}}}
  bare: {{like: rover, sensors: {{battery: null, pose: {{rate: 1 Hz}}}}}}
  shelf: {{shape: box, height: 1 m}}
  pilot: {{class: '{PATROL}', on: $robot, process: fleet-$node, robots: {{$robot: [pose], 'x-*': []}}}}
robots:
  a: {{like: bare, x: 1 m, y: 1 m}}
  r: {{like: rover, count: 3, spacing: {{x: 1 m}}, x: 1 m, y: 1 m}}
  r-2: {{charge: 1 %}}
  s: {{model: station, x: 1 m, y: 1 m, count: 2}}
scenery: {{t: {{like: shelf, count: 2, length: 1 m}}}}
nodes: {{one: {{robots: [a, 'r-*', s-1..2, rest]}}}}
players: {{pilot$1: {{like: pilot, each: r-*}}, pilot2: {{rate: 1 Hz}}}}
clients: {{c-$robot: {{each: 'r-?', on: $robot}}}}
"""
)


def test_the_json_schema_takes_what_is_abbreviated(validator: Draft202012Validator) -> None:
    def is_refused(text: str) -> bool:
        return not validator.is_valid(data_of(text))

    assert not is_refused(SHORT)
    for name in ("warehouse.yaml", "cluster.yaml"):
        assert not is_refused((DEPLOY / name).read_text())
    for given, wrong in (
        ("like: bare", "lik: bare"),
        ("like: bare", "like: 5"),
        ("count: 3", "count: 0"),
        ("count: 3", "count: many"),
        ("spacing: {x: 1 m}", "spacing: {w: 1 m}"),
        ("charge: 1 %", "charge: 1 m"),
        ("charge: 1 %", "charg: 1 %"),
        ("model: station, x: 1 m", "model: station"),
        ("rate: 1 Hz}}}", "rate: 1 kg}}}"),
        ("shape: box", "shap: box"),
        ("each: r-*", "each: [r-1]"),
        ("process: fleet-$node", "process: Fleet"),
        ("'r-*', s-1", "'R-*', s-1"),
        ("include: [a.yaml]", "include: {a: 1}"),
    ):
        assert given in SHORT
        assert is_refused(SHORT.replace(given, wrong)), wrong
    assert is_refused(SHORT.replace("include: [a.yaml]\n", "").replace("seed: 1\n", ""))


def test_the_defaults_in_the_json_schema_are_written_as_in_a_file() -> None:
    definitions = json.loads(deployment_schema_text())["$defs"]
    assert definitions["Deadlines"]["properties"]["heartbeat"]["default"] == "1 s"
    assert definitions["LinkRule"]["properties"]["loss"]["default"] == "0 %"
    assert definitions["Capture"]["properties"]["frames_every"]["default"] == "10 ticks"


def test_table_yaml_is_block_style_with_the_tick_on_a_line_of_its_own() -> None:
    lines = TABLE_TEXT.splitlines()
    assert "tick: 2 ms" in lines
    assert not [line for line in lines if re.match(r"[^#]*:\s*[\[{]", line)]
    assert max(len(line) for line in lines) <= 120


def test_each_parameter_of_the_world_has_its_source_and_mark() -> None:
    block = TABLE_TEXT[TABLE_TEXT.index("\ntable:\n") : TABLE_TEXT.index("\nrobots:\n")]
    values = [line for line in block.splitlines() if re.match(r"\s+\w+: +[^\s#]", line)]
    assert len(values) > 60
    assert [line for line in values if not re.search(r"# .*\[[SMDA]\]", line)] == []


@pytest.mark.parametrize("start_s", [1, 60, 300])
def test_a_lost_supervisor_or_vhub_is_waited_for_as_long_as_a_start_takes(start_s: int) -> None:
    """Also after the longest pause before it, where the file gives no other time."""
    sets = [f"deadlines.start={start_s} s"]
    longest_ns = start_s * 10**9 + round(WAITS_S[-1] * 1e9)
    deadlines = load_deployment(apply_sets(TABLE_TEXT, "f", sets), "f").deadlines
    assert min(deadlines.orphan_ns, deadlines.vhub_back_ns, UNKNOWN_NS if start_s <= 60 else longest_ns) >= longest_ns
    given = load_deployment(apply_sets(TABLE_TEXT, "f", [*sets, "deadlines.orphan=5 s"]), "f").deadlines
    assert given.orphan_ns == 5 * 10**9 and given.vhub_back_ns == deadlines.vhub_back_ns


def test_who_is_on_board_is_kept_and_clients_too() -> None:
    sets = ("players.player-red.on=red.goal", "clients={laptop: {on: camera}}")
    deployment = load_deployment(apply_sets(TABLE_TEXT, "table.yaml", sets), "table.yaml")
    assert (deployment.players["player-red"].on, deployment.clients["laptop"].on) == ("red.goal", "camera")
    assert deployment.players["player-blue"].on is None


def test_a_selector_over_robots_takes_those_that_have_the_channel() -> None:
    sets = (*BY_PERIOD, "players.player-red.hears={'*': [encoder, beacon]}", "players.player-red.robots={}")
    deployment = load_deployment(apply_sets(TABLE_TEXT, "table.yaml", sets), "table.yaml")
    heard = deployment.heard_by("player-red")
    assert ("camera", "encoder") not in heard and ("red.goal", "encoder") in heard
    assert [pair for pair in heard if pair[1] == "beacon"] == [("player-blue", "beacon")]
