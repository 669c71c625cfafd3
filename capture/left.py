"""Reads a capture that its writer left unfinished: how far it is, and where a restarted writer continues it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from foosim.capture.foxglove import LOG
from foosim.capture.index import CaptureIndex
from foosim.capture.mcap.checks import CaptureError
from foosim.capture.parts import NEXT, PART, end_of, head_of, number_of, parts_at
from foosim.capture.rows import EPOCHS, FRAME, IN_FLIGHT, PACKETS, TICK
from foosim.capture.state_at import HOLDING, ActiveState
from foosim.common.errors import Malformed
from foosim.common.json_text import decode_json


@dataclass(slots=True)
class Progress:
    """How far a capture is. What has not been written is -1."""

    tick: int = -1
    """The last tick with a row of its own."""
    frame: int = -1
    epoch: int = -1
    in_flight: bool = False
    """Whether the packets in flight at the end of the run are written."""


@dataclass(frozen=True, slots=True)
class Left:
    """An unfinished capture: its last file with its number, and the state at its end.

    `stop` is the end of the last whole chunk of that file, None where the file has its end and the next one is missing.
    `torn_bytes` follow it. `rows` counts rows of ticks, packets, epochs and the log.
    """

    path: Path
    number: int
    stop: int | None
    torn_bytes: int
    head: dict[str, str]
    done: Progress
    in_force: ActiveState
    rows: int


def find_left(path: Path) -> Left | None:
    """Return what the capture that begins at `path` has; None where it has no tick, and is begun again.

    Raises CaptureError for a finished one, and for other files.
    """
    if not parts_at(path):
        return None
    index = CaptureIndex(path, HOLDING, to_damage=True)
    last = index.last_file
    stop, torn_bytes = None, 0
    end = end_of(last)
    if end is not None and NEXT not in end:
        raise CaptureError(f"{last}: is finished; a capture is never overwritten")
    if end is None:
        stop = index.whole_bytes()
        torn_bytes = last.stat().st_size - stop
        index = CaptureIndex(path, HOLDING, stop) if stop else index
    done = progress(index.last)
    if done.tick < 0:
        return None
    head, in_force = head_of(last), ActiveState(str(path))
    for topic in sorted(HOLDING):
        for number in range(len(index.places[topic])):
            in_force.take(index.read(topic, number))
    rows = sum(index.counts[topic] for topic in (TICK, PACKETS, EPOCHS, LOG))
    number = number_of(last, head) if PART in head else 0
    return Left(last, number, stop, torn_bytes, head, done, in_force, rows)


def progress(last: Callable[[str], bytes]) -> Progress:
    """Return how far a capture is, by the last row of each topic, which is empty where there is none."""
    in_flight = _row(last(PACKETS)).get("fate") == IN_FLIGHT
    numbers = (
        _row(last(topic)).get(field, -1) for topic, field in ((TICK, "tick"), (FRAME, "tick"), (EPOCHS, "epoch"))
    )
    tick, frame, epoch = (number if isinstance(number, int) else -1 for number in numbers)
    return Progress(tick, frame, epoch, in_flight)


def _row(data: bytes) -> dict[str, object]:
    try:
        row = decode_json(data)
    except Malformed:
        return {}
    return row if isinstance(row, dict) else {}
