"""b, the unit of this project's figures: a tick of the table in Bullet, with nothing around it.

A tick is one load of all bodies, the substeps and one read. Machines differ by four times, and the same one from hour
to hour, so figures are compared as multiples of it.
"""

from __future__ import annotations

import time
from pathlib import Path
from statistics import median
from typing import Final

from foosim.deployment.loader import apply_sets, load_deployment
from foosim.node.physics.bullet_engine import BulletEngine
from foosim.world.assembly.initial_state import initial_frame

TABLE: Final = Path(__file__).parents[1] / "deploy" / "table.yaml"
BLOCKS: Final = 20
TICKS_OF_A_BLOCK: Final = 50


class BareTable:
    """The table in Bullet, ready to be ticked from the same state again and again."""

    def __init__(self) -> None:
        text = apply_sets(TABLE.read_text(), TABLE.name, ["tick=2 ms", "substeps=4"])
        deployment = load_deployment(text, TABLE.name)
        frame = initial_frame(deployment)
        self._substeps = deployment.substeps
        self._engine = BulletEngine(deployment, frame.layout)
        self._entities = [*frame.layout.of("ball"), *frame.layout.of("rod")]
        self._numbers = frame.values.tolist()

    def run(self, ticks: int) -> None:
        """Compute some ticks."""
        engine, entities, numbers = self._engine, self._entities, self._numbers
        for _ in range(ticks):
            engine.load(entities, numbers)
            engine.step(self._substeps)
            engine.read(entities, numbers)

    def close(self) -> None:
        self._engine.close()


def bare_tick_us() -> float:
    """Return b in us: the median of some blocks of ticks, on the wall."""
    table, blocks = BareTable(), []
    try:
        for _ in range(BLOCKS):
            begun_ns = time.perf_counter_ns()
            table.run(TICKS_OF_A_BLOCK)
            blocks.append((time.perf_counter_ns() - begun_ns) / 1e3 / TICKS_OF_A_BLOCK)
    finally:
        table.close()
    return median(blocks)
