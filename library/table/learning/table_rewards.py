"""Rewards of the football table for environments: where an episode begins, its reward, when it is over.

`functools.partial` gives them settings.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import hypot, pi
from typing import Final, TypeAlias

from foosim.common.errors import BadValue
from foosim.common.keyed_random import draw_key, draw_words, unit_interval
from foosim.deployment.schema import Deployment
from foosim.library.table.settings import TEAMS, table_of
from foosim.world.assembly.world import model_of
from foosim.world.components.view import WritableView
from foosim.world.frame import Frame
from foosim.world.layout import WORLD

Robots: TypeAlias = Mapping[str, tuple[str, ...]]
"""The robots that each agent commands, by the agent's name."""


SCORE: Final = "football.score"
"""The slots in which the rules count the goals of each team."""


def teams_of(deployment: Deployment, robots: Robots) -> dict[str, str]:
    """Return the team of each agent. Raises BadValue for one that does not command the rods of one team."""
    found = {}
    for agent, its in robots.items():
        teams = {getattr(deployment.robots[robot], "team", None) for robot in its}
        if len(teams) != 1 or not teams <= {*TEAMS}:
            raise BadValue("an agent commands the rods of one team, this one", ", ".join(its) or "nothing")
        found[agent] = str(next(iter(teams)))
    return found


def score_of(frame: Frame) -> dict[str, int]:
    """Return the goals of each team of the table."""
    return dict(zip(TEAMS, map(int, frame.vector(WORLD, SCORE, 2)), strict=True))


class Goals:
    """+1 for each goal of an agent's team, -1 for each of the other one. No episode is over by itself."""

    def __init__(self, deployment: Deployment, robots: Robots) -> None:
        """Raises BadValue for an agent that does not command the rods of one team."""
        self._teams = teams_of(deployment, robots)
        self._none = dict.fromkeys(self._teams, 0.0)

    def begin(self, frame: Frame, seed: int) -> Frame:
        """Begin with the frame as it is: the ball waits for its kick-off."""
        return frame

    def rate(self, before: Frame, after: Frame) -> Mapping[str, float]:
        """Return the goals of a step."""
        was, score = before.vector(WORLD, SCORE, 2), after.vector(WORLD, SCORE, 2)
        if was == score:
            return self._none
        ahead = (score[0] - was[0]) - (score[1] - was[1])
        return {agent: ahead if team == TEAMS[0] else -ahead for agent, team in self._teams.items()}

    def is_over(self, frame: Frame) -> bool:
        """It never is."""
        return False


STILL_SPEED: Final = 0.05
"""m/s: a ball that is slower is held."""
UP_RAD: Final = -pi / 2
"""The spin of a rod whose feet are up."""
SET_POINT: Final = ".set_point"
"""The end of the name of the slot in which an actuator keeps set-points."""
SHOT_S: Final = 1.5
"""How long a shot lasts at the most."""


class DefendShot:
    """One shot at a team's goal: +1 when it is saved, -1 when it goes in.

    The ball rolls from a place in the team's half towards a place in its goal, with a speed; all three are drawn. Rods
    that no agent commands have their feet up, out of its way. It is saved when it comes back, lies still, or has not
    gone in after 1.5 s.
    """

    def __init__(
        self,
        deployment: Deployment,
        robots: Robots,
        *,
        speed: tuple[float, float] = (2.0, 5.0),
        start_x: float = 0.2,
        start_y: float = 0.25,
    ) -> None:
        """Speeds are the least and the greatest, in m/s. The ball starts `start_x` m from the field's middle on the
        defenders' side, at most `start_y` m beside it.

        Raises BadValue for these if no such shot can be made, for an agent that does not command the rods of one team,
        and for agents of two teams.
        """
        self._teams = teams_of(deployment, robots)
        if len(set(self._teams.values())) != 1:
            raise BadValue("a shot is defended by one team; agents are of", sorted(set(self._teams.values())))
        team = next(iter(self._teams.values()))
        table = table_of(deployment)
        self._other = next(other for other in TEAMS if other != team)
        self._side = -1.0 if team == "red" else 1.0
        self._deployment, self._speed = deployment, speed
        self._start = start_x, start_y
        self._goal_x, self._radius = table.field.length / 2, table.ball.radius
        if not STILL_SPEED < speed[0] <= speed[1] <= table.ball.speed_limit:
            raise BadValue(
                f"speeds of a shot rise from above {STILL_SPEED} to {table.ball.speed_limit:g} m/s", str(speed)
            )
        for what, value, most in (
            ("start_x", start_x, self._goal_x - self._radius),
            ("start_y", start_y, table.field.width / 2 - self._radius),
        ):
            if not 0.0 <= value <= most:
                raise BadValue(f"{what} of a shot is 0 to {most:g} m", value)
        self._goal_y = table.goal.width / 2 - table.ball.radius
        self._ticks = round(SHOT_S * 1e9 / deployment.tick_ns)
        commanded = {robot for its in robots.values() for robot in its}
        self._lifted = [
            name for name, robot in deployment.robots.items() if robot.model == "rod" and name not in commanded
        ]
        self._begun = self._conceded = 0

    def begin(self, frame: Frame, seed: int) -> Frame:
        """Shoot the ball."""
        words = draw_words(draw_key(seed, "shot"), 0)
        place, aim, pace = (unit_interval(word) for word in words[:3])
        x, y = self._side * self._start[0], (2.0 * place - 1.0) * self._start[1]
        dx, dy = self._side * self._goal_x - x, (2.0 * aim - 1.0) * self._goal_y - y
        speed = (self._speed[0] + pace * (self._speed[1] - self._speed[0])) / hypot(dx, dy)
        self._begun, self._conceded = frame.tick, score_of(frame)[self._other]
        position, velocity = (x, y, self._radius), (speed * dx, speed * dy, 0.0)
        return with_ball(self._deployment, with_feet_up(frame, self._lifted), position, velocity)

    def rate(self, before: Frame, after: Frame) -> Mapping[str, float]:
        """Return 0 until the end, then the result of the shot."""
        worth = 0.0
        if self.is_over(after):
            worth = -1.0 if score_of(after)[self._other] > self._conceded else 1.0
        return dict.fromkeys(self._teams, worth)

    def is_over(self, frame: Frame) -> bool:
        """Whether the shot went in, comes back, lies still or takes too long."""
        if score_of(frame)[self._other] > self._conceded or frame.tick - self._begun >= self._ticks:
            return True
        vx, vy, _ = frame.vector("ball", "linear_velocity", 3)
        return vx * self._side < 0.0 or vx * vx + vy * vy < STILL_SPEED * STILL_SPEED


def with_feet_up(frame: Frame, rods: Sequence[str]) -> Frame:
    """Return a frame in which these rods, at rest, have their feet beside the axis, where their drives hold them."""
    numbers = frame.numbers.copy()
    for name in rods:
        entity = frame.layout[name]
        numbers[entity.offsets["joint_positions"] + 1] = UP_RAD
        for field, at in entity.offsets.items():
            if field.endswith(SET_POINT) and entity.counts[field] == entity.counts["joint_positions"]:
                numbers[at + 1] = UP_RAD
    return Frame(frame.tick, frame.layout, None, frame.outboxes, numbers=numbers)


def with_ball(
    deployment: Deployment,
    frame: Frame,
    position: tuple[float, float, float],
    velocity: tuple[float, float, float],
    ball: str = "ball",
) -> Frame:
    """Return a frame whose ball is at a place (m) with a velocity (m/s), in play and without spin."""
    entity = frame.layout[ball]
    numbers = frame.numbers.copy()
    made = model_of(deployment, frame.layout, entity)
    made.place_at(WritableView(frame.tick, numbers), position, velocity)
    for field, at in entity.offsets.items():
        if field.startswith("football."):  # what the rules count of it: it waits for no kick-off
            numbers[at : at + entity.counts[field]] = [0.0] * entity.counts[field]
    return Frame(frame.tick, frame.layout, None, frame.outboxes, numbers=numbers)
