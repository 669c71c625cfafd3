"""A meter of where the time of a tick goes, and an engine that is metered.

Parts are of the wall: on a machine with more work than cores they hold the time of others, too.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Final, ParamSpec, TypeVar

from foosim.deployment.schema import Deployment
from foosim.node.physics.interface import Engine, IslandEngine
from foosim.node.physics.making import engine_of
from foosim.world.layout import Entity, Layout

ENGINE_PARTS: Final = ("load", "command", "step", "read")

P = ParamSpec("P")
T = TypeVar("T")


class Meter:
    """Adds up nanoseconds by part, from `begin` to the last `mark`."""

    def __init__(self) -> None:
        self.parts: dict[str, int] = {}
        self._begin_ns = self._mark_ns = 0
        self._begin_cpu_ns = self._mark_cpu_ns = 0
        self._begin_tick = self._mark_tick = 0
        self._marked: dict[str, int] = {}

    def add(self, part: str, begun_ns: int) -> None:
        """Count the time since `begun_ns`."""
        self.parts[part] = self.parts.get(part, 0) + time.perf_counter_ns() - begun_ns

    def metered(self, part: str, call: Callable[P, T]) -> Callable[P, T]:
        """Return `call`, its time counted."""

        def run(*args: P.args, **kwargs: P.kwargs) -> T:
            begun_ns = time.perf_counter_ns()
            try:
                return call(*args, **kwargs)
            finally:
                self.add(part, begun_ns)

        return run

    @property
    def has_begun(self) -> bool:
        return self._begin_ns > 0

    def begin(self, tick: int) -> None:
        """Forget what was before this tick."""
        self.parts.clear()
        self._begin_ns, self._begin_tick = time.perf_counter_ns(), tick
        self._begin_cpu_ns = time.process_time_ns()

    def mark(self, tick: int) -> None:
        """Count up to here; time after the first mark of the last tick is not counted."""
        if tick == self._mark_tick:
            return
        self._mark_ns, self._mark_tick = time.perf_counter_ns(), tick
        self._mark_cpu_ns = time.process_time_ns()
        self._marked = self.parts.copy()

    def us_per_tick(self) -> dict[str, float]:
        """Return the mean of each part, of the whole tick as `total`, and of its processor time as `cpu`, in us."""
        ticks = self._mark_tick - self._begin_tick
        assert ticks > 0, "too short a run to meter"
        whole = {"total": self._mark_ns - self._begin_ns, "cpu": self._mark_cpu_ns - self._begin_cpu_ns}
        return {part: round(spent / ticks / 1e3, 1) for part, spent in {**self._marked, **whole}.items()}


class MeteredEngine:
    """An engine whose calls are counted."""

    def __init__(self, engine: Engine, meter: Meter) -> None:
        self._engine = engine
        self._meter = meter

    def load(self, entities: Sequence[Entity], state: Sequence[float]) -> None:
        begun_ns = time.perf_counter_ns()
        self._engine.load(entities, state)
        self._meter.add("load", begun_ns)

    def command(self, entities: Sequence[Entity], commands: Sequence[Sequence[tuple[float, ...]]]) -> None:
        begun_ns = time.perf_counter_ns()
        self._engine.command(entities, commands)
        self._meter.add("command", begun_ns)

    def step(self, substeps: int) -> None:
        begun_ns = time.perf_counter_ns()
        self._engine.step(substeps)
        self._meter.add("step", begun_ns)

    def read(self, entities: Sequence[Entity], state: list[float]) -> None:
        begun_ns = time.perf_counter_ns()
        self._engine.read(entities, state)
        self._meter.add("read", begun_ns)

    def close(self) -> None:
        self._engine.close()


def metered_engine(meter: Meter) -> Callable[[Deployment, Layout], Engine]:
    """Return a factory of the deployment's engine, metered."""

    def make(deployment: Deployment, layout: Layout) -> Engine:
        made = engine_of(deployment, layout)
        assert not isinstance(made, IslandEngine), "the table's bodies share a solve"
        return MeteredEngine(made, meter)

    return make
