"""Settings of a command line: where they go, what they may say, and that the text that results says the same."""

from pathlib import Path
from typing import get_origin

import pytest

from foosim.common import limits
from foosim.common.errors import DeploymentError
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.deployment.network.rules import Network
from foosim.deployment.overrides import NAMED
from foosim.deployment.schema import Deployment
from foosim.library.table.rod import RodRobot
from foosim.world.component_types.settings import RobotSettings

DEPLOY = Path(__file__).parents[2] / "deploy"
TABLE_TEXT = (DEPLOY / "table.yaml").read_text()
SIDES = ("red", "blue")
ROVERS = [f"rover{number:02}" for number in range(1, 22)]
RED = ("goal", "defence", "midfield", "attack")


def changed(*sets: str) -> Deployment:
    """The deployment of table.yaml with settings, loaded from its canonical text."""
    return load_deployment(apply_sets(TABLE_TEXT, "table.yaml", sets), "canonical")


def refused(*sets: str) -> list[str]:
    """The problems that settings make in table.yaml."""
    with pytest.raises(DeploymentError) as error:
        apply_sets(TABLE_TEXT, "table.yaml", sets)
    return list(error.value.problems)


def test_settings_reach_scalars_lists_and_names_with_dots() -> None:
    deployment = changed(
        "tick=5 ms",
        "seed=7",
        "robots.red.goal.sensors.encoder.rate=50 Hz",
        "network.links.everything.delay=3 ms",
        "network.links[0].loss=0 %",
        "network.links.0.jitter=",
        "nodes.red.robots[4]=camera",
        "table.lines.goal.figures=1",
        'players.player-red.parameters.plan={"on": [1, 2.5, x]}',
    )
    assert (deployment.tick_ns, deployment.seed) == (5_000_000, 7)
    goal = deployment.robots["red.goal"]
    assert isinstance(goal, RodRobot)
    assert goal.sensors["encoder"].rate_hz == 50
    rule = deployment.network.links[0]
    assert (rule.delay_ns, rule.loss, rule.jitter) == (3_000_000, 0.0, None)
    assert deployment.players["player-red"].parameters == {"team": "red", "plan": {"on": [1, 2.5, "x"]}}


def test_a_later_setting_wins_and_may_build_on_an_earlier_one() -> None:
    deployment = changed("network.links=[]", "network.links=[{id: a, from: '*', to: '*'}]", "network.links.a.delay=1 s")
    assert [(rule.id, rule.delay_ns) for rule in deployment.network.links] == [("a", 1_000_000_000)]


def test_a_section_that_the_file_leaves_out_can_be_set() -> None:
    text = TABLE_TEXT[: TABLE_TEXT.index("\ndeadlines:")]
    assert load_deployment(apply_sets(text, "f", ["deadlines.start=5 s"]), "f").deadlines.start_ns == 5_000_000_000
    assert changed("clients.hand={lockstep: false}").clients["hand"].rate_hz is None


def test_sections_whose_keys_are_names_open_no_new_one() -> None:
    """`digests` and `kits` are written by foosim."""
    fields = [*Deployment.model_fields.items(), *RobotSettings.model_fields.items(), *Network.model_fields.items()]
    of_names = {key for key, field in fields if get_origin(field.annotation) is dict}
    assert of_names - {"digests", "kits"} == NAMED - {"templates"}


def test_a_new_name_with_dots_stands_in_quotes() -> None:
    deployment = changed(
        'robots."spare.eye"={model: camera, sensors: {}}',
        "nodes.blue.robots=[blue.goal, blue.defence, blue.midfield, blue.attack, spare.eye]",
    )
    assert deployment.owners()["spare.eye"] == "blue"


@pytest.mark.parametrize(
    ("file", "pattern", "paths"),
    [
        ("table", "robots.red.*.sensors.encoder.rate=50 Hz", [f"robots.red.{rod}.sensors.encoder.rate" for rod in RED]),
        ("table", 'robots."red.*".actuators={}', [f"robots.red.{rod}.actuators" for rod in RED]),
        ("table", "robots.*.goal.sensors.enc?der.rate=50 Hz", [f"robots.{s}.goal.sensors.encoder.rate" for s in SIDES]),
        ("table", "robots.red.goal.*.*.rate=50 Hz", ["robots.red.goal.sensors.encoder.rate"]),
        ("table", "network.links.e*.delay=3 ms", ["network.links[0].delay"]),
        ("table", "robots.red.goal.sensors.*={kind: encoder, rate: 5 Hz}", ["robots.red.goal.sensors.encoder"]),
        ("warehouse", "scenery.*-4.radius=300 mm", ["scenery.pillar-4.radius"]),
        ("warehouse", "robots.*.sensors.pose.rate=10Hz", [f"robots.{name}.sensors.pose.rate" for name in ROVERS]),
        ("warehouse", "robots.rover0?.sensors.pose.modifiers.*.std.heading=0 deg",
         [f"robots.{name}.sensors.pose.modifiers[0].std.heading" for name in ROVERS[:9]]),
        ("warehouse", "network.links.*.delay=3 ms", ["network.links.0.delay", "network.links.1.delay"]),
    ],
)  # fmt: skip
def test_a_pattern_is_a_setting_for_each_path_that_is_there(file: str, pattern: str, paths: list[str]) -> None:
    """Also by a template or a count; `base` and `porter` of the warehouse have no pose."""
    text = (DEPLOY / f"{file}.yaml").read_text()
    value = pattern.partition("=")[2]
    canonical = apply_sets(text, file, [pattern])
    assert canonical == apply_sets(text, file, [f"{path}={value}" for path in paths]) != apply_sets(text, file, [])


def test_each_match_has_a_value_of_its_own() -> None:
    deployment = changed(
        "robots.red.*.sensors.encoder={kind: encoder, rate: 50 Hz}", "robots.red.goal.sensors.encoder.rate=5 Hz"
    )
    assert [deployment.robots[f"red.{rod}"].sensors["encoder"].rate_hz for rod in RED] == [5, 50, 50, 50]


def test_a_key_with_an_asterisk_is_itself() -> None:
    text = (DEPLOY / "warehouse.yaml").read_text()
    usual = "templates.pilot.hears={pilot*: [beacon], pilot0*: [beacon]}"
    deployment = load_deployment(apply_sets(text, "w", [usual, "templates.pilot.hears.pilot*=[fleet]"]), "w")
    assert deployment.players["pilot01"].hears == {"pilot*": ["fleet"], "pilot0*": ["beacon"]}


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("robots.rd.*.model=rod", "--set:1:8: robots: nothing matches (there are: blue.attack, "),
        ("robots.red.*.sensors.encodr.rate=1 Hz", "--set:1:22: robots.red.*.sensors: nothing matches "
         "(there are: encoder), 'encodr', nearest is 'encoder'"),
        ("robot.*.model=rod", "--set:1:1: nothing matches (there are: capture, "),
        ("network.links.x*.delay=0 ms", "--set:1:15: network.links: nothing matches (there are: 0, everything), 'x*'"),
        ("table.lines.GOAL*=1", "--set:1:13: table.lines: nothing matches "
         "(there are: attack, defence, goal, midfield), 'GOAL*', nearest is 'goal'"),
        ("tick.*=1", "--set:1:6: tick: nothing matches (there are: none), '*'"),
    ],
)  # fmt: skip
def test_a_pattern_without_a_match_is_refused_with_the_names_that_are_there(text: str, problem: str) -> None:
    assert refused(text)[0].startswith(problem)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("seed=1\n---\n2", "--set:1:8: more than one YAML document, '---'"),
        ("seed=" + "9" * 5000, "--set:1:1: more than 4096 characters, 5005"),
    ],
)
def test_a_settings_problem_is_placed_in_the_setting(text: str, problem: str) -> None:
    assert refused(text) == [problem]


def test_problems_of_the_file_and_of_all_settings_come_together() -> None:
    bad = TABLE_TEXT.replace("engine: bullet", "engine: bulet")
    line = bad[: bad.index("engine:")].count("\n") + 1
    with pytest.raises(DeploymentError) as error:
        apply_sets(bad, "bad.yaml", ["seed=5", "tik=1 ms", "listen=10.0.0.1:70000"])
    assert error.value.problems[0] == (
        f"bad.yaml:{line}:9: engine: unknown engine (there are: bullet, mujoco, pure), 'bulet', nearest is 'bullet'"
    )
    assert [problem for problem in error.value.problems if problem.startswith("--set")] == [
        "--set:2:1: unknown key, 'tik', nearest is 'tick'",
        "--set:3:8: listen: not an address (HOST, HOST:PORT, tcp/HOST:PORT or tls/HOST:PORT), '10.0.0.1:70000'",
    ]


def test_settings_do_not_lift_the_limits_of_a_file() -> None:
    pages = [f"players.player-red.parameters.p{n}='{'x' * 4000}'" for n in range(20)]
    assert refused(*pages)[0].endswith("deep)")
    deep = "players.player-red.parameters.deep=" + "[" * 15 + "]" * 15
    assert "19 deep" in refused(deep)[0]
    assert refused(*["seed=1"] * 257) == ["--set:257:1: more than 256 settings, 257"]
    assert len(apply_sets(TABLE_TEXT, "f", pages[:5]).encode()) < limits.DEPLOYMENT_BYTES_MAX


def test_settings_change_no_other_text() -> None:
    usual = apply_sets(TABLE_TEXT, "table.yaml", [])
    assert load_deployment(apply_sets(TABLE_TEXT, "table.yaml", ["seed=5", "players={}"]), "x").seed == 5
    assert apply_sets(TABLE_TEXT, "table.yaml", ["seed=1"]) == usual
