"""One run of a study: a rehearsal, whatever becomes of it, as figures for a row of the results."""

from __future__ import annotations

import time
import traceback
from typing import Any, NamedTuple

from foosim.client.loading import look_in
from foosim.common.errors import Failed, Refused
from foosim.simulation.run import rehearse
from foosim.simulation.study.study import Run, version_here
from foosim.simulation.workers import leave


class OtherVersion(Failed):
    """A worker has another version of foosim than the study."""


class Ran(NamedTuple):
    """What became of a run: its figures, why it failed (empty where it has not), and its wall time."""

    figures: dict[str, Any]
    message: str
    wall_s: float = 0.0


def ran(run: Run) -> Ran:
    """Return the figures of a run. One that is refused or fails has a message. Raises OtherVersion."""
    if version_here() != run.version:
        raise OtherVersion(f"a worker has foosim {version_here()}, the study has {run.version}")
    look_in(str(run.folder))
    begun_s = time.perf_counter()

    def stuck(result: dict[str, Any]) -> None:
        leave(Ran({}, result["reason"], time.perf_counter() - begun_s))

    try:
        found = rehearse(run.text, run.name, run.ticks, 1, run.sets, folder=run.folder, on_stuck=stuck).json
    except Refused as error:
        return Ran({}, str(error), time.perf_counter() - begun_s)
    except Exception as error:  # noqa: BLE001  # a fault of foosim or of a component in one run, which the others have not
        traceback.print_exc()
        return Ran({}, f"{type(error).__name__}: {error}", time.perf_counter() - begun_s)
    wall_s = time.perf_counter() - begun_s
    if found["failed"] or found["quarantined"]:
        return Ran(
            {}, found["reason"] if found["failed"] else f"in quarantine: {', '.join(found['quarantined'])}", wall_s
        )
    metrics = found["metrics"]
    if bad := [name for name, value in metrics.items() if value is None]:
        return Ran({}, f"a metric is not finite: {', '.join(bad)}", wall_s)
    metrics = {name: float(value) for name, value in metrics.items()}
    packets = {f"packets.{fate}": count for fate, count in found["packets"].items()}
    return Ran(
        {**metrics, "ticks": found["ticks"] - found["first_tick"], **packets, "digest": found["digest"]["chain"]},
        "",
        wall_s,
    )
