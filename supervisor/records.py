"""The supervisor's journal: epochs, requests and commits, each written before it is spoken.

A fold gives the run's last committed frame, its epoch, owners and the answers to requests. Neighbours: `core` writes,
`protocol.journal` frames the records in files.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import msgspec

from foosim.protocol.codec import decode, decode_any
from foosim.protocol.deployment import Deployment
from foosim.protocol.frame import Frame, frame_from_bytes, layout_after
from foosim.protocol.layout import build_layout
from foosim.protocol.messages import AddedEntity, Answer, Commit, Edit, Epoch
from foosim.protocol.start import Start, first_frame


class RunRecord(msgspec.Struct, frozen=True, array_like=True, tag="run", forbid_unknown_fields=True):
    """The first record of a journal: the run and its deployment."""

    run: str
    deployment_name: str
    deployment: str
    start: Start | None = None


class RequestRecord(msgspec.Struct, frozen=True, array_like=True, tag="request", forbid_unknown_fields=True):
    """A request whose tick is chosen: what it adds to that tick's order, and its answer."""

    tick: int
    edits: list[Edit]
    answer: Answer


class HeadRecord(msgspec.Struct, frozen=True, array_like=True, tag="head", forbid_unknown_fields=True):
    """Where a further file of a journal starts: what the files before say and is still needed, so that they can go.

    `added` is the layout of the last commit beside the deployment's; epoch and commit are as they were published.
    """

    run: RunRecord
    added: list[AddedEntity]
    epoch: bytes
    commit: bytes
    edits: list[tuple[int, list[Edit]]]
    answers: list[Answer]


Record = RunRecord | HeadRecord | RequestRecord | Epoch | Commit


@dataclass(slots=True)
class History:
    """What a fold of the supervisor's journal gives."""

    run: RunRecord
    frame: Frame
    epoch: Epoch | None = None
    edits: dict[int, list[Edit]] = field(default_factory=dict)
    """Edits of ticks that are not committed yet."""
    answers: dict[tuple[str, str], Answer] = field(default_factory=dict)
    """By sender and id of the request."""


def fold(deployment: Deployment, records: Iterable[bytes]) -> History:
    """Return what the records of a journal, in order and from the start of one of its files, say about the run."""
    iterator = iter(records)
    history = _begin(deployment, decode_any(Record, next(iterator)))
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
            history.answers[record.answer.sender, record.answer.id] = record.answer
            if record.edits:
                history.edits.setdefault(record.tick, []).extend(record.edits)
    return history


def _begin(deployment: Deployment, first: object) -> History:
    """Return the history that a file's first record stands for."""
    if isinstance(first, RunRecord):
        return History(first, first_frame(deployment, first.start))
    assert isinstance(first, HeadRecord), "a file starts with the run or with what was before it"
    history = History(first.run, first_frame(deployment, first.run.start))
    if first.commit:
        commit = decode(Commit, first.commit)
        layout = build_layout(deployment, [(entity.name, entity.model) for entity in first.added])
        history.frame = frame_from_bytes(commit.tick, layout, commit.values, commit.outboxes)
    if first.epoch:
        history.epoch = decode(Epoch, first.epoch)
    history.edits = {tick: list(edits) for tick, edits in first.edits}
    history.answers = {(answer.sender, answer.id): answer for answer in first.answers}
    return history
