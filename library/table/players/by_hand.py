"""A team in a person's hands: one rod is held, slid and turned; the others stay where they were left.

The held rod is seen from behind the own goal: forward is towards the other goal, right is the person's right.
"""

from __future__ import annotations

from typing import Final

from foosim.deployment.schema import Deployment
from foosim.library.table.players.rod import Rod
from foosim.library.table.players.senses import rods_of, side_of
from foosim.library.table.rod_position import Command
from foosim.library.table.settings import LINE_NAMES, LineName

DRAWN_RAD: Final = -0.8
KICKED_RAD: Final = 1.2
DRAWN_S: Final = 0.08
KICK_S: Final = 0.12
"""How long feet are drawn back before a shot, and then swing through."""
LIFTED_RAD: Final = -1.7
SWING_RAD_MAX: Final = 2.0


class ByHand:
    """The rods of a team, one of them held. Slides are in m, swings in rad, in the person's view."""

    def __init__(self, deployment: Deployment, team: str) -> None:
        rods = rods_of(deployment, team, LINE_NAMES)
        self._rods: dict[LineName, Rod] = {rod.line: rod for rod in rods}
        self._right = -side_of(team)
        """The sign of y at the person's right: red looks along +x, where -y is."""
        self._slides = dict.fromkeys(self._rods, 0.0)
        self._swings = dict.fromkeys(self._rods, 0.0)
        self._shots: dict[LineName, float] = {}
        """When each shot that is under way began (s)."""
        self.held: LineName | None = next(iter(self._rods), None)

    @property
    def rods(self) -> list[Rod]:
        """The rods that there are, from the own goal on."""
        return [*self._rods.values()]

    def hold(self, line: LineName) -> None:
        """Take hold of another rod; an unknown one changes nothing."""
        if line in self._rods:
            self.held = line

    def next(self, steps: int = 1) -> None:
        """Take hold of the next rod towards the other goal, after the last one of the first."""
        lines = list(self._rods)
        if self.held is not None:
            self.held = lines[(lines.index(self.held) + steps) % len(lines)]

    def slide(self, by: float) -> None:
        """Push the held rod to the right, to its stop at most."""
        if self.held is not None:
            self.slide_to(self._slides[self.held] + by)

    def slide_to(self, right: float) -> None:
        """Set how far right of its middle the held rod is."""
        if self.held is not None:
            most = self._rods[self.held].half_stroke
            self._slides[self.held] = min(max(right, -most), most)

    def swing(self, by: float) -> None:
        """Turn the feet of the held rod forward."""
        if self.held is not None:
            self.swing_to(self._swings[self.held] + by)

    def swing_to(self, forward: float) -> None:
        """Set how far the feet of the held rod are forward of straight down."""
        if self.held is not None:
            self._swings[self.held] = min(max(forward, -SWING_RAD_MAX), SWING_RAD_MAX)

    def lift(self) -> None:
        """Lift the feet of the held rod, so that a ball passes."""
        self.swing_to(LIFTED_RAD)

    def shoot(self, now_s: float) -> None:
        """Draw the feet of the held rod back, then swing them through; afterwards they hang down."""
        if self.held is not None and self.held not in self._shots:
            self._shots[self.held] = now_s
            self._swings[self.held] = 0.0

    def commands(self, now_s: float) -> dict[str, Command]:
        """Return the command of each rod."""
        return {
            rod.name: rod.command(self._right * self._slides[line], self._swing_at(line, now_s))
            for line, rod in self._rods.items()
        }

    def _swing_at(self, line: LineName, now_s: float) -> float:
        begun_s = self._shots.get(line)
        if begun_s is not None:
            if now_s < begun_s + DRAWN_S:
                return DRAWN_RAD
            if now_s < begun_s + DRAWN_S + KICK_S:
                return KICKED_RAD
            del self._shots[line]
        return self._swings[line]
