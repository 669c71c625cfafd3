"""The rules of the table: goal and score, kick-off, dead ball, ball off the table.

They edit frame k before it is solved, in every node alike, with all their memory in the frame. Ties of time are ticks.
"""

from __future__ import annotations

from dataclasses import dataclass

from foosim.common.keyed_random import draw_key, draw_words, unit_interval
from foosim.world.initial_state import kickoff_spot, kickoff_ticks, place_ball
from foosim.world.layout import WORLD, Entity, Layout
from foosim.world.spec import WorldSpec


@dataclass(frozen=True)
class TableRules:
    """The rules' numbers for one deployment, in metres and ticks."""

    goal_x_m: float
    goal_y_m: float
    goal_z_m: float
    end_x_m: float
    side_y_m: float
    kickoff_speed: float
    dead_speed: float
    dead_ticks: int
    out_ticks: int
    wait_ticks: int
    spot: tuple[float, float, float]
    key: bytes

    @classmethod
    def of(cls, spec: WorldSpec) -> TableRules:
        table = spec.table
        tick_ns = spec.tick_ns
        return cls(
            goal_x_m=table.field.length / 2 + table.ball.radius,
            goal_y_m=table.goal.width / 2,
            goal_z_m=table.goal.height,
            end_x_m=table.field.length / 2 + table.walls.thickness + table.goal.depth,
            side_y_m=table.field.width / 2,
            kickoff_speed=table.rules.kickoff_speed,
            dead_speed=table.rules.dead_ball_speed,
            dead_ticks=max(1, table.rules.dead_ball_after_ns // tick_ns),
            out_ticks=max(1, table.rules.off_table_after_ns // tick_ns),
            wait_ticks=kickoff_ticks(spec),
            spot=kickoff_spot(spec),
            key=draw_key(spec.seed, "kickoff"),
        )

    def apply(self, numbers: list[float], layout: Layout) -> None:
        """Apply every rule to every ball of the frame's numbers."""
        for ball in layout.balls:
            self._apply_to(numbers, layout, ball)

    def _apply_to(self, numbers: list[float], layout: Layout, ball: Entity) -> None:
        wait = ball.offsets["wait_ticks"]
        if numbers[wait] > 0.0:
            numbers[wait] -= 1.0
            if numbers[wait] == 0.0:
                self._kick_off(numbers, layout, ball)
            return
        start = ball.offsets["position"]
        x, y, z = numbers[start : start + 3]
        if self.goal_x_m < abs(x) <= self.end_x_m and abs(y) < self.goal_y_m and 0.0 < z < self.goal_z_m:
            scorer = 0 if x > 0.0 else 1
            numbers[layout[WORLD].offsets["score"] + scorer] += 1.0
            self._to_the_spot(numbers, ball)
            return
        self._count_out(numbers, ball, x, y, z)
        self._count_still(numbers, ball)

    def _count_out(self, numbers: list[float], ball: Entity, x: float, y: float, z: float) -> None:
        """A ball beyond the walls or below the floor for long enough returns to the spot; so does one in quarantine."""
        out = ball.offsets["out_ticks"]
        inside = abs(x) <= self.end_x_m and abs(y) <= self.side_y_m and z > 0.0
        quarantined = numbers[ball.offsets["quarantined"]] != 0.0
        numbers[out] = 0.0 if inside and not quarantined else numbers[out] + 1.0
        if numbers[out] >= self.out_ticks:
            self._to_the_spot(numbers, ball)

    def _count_still(self, numbers: list[float], ball: Entity) -> None:
        """A ball at rest for long enough is dead and returns to the spot."""
        still = ball.offsets["still_ticks"]
        start = ball.offsets["linear_velocity"]
        vx, vy, vz = numbers[start : start + 3]
        slow = vx * vx + vy * vy + vz * vz < self.dead_speed * self.dead_speed
        numbers[still] = numbers[still] + 1.0 if slow else 0.0
        if numbers[still] >= self.dead_ticks:
            self._to_the_spot(numbers, ball)

    def _to_the_spot(self, numbers: list[float], ball: Entity) -> None:
        place_ball(numbers, ball, self.spot)
        numbers[ball.offsets["wait_ticks"]] = float(self.wait_ticks)

    def _kick_off(self, numbers: list[float], layout: Layout, ball: Entity) -> None:
        """Roll the ball from the spot in a direction drawn by the number of the kick-off."""
        kickoffs = layout[WORLD].offsets["kickoffs"]
        words = draw_words(self.key, int(numbers[kickoffs]))
        numbers[kickoffs] += 1.0
        along = 1.0 if words[0] & 1 else -1.0
        across = 2.0 * unit_interval(words[1]) - 1.0
        place_ball(numbers, ball, self.spot, (along * self.kickoff_speed, across * self.kickoff_speed, 0.0))
