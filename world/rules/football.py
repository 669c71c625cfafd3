"""The rules of the table: goal and score, kick-off, dead ball, ball off the table.

They edit frame k before it is solved, in every node alike, with all their memory in the frame. Ties of time are ticks.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, Final

from foosim.common.keyed_random import draw_key, draw_words, unit_interval
from foosim.world.components.entities import Marked, MarkKind, RuleMounting, mounting_of
from foosim.world.components.view import View, WritableView
from foosim.world.forms.registry import rule
from foosim.world.forms.settings import RuleSettings
from foosim.world.layout import WORLD, Entity
from foosim.world.models.ball import Ball
from foosim.world.parameters.table import TEAMS, table_of
from foosim.world.scene import ORIGIN, Vector
from foosim.world.spec import WorldSpec

if TYPE_CHECKING:
    from foosim.world.frame import Frame

OF_BALL: Final = {"still_ticks": 1, "out_ticks": 1, "wait_ticks": 1}
"""Ticks that a ball has been at rest or off the table, and that it still has to wait for its kick-off."""
GOAL, KICKOFF, OUT, DEAD = "goal", "kickoff", "out", "dead"


class FootballSettings(RuleSettings):
    """Counts goals and kicks off; the numbers are the table's `rules`."""


def kickoff_ticks(spec: WorldSpec) -> int:
    """Return how many ticks a ball rests at the kick-off spot."""
    return max(1, table_of(spec).rules.kickoff_delay_ns // spec.tick_ns)


@rule(
    "football",
    FootballSettings,
    slots={"score": 2, "kickoffs": 1},
    each={"ball": OF_BALL},
    writes=("ball",),
    kit="table",
)
class Football:
    """Goal, kick-off, dead ball, ball off the table."""

    mark_kinds: Final = {
        GOAL: MarkKind("score", "goals", is_cut=True),
        KICKOFF: MarkKind("start", "kick-offs", is_cut=True),
        OUT: MarkKind("away", "out", is_cut=True),
        DEAD: MarkKind("rest", "lay still", is_cut=True),
    }

    def __init__(self, settings: FootballSettings, at: RuleMounting) -> None:
        spec = at.spec
        self._name = at.name
        table, tick_ns = table_of(spec), spec.tick_ns
        self._goal_x_m = table.field.length / 2 + table.ball.radius
        self._goal_y_m = table.goal.width / 2
        self._goal_z_m = table.goal.height
        self._end_x_m = table.field.length / 2 + table.walls.thickness + table.goal.depth
        self._side_y_m = table.field.width / 2
        self._kickoff_speed = table.rules.kickoff_speed
        self._dead_speed = table.rules.dead_ball_speed
        self._dead_ticks = max(1, table.rules.dead_ball_after_ns // tick_ns)
        self._out_ticks = max(1, table.rules.off_table_after_ns // tick_ns)
        self._wait_ticks = kickoff_ticks(spec)
        self._spot = (0.0, 0.0, table.ball.radius)
        self._key = draw_key(spec.seed, "kickoff")
        self._score, self._kickoffs = at.slot("score"), at.slot("kickoffs")
        self._balls = [_Ball(at, entity) for entity in at.layout.of("ball")]

    def place(self, view: WritableView) -> None:
        """Let all balls wait for their kick-off."""
        for ball in self._balls:
            view.write(ball.wait, float(self._wait_ticks))

    def apply(self, view: WritableView) -> None:
        """Apply every rule to every ball."""
        for ball in self._balls:
            self._apply_to(ball, view)

    def _apply_to(self, ball: _Ball, view: WritableView) -> None:
        numbers = view.numbers
        waits = numbers[ball.wait.at]
        if waits > 0.0:
            view.write(ball.wait, waits - 1.0)
            if waits == 1.0:
                self._kick_off(ball, view)
            return
        start = ball.position
        x, y, z = numbers[start : start + 3]
        if self._goal_x_m < abs(x) <= self._end_x_m and abs(y) < self._goal_y_m and 0.0 < z < self._goal_z_m:
            red, blue = view.read(self._score)
            view.write(self._score, red + (x > 0.0), blue + (x <= 0.0))
            self._to_the_spot(ball, view)
            return
        self._count_out(ball, view, x, y, z)
        self._count_still(ball, view)

    def _count_out(self, ball: _Ball, view: WritableView, x: float, y: float, z: float) -> None:
        """A ball beyond the walls or below the floor for long enough returns to the spot; so does one in quarantine."""
        numbers = view.numbers
        inside = abs(x) <= self._end_x_m and abs(y) <= self._side_y_m and z > 0.0
        out = 0.0 if inside and numbers[ball.quarantined] == 0.0 else numbers[ball.out.at] + 1.0
        if out != numbers[ball.out.at]:
            view.write(ball.out, out)
            if out >= self._out_ticks:
                self._to_the_spot(ball, view)

    def _count_still(self, ball: _Ball, view: WritableView) -> None:
        """A ball at rest for long enough is dead and returns to the spot."""
        numbers, start = view.numbers, ball.velocity
        vx, vy, vz = numbers[start : start + 3]
        slow = vx * vx + vy * vy + vz * vz < self._dead_speed * self._dead_speed
        still = numbers[ball.still.at] + 1.0 if slow else 0.0
        if still != numbers[ball.still.at]:
            view.write(ball.still, still)
            if still >= self._dead_ticks:
                self._to_the_spot(ball, view)

    def _to_the_spot(self, ball: _Ball, view: WritableView) -> None:
        ball.place(view, self._spot)
        view.write(ball.wait, float(self._wait_ticks))

    def _kick_off(self, ball: _Ball, view: WritableView) -> None:
        """Roll the ball from the spot in a direction drawn by the number of the kick-off."""
        (kickoffs,) = view.read(self._kickoffs)
        words = draw_words(self._key, int(kickoffs))
        view.write(self._kickoffs, kickoffs + 1.0)
        along = 1.0 if words[0] & 1 else -1.0
        across = 2.0 * unit_interval(words[1]) - 1.0
        ball.place(view, self._spot, (along * self._kickoff_speed, across * self._kickoff_speed, 0.0))

    def status(self, view: View) -> dict[str, Any]:
        """Return the goals of both teams."""
        return {"score": dict(zip(TEAMS, map(int, view.read(self._score)), strict=True))}

    @staticmethod
    def text(status: dict[str, Any]) -> str:
        """Return `red 1 : 0 blue`."""
        (red, ours), (blue, theirs) = status["score"].items()
        return f"{red} {ours} : {theirs} {blue}"

    # --- what happened -----------------------------------------------------------------------------------------------

    def marks(self, before: Frame, after: Frame) -> Iterator[Marked]:
        """Yield goals, kick-offs and why balls came back, to the tick: what was counted says when it began."""
        wait = f"{self._name}.wait_ticks"
        returned: list[tuple[int, str]] = []
        kickoffs = 0
        for ball in after.layout.of("ball"):
            if ball.name not in before.layout:
                continue
            waits, waited = int(after.at(ball.name, wait)), int(before.at(ball.name, wait))
            if waits > waited or (waits and not waited):
                returned.append((after.tick - (self._wait_ticks - waits), ball.name))
            if waited and before.tick + waited <= after.tick:
                kickoffs += 1
                yield before.tick + waited, KICKOFF, f"kick-off of {ball.name}"
        goals = self._goals(before, after, [tick for tick, _ in returned])
        yield from goals
        scored = {tick for tick, _, _ in goals}
        for tick, name in returned:
            if tick not in scored:
                yield self._back(before, tick, name)
        counted = f"{self._name}.kickoffs"
        for _ in range(kickoffs, int(after.at(WORLD, counted) - before.at(WORLD, counted))):
            yield after.tick, KICKOFF, "kick-off"

    def _goals(self, before: Frame, after: Frame, returned: Sequence[int]) -> list[Marked]:
        """Return the goals between two frames, each at the tick at which a ball came back, where that is known."""
        ticks, goals = sorted(returned), []
        was, score = (list(map(int, frame.vector(WORLD, f"{self._name}.score", 2))) for frame in (before, after))
        for team, name in enumerate(TEAMS):
            while was[team] < score[team]:
                was[team] += 1
                tick = ticks.pop(0) if ticks else after.tick
                goals.append((tick, GOAL, f"goal of {name}, {was[0]} : {was[1]}"))
        return goals

    def _back(self, before: Frame, tick: int, ball: str) -> Marked:
        """Return why a ball came back to the spot without a goal."""
        if before.at(ball, f"{self._name}.still_ticks") > before.at(ball, f"{self._name}.out_ticks"):
            return tick, DEAD, f"{ball} lay still"
        return tick, OUT, f"{ball} left the table"


class _Ball:
    """Where a ball's numbers are, and what the rules remember of it."""

    def __init__(self, at: RuleMounting, entity: Entity) -> None:
        self.still, self.out, self.wait = (at.of(entity, field) for field in OF_BALL)
        self.position, self.velocity = entity.offsets["position"], entity.offsets["linear_velocity"]
        self.quarantined = entity.offsets["quarantined"]
        self._model = Ball(None, mounting_of(at.spec, at.layout, entity))

    def place(self, view: WritableView, position: Vector, velocity: Vector = ORIGIN) -> None:
        """Set it to a place (m) with a velocity (m/s), and forget what was counted."""
        self._model.place_at(view, position, velocity)
        for slot in (self.still, self.out, self.wait):
            view.write(slot, 0.0)
