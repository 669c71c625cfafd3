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


def bare_tick_us() -> float:
    """Return b in us: the median of some blocks of ticks, on the wall."""
    deployment = load_deployment(apply_sets(TABLE.read_text(), TABLE.name, ["tick=2 ms", "substeps=4"]), TABLE.name)
    frame = initial_frame(deployment)
    engine = BulletEngine(deployment, frame.layout)
    entities = [*frame.layout.of("ball"), *frame.layout.of("rod")]
    numbers = frame.values.tolist()
    blocks = []
    try:
        for _ in range(BLOCKS):
            begun_ns = time.perf_counter_ns()
            for _ in range(TICKS_OF_A_BLOCK):
                engine.load(entities, numbers)
                engine.step(deployment.substeps)
                engine.read(entities, numbers)
            blocks.append((time.perf_counter_ns() - begun_ns) / 1e3 / TICKS_OF_A_BLOCK)
    finally:
        engine.close()
    return median(blocks)
