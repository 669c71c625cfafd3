"""Seeds of the swarm in several processes."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from functools import partial

from foosim.rehearsal.swarm.campaign import Files, Flown, fly
from foosim.rehearsal.workers import in_processes


def fly_seeds(
    text: str, name: str, seeds: Sequence[int], ticks: int, jobs: int, files: Files = ()
) -> Generator[Flown, None, None]:
    """Fly the seeds in `jobs` processes, and yield their results in the order of the seeds.

    One job is this process. The processes end with the iterator, also amid a seed. Raises Failed when one of them
    was killed.
    """
    return in_processes(partial(fly, text, name, ticks=ticks, files=files), seeds, jobs, "the swarm")
