"""The team: it guards, it shoots, both ways round alike, and two of them play a game."""

from __future__ import annotations

from pathlib import Path

import pytest

from foosim.client.player import Sample
from foosim.common.errors import BadValue, UnknownName
from foosim.deployment.loader import load_deployment
from foosim.players.football import Team
from foosim.rehearsal.run import rehearse
from foosim.world.actuators.rod_position import Command
from foosim.world.parameters.table import LINE_NAMES, table_of
from foosim.world.sensors.ball import BallPosition
from foosim.world.sensors.encoder import RodPosition

TABLE = Path(__file__).parents[2] / "deploy" / "table.yaml"
DEPLOYMENT = load_deployment(TABLE.read_text(), TABLE.name)
LINES = table_of(DEPLOYMENT).lines
RADIUS = table_of(DEPLOYMENT).ball.radius
PERIOD = 5
SIDE = {"red": 1.0, "blue": -1.0}


class Bench:
    """A team whose rods go where they are told within a turn, and a ball that is where the test puts it."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.team = Team(DEPLOYMENT, {"team": name})
        self.rods = {f"{name}.{line}": RodPosition(0.0, 0.0) for line in LINE_NAMES}
        self.turn = 0

    def act(self, x: float, y: float) -> dict[str, Command]:
        """One turn, with the ball at `x` along the direction in which the team attacks, and at `y`."""
        self.turn += 1
        now_ns = self.turn * PERIOD * DEPLOYMENT.tick_ns
        ball = BallPosition(SIDE[self.name] * x, y, RADIUS)
        samples = {("camera", "ball"): Sample("camera", "ball", self.turn, now_ns, now_ns, ball)}
        for name, position in self.rods.items():
            samples[name, "encoder"] = Sample(name, "encoder", self.turn, now_ns, now_ns, position)
        commands: dict[str, Command] = {}
        for name, command in self.team.act(self.turn * PERIOD, samples).items():
            assert isinstance(command, Command)
            commands[name] = command
            self.rods[name] = RodPosition(command.slide, command.spin)
        return commands

    def forward(self, line: str, commands: dict[str, Command]) -> float:
        """How far the feet of a rod are told to swing towards the goal that the team attacks, in rad."""
        # Positive spin moves the feet towards -x, which is where blue attacks.
        return -SIDE[self.name] * commands[f"{self.name}.{line}"].spin


def figures(line: str) -> list[float]:
    """Where the figures of a line stand with the rod in its middle."""
    count, pitch = LINES[line].figures, LINES[line].pitch  # type: ignore[index]
    return [(number - (count - 1) / 2) * pitch for number in range(count)]


@pytest.mark.parametrize("name", ["red", "blue"])
@pytest.mark.parametrize("y", [-0.25, -0.1, 0.0, 0.2])
def test_the_keeper_stands_between_ball_and_goal(name: str, y: float) -> None:
    bench = Bench(name)
    for _ in range(5):
        commands = bench.act(0.0, y)
    goal_x = -table_of(DEPLOYMENT).field.length / 2
    for line in ("goal", "defence"):
        command = commands[f"{name}.{line}"]
        stands = [command.slide + figure for figure in figures(line)]
        share = (LINES[line].x - goal_x) / (0.0 - goal_x)
        passes = [target + (y - target) * share for target in (-0.11, 0.11)]  # on its way to either post
        assert min(passes) - 0.005 <= min(stands, key=lambda at: abs(at - sum(passes) / 2)) <= max(passes) + 0.005
        assert abs(command.spin) < 0.3, "with the feet down"


@pytest.mark.parametrize("name", ["red", "blue"])
@pytest.mark.parametrize("line", ["midfield", "attack"])
def test_the_striker_shoots_a_ball_in_front_of_its_feet(name: str, line: str) -> None:
    bench = Bench(name)
    x, y = LINES[line].x + 0.03, figures(line)[0] + 0.02  # type: ignore[index]
    swings = [bench.forward(line, bench.act(x, y)) for _ in range(20)]
    assert max(swings) > 1.0, swings


@pytest.mark.parametrize("name", ["red", "blue"])
def test_the_striker_lets_the_ball_of_its_own_defence_pass(name: str) -> None:
    bench = Bench(name)
    for _ in range(5):
        commands = bench.act(LINES["defence"].x + 0.1, 0.05)
    for line in ("midfield", "attack"):
        assert bench.forward(line, commands) < -1.0, "feet behind the rod and above the ball"


def test_both_teams_play_alike() -> None:
    """The table is the same from either side; only where a shot aims is each team's own affair."""
    red, blue = Bench("red"), Bench("blue")
    for turn in range(20):
        x, y = 0.01, 0.015 * turn - 0.15
        mine, other = red.act(x, y), blue.act(x, y)
        assert len(mine) == len(LINE_NAMES)
        for line in LINE_NAMES:
            command = mine[f"red.{line}"]
            assert other[f"blue.{line}"] == Command(command.slide, -command.spin)


def test_nothing_is_commanded_before_the_ball_and_the_rod_were_seen() -> None:
    team = Team(DEPLOYMENT, {"team": "red"})
    rod = Sample("red.goal", "encoder", 0, 0, 0, RodPosition(0.0, 0.0))
    ball = Sample("camera", "ball", 0, 0, 0, BallPosition(0.0, 0.0, RADIUS))
    assert dict(team.act(0, {})) == {}
    assert dict(team.act(5, {("red.goal", "encoder"): rod})) == {}
    assert set(team.act(10, {("red.goal", "encoder"): rod, ("camera", "ball"): ball})) == {"red.goal"}


def test_commands_stay_within_reach() -> None:
    bench = Bench("blue")
    for turn in range(200):
        x, y = -0.6 + 0.006 * turn, 0.32 if turn % 2 else -0.32
        for name, command in bench.act(x, y).items():
            assert abs(command.slide) <= LINES[name.removeprefix("blue.")].half_stroke  # type: ignore[index]


def test_parameters_that_are_not_right_are_refused() -> None:
    with pytest.raises(UnknownName, match=r"unknown parameter \(there are: team\), 'tema', nearest is 'team'"):
        Team(DEPLOYMENT, {"tema": "red"})
    with pytest.raises(BadValue, match="parameter team is not one of red, blue, 'green'"):
        Team(DEPLOYMENT, {"team": "green"})
    with pytest.raises(BadValue, match="parameter team is not one of red, blue, null"):
        Team(DEPLOYMENT, {})


def test_two_teams_play_through_the_network() -> None:
    played = rehearse(TABLE.read_text(), TABLE.name, 2000, nodes=2, sets=["engine=pure"]).json
    assert played["packets"]["dropped"] > 0
    still = rehearse(TABLE.read_text(), TABLE.name, 2000, nodes=2, sets=["engine=pure", "players={}"]).json
    assert played["handovers"] > max(2, still["handovers"]), "it is they who move the ball"
