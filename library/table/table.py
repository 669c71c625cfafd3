"""The football table: `table:` of a deployment makes the table itself, its ball and its rules."""

from __future__ import annotations

from collections.abc import Iterator
from math import sqrt
from typing import TYPE_CHECKING, Any

from foosim.common.finding import Finding
from foosim.library.table.football_table import table_scenery
from foosim.library.table.rod import RodRobot, line_x_m
from foosim.library.table.settings import TABLE, Surface, Table
from foosim.library.table.table_checks import table_findings
from foosim.library.table.table_presets import PRESETS
from foosim.world.component_types.registry import kit
from foosim.world.components.base import Kit
from foosim.world.components.reach import MARGIN_M, Reach
from foosim.world.layout import Layout
from foosim.world.matter.physics import DEFAULT, Contact, Physics, Side
from foosim.world.scene import Shape
from foosim.world.spec import WorldSpec

if TYPE_CHECKING:
    from foosim.world.frame import Frame

BALL = "ball"
"""Name of the ball that every table has; spare ones are `ball-2` and so on."""
WALLS = "walls"
SILENT = frozenset({"floor", "ramps"})
"""What a ball rolls on: its contacts are not logged."""


def _spares(section: Table) -> dict[str, str]:
    return {f"{BALL}-{number + 2}": "ball" for number in range(section.spare_balls)}


@kit(
    TABLE,
    Table,
    entities={BALL: "ball"},
    spares=_spares,
    rules={"football": {"kind": "football"}},
    presets=PRESETS,
)
class TableKit(Kit):
    """A football table with its ball, which rods play by the rules of the game."""

    def __init__(self, section: Table, spec: WorldSpec) -> None:
        self._table, self._spec = section, spec

    def shapes(self) -> tuple[Shape, ...]:
        """Return floor, walls, goals and ramps."""
        return table_scenery(self._table)

    def physics(self) -> Physics:
        """Return what the ball feels: its own sides have the roots of the values of two balls, and any other what makes
        the product with a ball's the value of the pair."""
        table = self._table
        surfaces = {
            name: Contact(surface.restitution, surface.friction, surface.rolling_friction, silent=name in SILENT)
            for name, surface in table.surfaces
            if isinstance(surface, Surface)
        }
        balls = table.surfaces.balls
        between = Contact(balls.restitution, balls.friction)
        bounce, grip = sqrt(between.restitution), sqrt(between.friction)
        sides = {
            name: Side(pair.restitution / bounce, pair.friction / grip, pair.rolling_friction / grip, pair.silent)
            for name, pair in surfaces.items()
        }
        sides[BALL] = Side(bounce, grip)
        sides[DEFAULT] = sides[WALLS]  # of bodies outside of a table
        return Physics(table.gravity, surfaces, between, table.solver_iterations, table.contact_erp, sides)

    def reach(self, layout: Layout) -> Reach:
        """Return the bounding volumes of rods and balls, grown by the speed limit of a ball."""
        table, spec = self._table, self._spec
        rod, rods = table.rod, []
        half = rod.foot.length / 2
        corner = sqrt(rod.foot_radius * rod.foot_radius + half * half)
        for entity in layout.of("rod"):
            robot = spec.robots[entity.name]
            assert isinstance(robot, RodRobot)
            rods.append((entity.index, entity.name, line_x_m(spec, robot)))
        rods.sort(key=lambda rod: (rod[2], rod[1]))
        return Reach(
            ball_m=table.ball.radius + table.ball.speed_limit * (spec.tick_ns / 1e9) + MARGIN_M,
            rods=tuple(rods),
            axes=tuple(axis for _, _, axis in rods),
            half_width_m=corner + MARGIN_M,
            z_low_m=rod.axis_height - corner - MARGIN_M,
            z_high_m=rod.axis_height + corner + MARGIN_M,
            balls=tuple((entity.index, entity.offsets["position"]) for entity in layout.of("ball")),
        )

    def findings(self) -> Iterator[Finding]:
        """Yield the scenery that the table's bodies pass through."""
        if self._spec.scenery:
            from foosim.library.table.table_clearance import clearance_findings  # brings numpy

            yield from clearance_findings(self._spec)

    @staticmethod
    def check(section: Table, spec: WorldSpec) -> Iterator[Finding]:
        """Yield lengths that make no table, and lines with two rods."""
        return table_findings(section, spec)

    def status(self, frame: Frame) -> dict[str, Any]:
        """Return where the ball is (m)."""
        return {"ball": {"position": [round(value, 4) for value in frame.vector(BALL, "position", 3)]}}

    @staticmethod
    def text(status: dict[str, Any]) -> str:
        """Return `ball at 0.123 -0.045 0.018 m`."""
        x, y, z = status["ball"]["position"]
        return f"ball at {x:+.3f} {y:+.3f} {z:+.3f} m"
