"""Which players exist: a function of the frame, as which entities are in it.

A player exists while one of the robots that it commands is present; without such robots, while the robot is present
that carries it; without one, while a robot is present that it hears as its own. Without any of these it always exists.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from foosim.deployment.schema import Deployment, Player
from foosim.vhub.state.members import Member
from foosim.world.component_types.descriptions import ABSENT
from foosim.world.frame import Frame
from foosim.world.layout import Layout


def robots_it_lives_by(deployment: Deployment, player: Player) -> tuple[str, ...]:
    """Return the robots of which one must be present for a player to exist; none for one that always does."""
    commanded = tuple([name for name in player.robots if deployment.robots[name].actuators])
    return commanded or ((player.on,) if player.on is not None else tuple(player.robots))


class Existence:
    """The players of a deployment, as of the newest frame: `turn_to` writes `since` and `absent` of members."""

    def __init__(self, deployment: Deployment) -> None:
        self._robots = {name: sorted(player.robots) for name, player in deployment.players.items()}
        found = {name: robots_it_lives_by(deployment, player) for name, player in sorted(deployment.players.items())}
        self._lives_by = {name: frozenset(robots) for name, robots in found.items() if robots}
        self._layout: Layout | None = None
        self._named: list[str] = []
        self._switches = np.zeros(0, np.intp)
        """Of each robot of these that can leave: the slot that says whether it is absent."""
        self._states = b""
        """What these slots hold in the newest frame; empty where a member has come since."""

    def look_again(self) -> None:
        """A client joins: the next frame says whether it exists."""
        self._states = b""

    def turn_to(self, frame: Frame, members: Mapping[str, Member]) -> list[str]:
        """Take the newest frame; return the members of which `since` or `absent` have become others, in name order."""
        if frame.layout is not self._layout:
            self._layout, self._states = frame.layout, b""
            robots = sorted({name for names in (*self._robots.values(), *self._lives_by.values()) for name in names})
            self._named = [name for name in robots if frame.layout[name].can_leave]
            self._switches = np.array([frame.layout[name].offsets[ABSENT] for name in self._named], np.intp)
        if not self._named:
            return []
        found = frame.values[self._switches]
        states = found.tobytes()
        if states == self._states:
            return []
        self._states = states
        gone = {name for name, is_absent in zip(self._named, found.tolist(), strict=True) if is_absent}
        changed = []
        for name, lives_by in self._lives_by.items():
            member = members.get(name)
            if member is None:
                continue
            before = member.since, member.absent
            member.absent = tuple([robot for robot in self._robots[name] if robot in gone])
            if member.exists is (lives_by <= gone):
                member.since = frame.tick if lives_by - gone else -1
            if before != (member.since, member.absent):
                changed.append(name)
        return changed
