"""The football table: `table:` of a deployment makes the table itself, its ball and its rules."""

from __future__ import annotations

from collections.abc import Iterator
from math import sqrt
from typing import TYPE_CHECKING, Any

from foosim.common.finding import Finding
from foosim.world.components.base import Kit
from foosim.world.forms.registry import kit
from foosim.world.matter.physics import DEFAULT, Contact, Physics, Side
from foosim.world.parameters.table import TABLE, Surface, Table
from foosim.world.parameters.table_checks import table_findings
from foosim.world.parameters.table_presets import PRESETS
from foosim.world.scene import Shape
from foosim.world.scenes.football_table import table_scenery
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

    def findings(self) -> Iterator[Finding]:
        """Yield the scenery that the table's bodies pass through."""
        if self._spec.scenery:
            from foosim.world.clearance.table_clearance import clearance_findings  # brings numpy

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
