"""Players of the football table: a keeper, a striker, the team of both, and one that does nothing.

They see packets only, noisy, late and some lost, and command rods by packets. Each is for either team (parameter
`team`: red or blue), commands the rods that it hears, and accounts for latency: measurements are some
milliseconds old, and commands take effect some milliseconds later.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final, Protocol

from mypy_extensions import mypyc_attr

from foosim.client.player import Commands, Player, Samples
from foosim.common.keyed_random import draw_key, draw_words
from foosim.deployment.schema import Deployment
from foosim.library.table.players.rod import Rod, Sight, View
from foosim.library.table.players.senses import Senses, rods_of, team_of
from foosim.library.table.players.shot import DOWN, LIFTED, Shots
from foosim.library.table.rod_position import Command
from foosim.library.table.settings import LineName, table_of

RESTS_M: Final = 0.06
BEHIND_M: Final = 0.02
"""A ball that lies lower and this far behind the axis is let through under lifted feet."""
POST_M: Final = 0.08
"""The defence guards this far from the goal's middle, on the ball's side; the goalkeeper guards the middle."""
COMING_SPEED: Final = 0.2
COMING_S: Final = 0.5
"""A ball that comes at this speed and is here within this time is awaited where it will pass."""
AIM_INSIDE: Final = 1.6
"""Shots aim this many radii of the ball inside a post."""
AIM_NS: Final = 250_000_000


class Waiting(Protocol):
    """Where a rod waits for a ball that it does not strike now."""

    def y(self, rod: Rod, ball: View) -> float:
        """Return the wanted place of a figure."""


class Guarding:
    """Blocks the way of a ball that comes, or else the line from the ball to the goal."""

    def __init__(self, deployment: Deployment) -> None:
        self._goal_u = -table_of(deployment).field.length / 2

    def y(self, rod: Rod, ball: View) -> float:
        """Return where the ball crosses the rod's line, or where it would on its way to the goal."""
        if ball.vu < -COMING_SPEED:
            time_s = (rod.u - ball.u) / ball.vu
            if time_s < COMING_S:
                return rod.y_after(ball, time_s)
        share = (rod.u - self._goal_u) / max(ball.u - self._goal_u, rod.u - self._goal_u)
        point = 0.0 if rod.line == "goal" else (POST_M if ball.y > 0.0 else -POST_M)
        return point + (ball.y - point) * share


class Following:
    """Stays level with the ball."""

    def y(self, rod: Rod, ball: View) -> float:
        """Return where the ball is when the rod is there, or where it crosses the rod's line."""
        time_s = rod.slide_lag_s
        if ball.vu < -COMING_SPEED and ball.u > rod.u:
            time_s = min((rod.u - ball.u) / ball.vu, COMING_S)
        return rod.y_after(ball, time_s)


class Hand:
    """Plays one rod: strikes balls in reach, and otherwise waits in its own way."""

    def __init__(self, rod: Rod, waiting: Waiting) -> None:
        self.rod = rod
        self._waiting = waiting
        self._shots = Shots(rod)

    def move(self, sight: Sight, arrives_s: float, goal: tuple[float, float]) -> Command:
        """Return the rod's next command, which is there at `arrives_s`."""
        ball = self.rod.stopped(sight)
        return self._shots.strike(ball, sight, arrives_s, goal) or self._wait(ball)

    def _wait(self, ball: View) -> Command:
        rod = self.rod
        y = rod.y_after(ball, rod.slide_lag_s)
        if ball.u < rod.u - BEHIND_M and ball.z < RESTS_M:
            return rod.command(rod.slide_to(y), rod.turned(LIFTED, ball))
        return rod.command(rod.slide_to(self._waiting.y(rod, ball)), rod.turned(DOWN, ball))


class Playing:
    """Rods in hands, and the ball between them."""

    def __init__(self, deployment: Deployment, team: str, hands: Sequence[Hand]) -> None:
        table = table_of(deployment)
        self._tick_ns = deployment.tick_ns
        self._hands = hands
        self._senses = Senses(deployment, team, [hand.rod for hand in hands])
        self._goal_u = table.field.length / 2
        self._aim_y = table.goal.width / 2 - AIM_INSIDE * table.ball.radius
        self._aim_key = draw_key(deployment.seed, "aim", team)

    def act(self, tick: int, samples: Samples) -> Commands:
        """Return the command of each rod with a reading."""
        sight = self._senses.see(tick, samples)
        if sight is None:
            return {}
        arrives = tick + self._senses.reach_ticks
        goal = (self._goal_u, self._aim(tick))
        commands: dict[str, Command] = {}
        for hand in self._hands:
            if hand.rod.seen:
                command = hand.move(sight, arrives * self._tick_ns * 1e-9, goal)
                hand.rod.note(command, arrives)
                commands[hand.rod.name] = command
        return commands

    def _aim(self, tick: int) -> float:
        """Return the y at which shots aim in this quarter of a second: a keyed draw, so that it is unpredictable."""
        word = draw_words(self._aim_key, tick * self._tick_ns // AIM_NS)[0]
        return self._aim_y if word & 1 else -self._aim_y


def _hands(deployment: Deployment, team: str, waiting: Waiting, lines: Sequence[LineName]) -> list[Hand]:
    return [Hand(rod, waiting) for rod in rods_of(deployment, team, lines)]


def _keeper(deployment: Deployment, team: str) -> list[Hand]:
    return _hands(deployment, team, Guarding(deployment), ("goal", "defence"))


def _striker(deployment: Deployment, team: str) -> list[Hand]:
    return _hands(deployment, team, Following(), ("midfield", "attack"))


@mypyc_attr(allow_interpreted_subclasses=True)
class Keeper(Player):
    """Guards with the goal and defence rods, and clears balls in reach. Parameter: `team`, red or blue."""

    def __init__(self, deployment: Deployment, parameters: Mapping[str, Any]) -> None:
        team = team_of(parameters)
        self._playing = Playing(deployment, team, _keeper(deployment, team))

    def act(self, tick: int, samples: Samples) -> Commands:
        """Return the command of each rod."""
        return self._playing.act(tick, samples)


@mypyc_attr(allow_interpreted_subclasses=True)
class Striker(Player):
    """Takes the ball, aims and shoots low with the midfield and attack rods. Parameter: `team`, red or blue."""

    def __init__(self, deployment: Deployment, parameters: Mapping[str, Any]) -> None:
        team = team_of(parameters)
        self._playing = Playing(deployment, team, _striker(deployment, team))

    def act(self, tick: int, samples: Samples) -> Commands:
        """Return the command of each rod."""
        return self._playing.act(tick, samples)


@mypyc_attr(allow_interpreted_subclasses=True)
class Team(Player):
    """A keeper and a striker for one team. Parameter: `team`, red or blue."""

    def __init__(self, deployment: Deployment, parameters: Mapping[str, Any]) -> None:
        team = team_of(parameters)
        self._playing = Playing(deployment, team, [*_keeper(deployment, team), *_striker(deployment, team)])

    def act(self, tick: int, samples: Samples) -> Commands:
        """Return the command of each rod."""
        return self._playing.act(tick, samples)


@mypyc_attr(allow_interpreted_subclasses=True)
class Passive(Player):
    """Does nothing: its rods rest. Parameter: `team`, red or blue."""

    def __init__(self, deployment: Deployment, parameters: Mapping[str, Any]) -> None:
        team_of(parameters)

    def act(self, tick: int, samples: Samples) -> Commands:
        """Return no command."""
        return {}
