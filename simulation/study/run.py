"""One run of a study: a rehearsal, whatever becomes of it, as figures for a row of the results."""

from __future__ import annotations

import time
import traceback
from dataclasses import dataclass
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final, NamedTuple

from foosim.client.loading import look_in
from foosim.common.errors import Failed, Refused
from foosim.protocol.fingerprint import library_fingerprint
from foosim.simulation.run import rehearse
from foosim.simulation.system import Settings, System
from foosim.simulation.workers import leave
from foosim.world.assembly.world import WorldMarks, mark_kinds, world_status
from foosim.world.frame import Frame

OVER: Final = "is_over"
"""Where the status of a world has whether it is over."""
OVER_TICKS: Final = 100
"""Interval in ticks between looks at that."""


def version_here() -> str:
    """Return the version of foosim on this machine, and of the arithmetic of its libraries: `0.2.0+1f0c59a2`."""
    return f"{version('foosim')}+{library_fingerprint().hex()[:8]}"


@dataclass(frozen=True, slots=True)
class Run:
    """A run: the deployment's text, name and folder, what is set, its length, and the version of foosim it is for."""

    text: str
    name: str
    folder: Path
    sets: tuple[str, ...]
    ticks: int
    version: str
    capture: Path | None = None


class OtherVersion(Failed):
    """A worker has another version of foosim than the study."""


class Ran(NamedTuple):
    """What became of a run: its figures, why it failed (empty where it has not), and its wall time."""

    figures: dict[str, Any]
    message: str
    wall_s: float = 0.0


def ran(run: Run) -> Ran:
    """Return the figures of a run, until its ticks have passed or it is over by the rules of the world.

    One that is refused or fails has a message. Raises OtherVersion.
    """
    if version_here() != run.version:
        raise OtherVersion(f"a worker has foosim {version_here()}, the study has {run.version}")
    look_in(str(run.folder))
    begun_s = time.perf_counter()
    figures, message = _figures(run, begun_s)
    return Ran({} if message else figures, message, time.perf_counter() - begun_s)


def _figures(run: Run, begun_s: float) -> tuple[dict[str, Any], str]:
    """Return the figures of a run, and why it failed."""

    def stuck(result: dict[str, Any]) -> None:
        leave(Ran({}, result["reason"], time.perf_counter() - begun_s))

    rules = _Rules()
    settings = Settings(run="study", on_commit=rules.commit)
    where: dict[str, Any] = {"folder": run.folder, "capture": run.capture}
    try:
        found = rehearse(
            *(run.text, run.name, run.ticks, 1, run.sets, settings), prepare=rules.attend, on_stuck=stuck, **where
        ).json
    except Refused as error:
        return {}, str(error)
    except Exception as error:  # noqa: BLE001  # a fault of foosim or a component in this run: others may have none
        traceback.print_exc()
        return {}, f"{type(error).__name__}: {error}"
    metrics: dict[str, float | None] = {**found["metrics"], **rules.counts, "quarantined": len(found["quarantined"])}
    bad = [name for name, value in metrics.items() if value is None]
    message = found["reason"] if found["failed"] else ""
    message = message or (f"not finite: {', '.join(bad)}" if bad else "")
    return {
        **{name: float(value) for name, value in metrics.items() if value is not None},
        "ticks": found["ticks"] - found["first_tick"],
        **{f"packets.{fate}": count for fate, count in found["packets"].items()},
        "digest": found["digest"]["chain"],
    }, message


class _Rules:
    """Counts what the rules of a world mark, by kind, and ends a run that is over by them."""

    def __init__(self) -> None:
        self.counts: dict[str, float] = {}
        """`marks.KIND`: how often the rules have set a mark of the kind."""
        self._before: Frame | None = None

    def attend(self, system: System) -> None:
        """Take the system whose frames are to come."""
        self._system: System | None = system
        self._deployment = system.supervisor.state.deployment
        self._marks = WorldMarks(self._deployment, system.supervisor.state.frame.layout)
        self.counts = {f"marks.{kind}": 0.0 for kind in mark_kinds(self._deployment)}

    def commit(self, frame: Frame) -> None:
        """Look at the frames in their order."""
        if self._before is not None:
            for _, kind, _ in self._marks.between(self._before, frame):
                self.counts[f"marks.{kind}"] += 1.0
        self._before, system = frame, self._system
        if system is not None and frame.tick % OVER_TICKS == 0 and world_status(self._deployment, frame).get(OVER):
            system.soon(partial(system.request, "down"))
            self._system = None
