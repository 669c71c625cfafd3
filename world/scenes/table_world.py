"""The football table in the tick of a node: rods with position drives, the rules, and what cannot be."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from foosim.world.components.fitted import actuators_of
from foosim.world.components.view import WritableView
from foosim.world.layout import BALL, Entity, Layout
from foosim.world.robots.foosball_rod import RodRobot
from foosim.world.rules.football import TableRules
from foosim.world.spec import WorldSpec

ROD_SPEED_FACTOR: Final = 1.5
"""A rod's declared speed limit is this many times its drive's: a ball may push it faster than its motor does."""

STOP_DEPTH_M: Final = 0.01
"""How far a rod may be beyond its stroke: joint stops give way a little."""


class TableWorld:
    """The table of one deployment, with the rods and balls of one layout."""

    def __init__(self, spec: WorldSpec, layout: Layout) -> None:
        fitted = {entity.index: actuators_of(spec, layout, entity) for entity in layout.rods}
        self.actuators = {index: actuators for index, actuators in fitted.items() if actuators}
        self.rules = TableRules.of(spec)
        self._layout = layout
        table = spec.table
        self._slide_speed_max = table.drive.slide.speed * ROD_SPEED_FACTOR
        self._spin_speed_max = table.drive.spin.speed * ROD_SPEED_FACTOR
        self._ball_speed_max = table.ball.speed_limit
        margin = table.rules.out_margin
        self._x_max = table.field.length / 2 + margin
        self._y_max = table.field.width / 2 + margin
        self._z_min, self._z_max = -margin, table.walls.height + margin
        tick_s = spec.tick_ns / 1e9
        self._slide_reach_m, self._spin_reach_rad = self._slide_speed_max * tick_s, self._spin_speed_max * tick_s
        self._rods: dict[int, tuple[int, int, float]] = {}
        for entity in layout.rods:
            rod = spec.robots[entity.name]
            assert isinstance(rod, RodRobot)
            self._rods[entity.index] = (
                entity.offsets["joint_positions"],
                entity.offsets["joint_velocities"],
                table.lines[rod.line].half_stroke + STOP_DEPTH_M,
            )
        self._ball_reach_m = self._ball_speed_max * tick_s

    def apply_rules(self, numbers: list[float], layout: Layout) -> None:
        """Edit a frame's numbers by the rules of the table."""
        self.rules.apply(numbers, layout)

    def stir(self, numbers: list[float]) -> None:
        """Kick the ball among turning rods."""
        ball = self._layout[BALL].offsets["linear_velocity"]
        numbers[ball : ball + 3] = [1.0, 0.3, 0.0]
        view = WritableView(0, numbers)
        for fitted in self.actuators.values():
            for one in fitted:
                one.actuator.stir(view)

    def plausible(self, entity: Entity, numbers: Sequence[float], before: Sequence[float]) -> bool:
        """Whether an entity's new, finite state is in the world, within its speed limit and its reach."""
        rod = self._rods.get(entity.index)
        if rod is not None:
            slide, speed, slide_max = rod
            return (
                -slide_max <= numbers[slide] <= slide_max
                and abs(numbers[slide] - before[slide]) <= self._slide_reach_m
                and abs(numbers[slide + 1] - before[slide + 1]) <= self._spin_reach_rad
                and -self._slide_speed_max <= numbers[speed] <= self._slide_speed_max
                and -self._spin_speed_max <= numbers[speed + 1] <= self._spin_speed_max
            )
        start = entity.offsets["position"]
        velocity = entity.offsets["linear_velocity"]
        x, y, z = numbers[start : start + 3]
        vx, vy, vz = numbers[velocity : velocity + 3]
        dx, dy, dz = x - before[start], y - before[start + 1], z - before[start + 2]
        return (
            abs(x) <= self._x_max
            and abs(y) <= self._y_max
            and self._z_min <= z <= self._z_max
            and vx * vx + vy * vy + vz * vz <= self._ball_speed_max * self._ball_speed_max
            and dx * dx + dy * dy + dz * dz <= self._ball_reach_m * self._ball_reach_m
        )
