"""The digest test under faults: a minute of the table, disturbed all the time, is the minute that would have been.

Its run goes as fast as it can, and every kind of fault comes at least five times in random order; at the end the chain
of digests is compared with that of an undisturbed rehearsal.
"""

from __future__ import annotations

from typing import Final

from tests.faults import kinds
from tests.faults.kinds import Figures, Kind, Trial

OF_EACH: Final = 5
TICKS: Final = 30_000
FAULTS: Final = (
    kinds.node_killed,
    kinds.node_hung,
    kinds.node_stuck,
    kinds.node_blinks,
    kinds.link_cut,
    kinds.link_silent,
    kinds.node_stopped,
    kinds.robot_moved,
    kinds.supervisor_killed,
    kinds.vhub_killed,
    kinds.both_killed,
)


def disturbed(trial: Trial, of_each: int = OF_EACH, ticks: int = TICKS) -> Figures:
    """Disturb a run by everything, until it has come so far."""
    todo = [fault for fault in FAULTS for _ in range(of_each)]
    trial.dice.shuffle(todo)
    for fault in todo:
        fault(trial)
    faults = len(todo)
    while trial.cluster.status()["ticks"] < ticks:
        trial.dice.choice(FAULTS)(trial)
        faults += 1
    return {"faults": faults}


DISTURBED: Final = Kind(
    "disturbed", "a minute as fast as it goes, all faults", disturbed, pace="fast", costs=20, trials_a_run=1
)
