"""The team: it guards, it shoots, both ways round alike, and two of them play a game."""

from __future__ import annotations

from collections.abc import Mapping
from math import cos, hypot, sin
from typing import Any, Final

import pytest

from foosim.client.player import Sample
from foosim.library.generic.delay import delay_ns
from foosim.library.table.ball import BallPosition
from foosim.library.table.encoder import RodPosition
from foosim.library.table.players.football import Keeper, Passive, Striker, Team
from foosim.library.table.players.rod import TURN, Rod, Sight, View
from foosim.library.table.players.senses import Senses, rods_of
from foosim.library.table.players.shot import FULL, LIFTED, Shots
from foosim.library.table.rod_position import Command
from foosim.library.table.settings import LINE_NAMES, table_of
from tests.deployed import DEPLOYMENT

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
def test_the_keeper_is_between_ball_and_goal(name: str, y: float) -> None:
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


# --- rods, feet and shots ---------------------------------------------------------------------------------------------


def rod(line: str = "attack", slide: float = 0.0, swing: float = 0.0) -> Rod:
    """A rod of red, which a player has seen."""
    (found,) = rods_of(DEPLOYMENT, "red", [line])  # type: ignore[list-item]
    found.see(RodPosition(slide, -swing), 0)
    return found


@pytest.mark.parametrize("ahead", [-0.03, 0.0, 0.012, 0.025, 0.04, 0.055])
def test_a_foot_meets_the_ball_at_the_swing_that_is_computed(ahead: float) -> None:
    """The foot's outline is turned, and the ball's distance from it is its radius there and more before."""
    table = table_of(DEPLOYMENT)
    found = rod().contact(ahead)
    assert found is not None

    def gap(swing: float) -> float:
        x, z = ahead, RADIUS - table.rod.axis_height  # of the ball, from the axis
        along, below = x * cos(swing) + z * sin(swing), -(z * cos(swing) - x * sin(swing))
        outside_x = max(abs(along) - table.rod.foot.length / 2, 0.0)
        top = table.rod.foot_radius - table.rod.foot.height
        outside_z = max(below - table.rod.foot_radius, top - below, 0.0)
        return hypot(outside_x, outside_z) - RADIUS

    assert abs(gap(found)) < 1e-9
    assert all(gap(found - 0.01 * step) > 0.0 for step in range(1, 30))


def test_a_ball_out_of_reach_is_not_met() -> None:
    assert rod().contact(0.07) is None and rod().contact(-0.07) is None


@pytest.mark.parametrize(("ahead", "turned"), [(0.03, LIFTED), (-0.03, LIFTED + TURN)])
def test_feet_lift_by_the_way_on_which_they_do_not_hit_the_ball(ahead: float, turned: float) -> None:
    """Straight back with the ball in front; with the ball behind over the top, which ends a whole turn away."""
    held = rod(swing=0.0)
    ball = View(held.u + ahead, 0.0, 0.0, 0.0, RADIUS)
    assert held.turned(LIFTED, ball) == pytest.approx(turned)
    beside = ball._replace(y=0.09)
    assert held.turned(LIFTED, beside) == pytest.approx(LIFTED), "no figure is where the ball is"


def test_a_rod_turns_back_when_the_ball_is_away() -> None:
    held = rod(swing=3 * TURN)
    assert held.turned(0.0, View(held.u + 0.02, 0.09, 0.0, 0.0, RADIUS)) == pytest.approx(3 * TURN)
    assert held.turned(0.0, View(held.u + 0.5, 0.0, 0.0, 0.0, RADIUS)) == 0.0


def test_feet_do_not_turn_over_their_rod_through_a_ball_in_the_air() -> None:
    held = rod(swing=0.1)
    assert held.turned(LIFTED, View(held.u - 0.03, 0.0, 0.0, 0.0, 0.06)) == held.swing


def test_a_ball_that_was_stopped_since_it_was_seen_is_at_the_feet() -> None:
    held = rod()
    seen, ball = View(held.u + 0.06, 0.0, -5.0, 0.0, RADIUS), View(held.u - 0.03, 0.0, -5.0, 0.0, RADIUS)
    found = held.stopped(Sight(ball, seen, True, RADIUS))
    assert found.u - held.u == pytest.approx(0.025) and found.vu == 0.0
    passes = ball._replace(y=0.09), seen._replace(y=0.09)
    assert held.stopped(Sight(*passes, True, RADIUS)) == passes[0], "between the figures it rolls on"
    assert rod(swing=LIFTED).stopped(Sight(ball, seen, True, RADIUS)) == ball, "under lifted feet, too"


def strike(
    ahead: float, *, vu: float = 0.0, is_steady: bool = True, height: float = RADIUS, swing: float = -0.8
) -> Command | None:
    """What a rod of red does with feet drawn back, level with a ball at `ahead` of it."""
    held = rod(swing=swing)
    ball = View(held.u + ahead, 0.0, vu, 0.0, RADIUS)
    sight = Sight(ball, ball, is_steady, height)
    return Shots(held).strike(ball, sight, 1.0, (held.u + 1.0, 0.0))


def speed_at_contact(command: Command | None, ahead: float) -> float:
    """The speed (rad/s) that the rod's loop wants where the foot meets the ball; 0 for feet that stay behind it."""
    contact = rod().contact(ahead)
    assert command is not None and contact is not None
    return max(0.0, table_of(DEPLOYMENT).drive.spin.gain * (-command.spin - contact))


def test_a_ball_at_the_best_place_is_struck_at_full_speed_and_one_that_lies_badly_softly() -> None:
    best = speed_at_contact(strike(0.025), 0.025)
    assert best == pytest.approx(FULL)
    for ahead in (-0.03, 0.05):
        assert 0.0 < speed_at_contact(strike(ahead, swing=-1.6), ahead) < 0.5 * best


def test_a_full_shot_does_not_climb_the_wall() -> None:
    """Friction at the wall turns at most (1 + e) mu of a ball's speed upwards, whatever its spin: it stays inside."""
    table = table_of(DEPLOYMENT)
    foot, walls = table.surfaces.figures, table.surfaces.walls
    heaviest = 3.03e-4  # kg m2, the rod with five figures: no other drives the ball faster
    reach = table.rod.axis_height - RADIUS
    fastest = (1 + foot.restitution) * FULL * reach / (1 + table.ball.mass * reach * reach / heaviest)
    up = (1 + walls.restitution) * walls.friction * fastest
    assert RADIUS + up * up / (2 * table.gravity) < table.walls.height


def test_a_ball_out_of_reach_of_all_figures_is_not_struck() -> None:
    """One at the side wall, where the goalkeeper's stroke ends before."""
    held = rod("goal", swing=-0.8, slide=LINES["goal"].half_stroke)
    for y, is_struck in ((held.half_stroke, True), (held.half_stroke + 0.05, False)):
        ball = View(held.u + 0.025, y, 0.0, 0.0, RADIUS)
        command = Shots(held).strike(ball, Sight(ball, ball, True, RADIUS), 1.0, (held.u + 1.0, y))
        assert (command is not None) == is_struck, y


PRESSED: Final = {"ahead": 0.02, "vu": -1.5, "swing": -1.2}
"""Met behind the best place, as it comes."""


@pytest.mark.parametrize(
    "why", [{"is_steady": False}, {"height": 0.04}, {"vu": -4.0}, {"vu": 3.0}, {"swing": 0.3}, {"ahead": 0.09}, PRESSED]
)
def test_what_cannot_be_struck_low_is_not_struck(why: dict[str, float]) -> None:
    """Just kicked, in the air, too fast, the foot in front of it, out of reach, or pressed down."""
    about: dict[str, Any] = {"ahead": 0.025, **why}
    command = strike(**about)
    assert command is None or speed_at_contact(command, 0.025) == 0.0


def test_the_ball_is_where_it_will_be_when_a_command_arrives() -> None:
    """Older than its packet by the camera's latency; the command is on its way as long as the picture was."""
    latency_ns, link_ns = delay_ns(DEPLOYMENT.robots["camera"].sensors["ball"].modifiers), 20_000_000
    senses, sight = Senses(DEPLOYMENT, "blue", []), None
    for turn in range(1, 9):
        sent_ns = turn * 10_000_000
        ball = BallPosition(3.0 * (sent_ns - latency_ns) * 1e-9, 0.0, RADIUS)
        sample = Sample("camera", "ball", turn, sent_ns, sent_ns + link_ns, ball)
        sight = senses.see((sent_ns + link_ns) // DEPLOYMENT.tick_ns, {("camera", "ball"): sample})
    assert sight is not None and sight.is_steady
    arrives_s = (80_000_000 + link_ns + link_ns) * 1e-9
    assert sight.ball.u == pytest.approx(-3.0 * arrives_s, abs=1e-6), "blue attacks along -x"
    assert sight.ball.vu == pytest.approx(-3.0)


def test_the_keeper_waits_where_the_ball_will_cross_by_the_age_of_the_picture() -> None:
    """Pictures of a ball that comes fast and obliquely, late by the camera's and the link's delay."""
    latency_ns, link_ns = delay_ns(DEPLOYMENT.robots["camera"].sensors["ball"].modifiers), 30_000_000
    assert latency_ns > 0
    keeper = Keeper(DEPLOYMENT, {"team": "red"})
    line = rods_of(DEPLOYMENT, "red", ["goal"])[0]
    start_x, vx, vy = 0.0, -3.0, 0.4
    commands: Mapping[str, Any] = {}
    for turn in range(1, 9):
        sent_ns = turn * 10_000_000
        seen_s = (sent_ns - latency_ns) * 1e-9
        ball = BallPosition(start_x + vx * seen_s, vy * seen_s, RADIUS)
        due_ns = sent_ns + link_ns
        samples = {("camera", "ball"): Sample("camera", "ball", turn, sent_ns, due_ns, ball)}
        samples["red.goal", "encoder"] = Sample("red.goal", "encoder", turn, sent_ns, due_ns, RodPosition(0.0, 0.0))
        commands = keeper.act(due_ns // DEPLOYMENT.tick_ns, samples)
    assert set(commands) == {"red.goal"}, "it commands what it hears"
    crosses_y = vy * (line.u - start_x) / vx
    assert commands["red.goal"].slide == pytest.approx(crosses_y, abs=2e-3)


def test_keeper_and_striker_share_the_rods_and_passive_has_none() -> None:
    rods = {
        (f"red.{line}", "encoder"): Sample(f"red.{line}", "encoder", 0, 0, 0, RodPosition(0.0, 0.0))
        for line in LINE_NAMES
    }
    samples = {**rods, ("camera", "ball"): Sample("camera", "ball", 0, 0, 0, BallPosition(0.0, 0.0, RADIUS))}
    players = (Keeper, Striker, Passive, Team)
    found = {player: set(player(DEPLOYMENT, {"team": "red"}).act(5, samples)) for player in players}
    assert found[Keeper] == {"red.goal", "red.defence"} and found[Striker] == {"red.midfield", "red.attack"}
    assert found[Team] == found[Keeper] | found[Striker] and not found[Passive]
