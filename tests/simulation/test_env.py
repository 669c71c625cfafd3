"""Environments for learning: the checks of their libraries, and the laws of the world in them."""

from __future__ import annotations

import math
import subprocess
import sys
from functools import partial
from pathlib import Path
from typing import Any, Final

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from pettingzoo.test import parallel_api_test, parallel_seed_test

from foosim.capture.start_frame import BadBranch
from foosim.common.errors import BadValue, UnknownName
from foosim.deployment.loader import load_deployment
from foosim.library.table.learning.exercises import ENVIRONMENTS
from foosim.library.table.learning.table_rewards import DefendShot, Goals, score_of, with_ball
from foosim.rendering.cameras import Camera
from foosim.simulation.env import FoosimEnv, FoosimParallelEnv, parallel_env
from foosim.simulation.run import rehearse
from foosim.simulation.simulation import Simulation, read_for_stepping
from foosim.world.frame import Frame
from tests.kinematic_yard import yard_text
from tests.waving import PERFECT, PERIOD, PLAYERS, waved

DEPLOY: Final = Path(__file__).parents[2] / "deploy"
TABLE: Final = DEPLOY / "table.yaml"
WAIT: Final = "table.rules.kickoff_delay=20 ms"
CALM: Final = {"*/position.spin": (-2.0, 2.0)}


SHOT: Final[dict[str, Any]] = {"agents": ["player-red"]}


def played(env: FoosimParallelEnv, steps: int, seed: int | None, **options: Any) -> list[bytes]:
    """Play an episode with actions that follow from its seed; return the digests of its frames."""
    env.reset(seed=seed, options=options)
    found = [env.simulation.frame.digest]
    for step in range(steps):
        actions = {}
        for agent in env.agents:
            space = env.action_space(agent)
            actions[agent] = space.low + (space.high - space.low) * ((step * 7919 % 101) / 100)
        observed, *_ = env.step(actions)
        assert all(env.observation_space(agent).contains(observed[agent]) for agent in observed)
        found.append(env.simulation.frame.digest)
    return found


@pytest.mark.parametrize("network", [False, True])
def test_checks_of_pettingzoo(network: bool) -> None:
    made = partial(parallel_env, TABLE, network=network, reward=Goals, seconds=0.12, bounds=CALM)
    env = made()
    reset = env.reset
    env.reset = lambda seed=None, options=None: reset(seed)  # type: ignore[method-assign]  # its option is unknown
    parallel_api_test(env, 20)
    env.close()
    parallel_seed_test(made, 10)


@pytest.mark.filterwarnings("ignore:.*(infinity|symmetric and normalized)")
@pytest.mark.parametrize("name", [*ENVIRONMENTS])
def test_checks_of_gymnasium(name: str) -> None:
    """What no sensor limits is unbounded, and actions are in SI units: of both the check says that it would not."""
    env = gymnasium.make(name)
    check_env(env.unwrapped)
    env.close()


@pytest.mark.parametrize("network", [False, True])
def test_equal_seeds_give_equal_frames_to_the_bit(network: bool) -> None:
    env, other = (parallel_env(TABLE, network=network, sets=[WAIT], bounds=CALM) for _ in range(2))
    first = played(env, 5, 3)
    second = played(env, 5, None)
    assert played(env, 5, 3) == first, "the engine's past counts for nothing"
    assert played(env, 5, None) == second, "and a row of episodes is that of its seed"
    assert played(other, 5, 3) == first and played(other, 5, None) == second
    assert len({first[-1], second[-1], played(other, 5, 4)[-1]}) == 3
    env.close()
    other.close()


def test_without_a_seed_the_first_episode_has_that_of_the_deployment() -> None:
    env = parallel_env(TABLE, sets=[WAIT, "seed=12"], bounds=CALM)
    assert played(env, 5, None) == played(env, 5, 12)
    env.close()


def test_reset_to_a_captured_frame_goes_on_as_the_capture(tmp_path: Path) -> None:
    """A perfect network brings commands a tick after they were sent, so steps begin one tick after the player's."""
    capture, begin, ticks = tmp_path / "run.mcap", 4 * PERIOD + 1, 60
    sets = [PLAYERS, WAIT, PERFECT, "capture.frames_every=1 ticks"]
    run = rehearse(TABLE.read_text(), TABLE.name, ticks, 1, sets, capture=capture)
    env = FoosimEnv(TABLE, sets=sets)
    columns = [(column.robot, column.field) for column in env.columns[1]]
    env.reset(options={"start": f"{capture}@{begin * 2} ms"})
    while env.simulation.tick + PERIOD <= ticks:
        commands = waved(env.simulation.tick)
        env.step(np.array([getattr(commands[robot], field) for robot, field in columns]))
        assert env.simulation.frame.digest == run.digests[env.simulation.tick - 1]
    assert env.simulation.tick > begin + 5 * PERIOD
    frame = env.simulation.frame
    _, info = env.reset(options={"start": frame})
    assert info["tick"] == frame.tick and env.simulation.frame.digest == frame.digest
    env.close()


def test_processes_step_the_same_worlds() -> None:
    """Vectorised by Gymnasium over processes: each is one world, that of the same environment here."""
    made = partial(FoosimEnv, TABLE, "player-red", sets=(WAIT,), bounds=CALM, seconds=1.0)
    vector = gymnasium.vector.AsyncVectorEnv([made, made])
    single = made()
    try:
        seen, _ = vector.reset(seed=[5, 6])
        actions = np.zeros((2, 8))
        for _ in range(10):
            seen, *_ = vector.step(actions)
        for number, seed in enumerate((5, 6)):
            found, _ = single.reset(seed=seed)
            for _ in range(10):
                found, *_ = single.step(actions[number])
            assert seen[number].tobytes() == found.tobytes()
    finally:
        vector.close()
        single.close()


def test_readings_and_commands_are_those_that_are_chosen() -> None:
    env = parallel_env(TABLE, agents=["player-blue"], readings=["camera/*"], commands=["blue.g*/*"], ages=True)
    readings, commands = env.columns("player-blue")
    assert [column.field for column in readings] == ["x", "y", "z", "age"] and readings[0].unit == "m"
    assert [(column.robot, column.field, column.unit) for column in commands] == [
        ("blue.goal", "slide", "m"),
        ("blue.goal", "spin", "rad"),
    ]
    seen, infos = env.reset(seed=1)
    assert seen["player-blue"][3] == -1.0 and infos["player-blue"] == {"tick": 0, "time_s": 0.0}
    seen, *_ = env.step({})
    assert seen["player-blue"][3] == 0.0, "the camera gives its first picture 10 ms late"
    env.close()
    late = parallel_env(TABLE, network=True, readings=["camera/*"], ages=True)
    seen, _ = late.reset(seed=1)
    assert seen["player-red"].tolist() == [0.0, 0.0, 0.0, -1.0], "nothing has come yet"
    late.step({})
    seen, *_ = late.step({})
    assert 0.002 <= seen["player-red"][3] <= 0.01
    late.close()


@pytest.mark.parametrize(
    ("arguments", "error", "words"),
    [
        ({"rate_hz": 300.0}, BadValue, "whole ticks of 2 ms, '?300 Hz'?, nearest is 250 Hz"),
        ({"agents": ["red"]}, UnknownName, "no player that could be an agent"),
        ({"readings": ["camera/bell"]}, UnknownName, "selects no robot/channel.*camera/ball"),
        ({"commands": ["red.*/force"]}, UnknownName, "selects no robot/channel"),
        ({"bounds": {"*.spim": (0.0, 1.0)}}, UnknownName, "selects no robot/channel.field"),
        ({"bounds": {"*.spin": (1.0, 1.0)}}, BadValue, "the first is below the second"),
        ({"bounds": {"*.slide": (1.0, 2.0)}}, BadValue, "blue.attack/position.slide has -0.1185 to 0.1185"),
        ({"agents": []}, BadValue, "one agent or more"),
        ({"seconds": 0.0}, BadValue, "more than 0, 0"),
        ({"camera": "camera/ball"}, UnknownName, "no camera with images"),
        ({"camera": "camera/ball", "pixels": (32, 18)}, BadValue, "takes camera or pixels"),
        ({"pixels": (320, 0)}, BadValue, "a width and a height"),
        ({"start": "none.mcap@1s"}, BadBranch, "none.mcap: cannot be read"),
        ({"render_mode": "human"}, BadValue, "no render mode"),
        ({"reward": DefendShot}, BadValue, "defended by one team"),
        (SHOT | {"reward": partial(DefendShot, speed=(3.0, 2.0))}, BadValue, "rise from above 0.05 to 40 m/s"),
        (SHOT | {"reward": partial(DefendShot, start_x=0.6)}, BadValue, "start_x of a shot is 0 to 0.5825 m, 0.6"),
    ],
)
def test_arguments_that_are_not_valid(arguments: dict[str, Any], error: type[Exception], words: str) -> None:
    with pytest.raises(error, match=words):
        parallel_env(TABLE, **arguments)


def test_actions_seeds_and_sets_that_are_not_valid() -> None:
    deployment = read_for_stepping(TABLE)
    with pytest.raises(BadValue, match=r"a loaded deployment takes no sets"):
        parallel_env(deployment, sets=["seed=2"])
    together = parallel_env(deployment)
    with pytest.raises(BadValue, match=r"a seed is 0 to .*, -1"):
        together.reset(seed=-1)
    for option in ("sets", "strat"):
        with pytest.raises(UnknownName, match=rf"reset: no such option \(there are: start, or .*\), '{option}'"):
            together.reset(options={option: ["seed=2"]})
    together.reset(seed=2**63 - 1)
    with pytest.raises(UnknownName, match=r"an action of no agent.*player-red"):
        together.step({"red": np.zeros(8)})
    together.close()
    env = FoosimEnv(deployment, "player-red", commands=["red.goal/*"])
    env.reset(seed=1)
    with pytest.raises(BadValue, match=r"an action of shape .*; expected \(2,\)"):
        env.step(np.zeros(3))
    with pytest.raises(BadValue, match=r"slide of red.goal is not finite"):
        env.step(np.array([np.nan, 0.0]))
    with pytest.raises(BadValue, match=r"spin of red.goal is not finite, inf"):
        env.step(np.array([0.0, np.inf]))
    env.step(np.array([9.0, 0.0]))
    assert env.simulation.tick == PERIOD, "what is beyond the limits is clipped"
    env.close()


def test_who_lacks_a_library_is_told_which(monkeypatch: pytest.MonkeyPatch) -> None:
    code = "import sys; sys.modules['pettingzoo'] = None\nimport foosim.simulation.env"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (
        "pettingzoo is not installed, which environments for learning need: pip install 'foosim[learn]'" in done.stderr
    )


# --- rewards of the table -------------------------------------------------------------------------------------------


def shot(frame: Frame, side: float, speed: float) -> Frame:
    """Return a frame whose ball is before a goal, and rolls towards it."""
    return with_ball(read_for_stepping(TABLE), frame, (side * 0.55, 0.05, 0.0175), (side * speed, 0.0, 0.0))


def test_a_goal_is_worth_as_much_to_one_team_as_it_costs_the_other() -> None:
    teams = {"a": ("red.goal", "red.attack"), "b": ("blue.goal",)}
    deployment = read_for_stepping(TABLE, ["players={}"])
    reward = Goals(deployment, teams)
    with Simulation(deployment) as simulation:
        for side, expected in ((1.0, {"a": 1.0, "b": -1.0}), (-1.0, {"a": -1.0, "b": 1.0})):
            before = simulation.reset(shot(simulation.start_frame(), side, 3.0))
            simulation.step(ticks=40)
            assert sum(score_of(simulation.frame).values()) == 1
            assert reward.rate(before, simulation.frame) == expected and not reward.is_over(simulation.frame)


def test_who_has_no_team_gets_no_goals() -> None:
    with pytest.raises(BadValue, match=r"an agent commands the rods of one team"):
        Goals(read_for_stepping(TABLE), {"both": ("red.goal", "blue.goal")})


@pytest.mark.parametrize("team", ["red", "blue"])
def test_a_shot_is_saved_by_a_foot_in_its_way_and_goes_in_without(team: str) -> None:
    """The other rods have their feet up, out of its way."""
    keeper = f"{team}.goal"
    alone = f"players={{keeper: {{class: 'tests.waving:Waver', rate: 100 Hz, robots: {{{keeper}: []}}}}}}"
    env = FoosimEnv(TABLE, sets=[alone], reward=DefendShot)
    worth = []
    for seed in range(6):
        env.reset(seed=seed)
        ball = env.simulation.frame
        x, y, vx, vy = (*ball.vector("ball", "position", 2), *ball.vector("ball", "linear_velocity", 2))
        assert vx * (-1.0 if team == "red" else 1.0) > 0.0
        axis = -0.522 if team == "red" else 0.522
        there = y + vy / vx * (axis - x)
        is_over, found, steps = False, 0.0, 0
        while not is_over:
            _, found, is_over, _, _ = env.step(np.array([there if seed % 2 else -np.sign(there) * 0.123, 0.0]))
            steps += 1
        worth.append(found)
        assert 2 < steps <= 150
    assert worth == [-1.0, 1.0] * 3
    env.close()


def test_an_episode_is_cut_after_its_time() -> None:
    env = parallel_env(TABLE, seconds=0.05)
    env.reset(seed=1)
    ends = [env.step({})[3] for _ in range(5)]
    assert ends[-1] == {"player-blue": True, "player-red": True} and not any(ends[3].values())
    assert env.agents == [] and env.step({}) == ({}, {}, {}, {}, {})
    env.close()


def test_a_picture_of_the_frame() -> None:
    env = gymnasium.make("foosim.simulation.env:foosim/Table-v0", render_mode="rgb_array", pixels=(160, 90))
    assert env.metadata["render_fps"] == 100.0
    env.reset(seed=1)
    picture: Any = env.render()
    assert picture.shape == (90, 160, 3) and picture.dtype == np.uint8
    assert (picture[43:48, 77:83].min(axis=2) > 200).any(), "the ball"
    assert picture[45, 95, 1] > picture[45, 95, [0, 2]].max(), "the field"
    env.close()


def test_a_picture_of_a_camera() -> None:
    lens = "at: {z: 1.2 m}, look_at: {entity: ball}, width: 32, height: 18"
    eye = f"robots.camera.sensors.eye={{kind: camera, rate: 50 Hz, {lens}}}"
    env = parallel_env(TABLE, sets=[eye], camera="camera/eye", render_mode="rgb_array")
    env.reset(seed=1)
    env.step({})
    picture, frame = env.render(), env.simulation.frame
    camera = Camera(env.simulation.deployment, frame.layout, "camera", "eye")
    sight = camera.at(frame.tick, frame.numbers)
    assert picture is not None and sight is not None
    assert picture.shape == (18, 32, 3) and np.array_equal(picture, sight.image()) and picture.std() > 5.0
    env.close()


@pytest.mark.parametrize(
    ("name", "agent", "robot"), [("warehouse", "pilot07", "rover07"), ("yard", "arm-pilot", "arm")]
)
def test_any_deployment_is_an_environment(name: str, agent: str, robot: str) -> None:
    """Robots on wheels by radio, and an arm from a URDF beside rigid bodies: who is no agent acts by itself."""
    env = parallel_env(DEPLOY / f"{name}.yaml", rate_hz=10.0, network=True, agents=[agent], render_mode="rgb_array")
    readings, commands = env.columns(agent)
    assert {column.robot for column in commands} == {robot} and len(readings) > len(commands) > 1
    first = env.reset(seed=3)[0][agent]
    space = env.action_space(agent)
    held = np.nan_to_num((space.low + space.high) / 2, nan=0.0)
    seen, rewards, *_ = env.step({agent: held})
    assert env.observation_space(agent).contains(seen[agent]) and (seen[agent] != first).any()
    assert rewards == {agent: 0.0}
    assert env.render() is not None
    env.close()


def way(env: FoosimEnv) -> float:
    """How far the scout is from the place that its job is about."""
    return math.dist(env.simulation.frame.vector("scout", "position", 2), (1.0, 0.5))


@pytest.mark.parametrize("network", [False, True])
def test_a_job_goes_with_the_steps_and_actions_wait_for_its_end(network: bool) -> None:
    deployment = load_deployment(
        yard_text(
            {
                "scout": {
                    "model": "holonomic",
                    "actuators": {"drive": {"kind": "go_to", "tolerance": "2 cm"}},
                    "sensors": {"jobs": {"kind": "job", "actuator": "drive", "rate": "5 Hz"}},
                }
            }
        ),
        "yard.yaml",
    )
    env = FoosimEnv(deployment, rate_hz=10.0, network=network)
    env.reset()
    before = env.jobs("scout", "drive").call(x=-1.0, y=0.0)
    env.reset()
    jobs = env.jobs("scout", "drive")
    assert jobs is env.jobs("scout", "drive") and jobs.job is None, "another episode"
    job = jobs.call(x=1.0, y=0.5)
    elsewhere = np.array([-5.0, -5.0])
    steps = 0
    while not job.check():
        env.step(elsewhere)
        steps += 1
        assert steps < 100
    assert way(env) < 0.02 and before.number is None
    for _ in range(30):
        env.step(elsewhere)
    assert way(env) > 1.0, "actions command again"
    with pytest.raises(UnknownName, match="no robot of an agent"):
        env.jobs("scuot", "drive")
    env.close()
