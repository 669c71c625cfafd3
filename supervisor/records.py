"""The supervisor's journal: epochs, requests and commits, each written before it is spoken.

A fold gives the run's last committed frame, its epoch, owners and the answers to requests. Neighbours: `core` writes,
`protocol.journal` frames the records in files.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import msgspec

from foosim.protocol.codec import decode_any
from foosim.protocol.deployment import Deployment
from foosim.protocol.frame import Frame, frame_from_bytes, layout_after
from foosim.protocol.messages import Answer, Commit, Edit, Epoch
from foosim.protocol.start import initial_frame


class RunRecord(msgspec.Struct, frozen=True, array_like=True, tag="run", forbid_unknown_fields=True):
    """The first record of a journal: the run and its deployment."""

    run: str
    deployment_name: str
    deployment: str


class RequestRecord(msgspec.Struct, frozen=True, array_like=True, tag="request", forbid_unknown_fields=True):
    """A request whose tick is chosen: what it adds to that tick's order, and its answer."""

    tick: int
    edits: list[Edit]
    answer: Answer


Record = RunRecord | RequestRecord | Epoch | Commit


@dataclass(slots=True)
class History:
    """What a fold of the supervisor's journal gives."""

    run: RunRecord
    frame: Frame
    epoch: Epoch | None = None
    edits: dict[int, list[Edit]] = field(default_factory=dict)
    """Edits of ticks that are not committed yet."""
    answers: dict[str, Answer] = field(default_factory=dict)


def fold(deployment: Deployment, records: Iterable[bytes]) -> History:
    """Return what the records of a journal, in order, say about the run."""
    iterator = iter(records)
    run = decode_any(Record, next(iterator))
    assert isinstance(run, RunRecord), "a journal starts with its run"
    history = History(run, initial_frame(deployment))
    layout = history.frame.layout
    for raw in iterator:
        record = decode_any(Record, raw)
        if isinstance(record, Commit):
            layout = layout_after(layout, record.edits)
            history.frame = frame_from_bytes(record.tick, layout, record.values, record.outboxes)
            history.edits.pop(record.tick - 1, None)
        elif isinstance(record, Epoch):
            history.epoch = record
        elif isinstance(record, RequestRecord):
            history.answers[record.answer.id] = record.answer
            if record.edits:
                history.edits.setdefault(record.tick, []).extend(record.edits)
    return history
