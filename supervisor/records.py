"""The records of the supervisor's journal, the account of a run, and the fold of a journal.

Each record is written before its message is published. A fold gives everything that a restarted supervisor needs: the
last committed frames, the epoch, the edits of later ticks, answers, pace, and the account. What
belongs together is one record, so that a journal never ends between a request and its effect.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Final, NamedTuple

import msgspec

from foosim.common import limits
from foosim.common.errors import Malformed
from foosim.common.histogram import Lags
from foosim.deployment.schema import Deployment
from foosim.protocol import messages
from foosim.protocol.barrier import Barrier, committed_frame
from foosim.protocol.codec import decode, decode_any, encode
from foosim.protocol.messages import Answer, Commit, End, Epoch
from foosim.world.assembly.initial_state import first_chain, first_frame
from foosim.world.edits import Disrupt, Edit
from foosim.world.frame import Frame, chain_next
from foosim.world.layout import Layout
from foosim.world.start import Start

ANSWERS_KEPT: Final = 1024
"""Answers that are kept for requests that are repeated."""


@dataclass(slots=True)
class Account:
    """Counts of a run. A hand-over is a change of a free body's solver, a move one of a robot's owner."""

    solved_ticks: dict[str, int] = field(default_factory=dict)
    """By node: the ticks in which it solved a body."""
    free_ticks: dict[str, int] = field(default_factory=dict)
    """By node: how often it solved a free body."""
    handovers: int = 0
    moves: int = 0
    solvers: dict[str, str] = field(default_factory=dict)
    """The solver of each free body for the last frame, by the body's name."""

    def count(self, solved: Iterable[str], solvers: dict[str, str]) -> None:
        """Count a committed frame: the nodes that solved a body for it, and the solver of each free body."""
        for name in solved:
            self.solved_ticks[name] = self.solved_ticks.get(name, 0) + 1
        for name, solver in solvers.items():
            self.handovers += self.solvers.get(name, solver) != solver
            self.free_ticks[solver] = self.free_ticks.get(solver, 0) + 1
        self.solvers = solvers


@dataclass(slots=True)
class Recovered:
    """One loss or return. `outage_ns` is the wall time without a commit, -1 until one follows."""

    what: str
    name: str
    reason: str
    tick: int
    epoch: int
    outage_ns: int = -1

    def message(self) -> messages.Recovered:
        """Return it as a commit reports it, when it is over."""
        return messages.Recovered(self.what, self.name, self.reason, self.tick, self.epoch, self.outage_ns)


def close_outages(recovered: Sequence[Recovered], before_ns: int, now_ns: int) -> list[Recovered]:
    """Close the outages that end with the frame committed at `now_ns`; the frame before was at `before_ns`.

    Return those, the oldest first; no more than a commit can report, the next one has the rest.
    """
    first = len(recovered)
    while first > 0 and recovered[first - 1].outage_ns < 0:
        first -= 1
    over = list(recovered[first : first + limits.RECOVERIES_PER_COMMIT_MAX])
    for entry in over:
        entry.outage_ns = max(0, now_ns - before_ns)
    return over


DISRUPTIONS_KEPT: Final = 16


def disruptions_of(tick: int, edits: Iterable[Edit]) -> list[tuple[int, str]]:
    """Return the network events among the edits of a tick: the tick at which each takes effect, the event as JSON."""
    return [(tick + 1, edit.event) for edit in edits if isinstance(edit, Disrupt)]


class RunRecord(msgspec.Struct, frozen=True, array_like=True, tag="run", forbid_unknown_fields=True):
    """The first record of a journal: the run, its deployment, pace and end (0: none).

    `clock` names the monotonic clock whose times the records have: a machine's, since it was started.
    """

    run: str
    deployment_name: str
    deployment: str
    pace: str
    ticks: int
    clock: str
    start: Start | None = None


class Control(msgspec.Struct, frozen=True, array_like=True, tag="control", forbid_unknown_fields=True):
    """What operators have set. `granted` is the tick up to which `step` allows, `returns` has the node that gets an
    adopted robot back, `starts` how often the start of a node was requested, `disruptions` how often an event of the
    network was."""

    pace: str
    paused: bool
    granted: int
    stop_at: int
    stopped: list[str]
    returns: dict[str, str]
    starts: dict[str, int]
    disruptions: int = 0


class RequestSummary(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True):
    """A request that changes something, with the tick and text of its answer."""

    tick: int
    verb: str
    text: str
    who: str
    accepted: bool


REQUESTS_KEPT: Final = 32
SUMMARY_TEXT_MAX: Final = 200


def summary_of(verb: str, answer: Answer) -> RequestSummary:
    """Return the part of a request that is kept for people."""
    return RequestSummary(answer.tick, verb, answer.text[:SUMMARY_TEXT_MAX], answer.sender, answer.accepted)


class RequestRecord(msgspec.Struct, frozen=True, array_like=True, tag="request", forbid_unknown_fields=True):
    """A request whose tick is chosen: the edits for the order of that tick, its answer, and its other effects.

    `owners` are those of the epoch that follows.
    """

    tick: int
    edits: list[Edit]
    answer: Answer
    control: Control
    owners: dict[str, str]
    verb: str = ""


class OrderedRecord(msgspec.Struct, frozen=True, array_like=True, tag="ordered", forbid_unknown_fields=True):
    """Edits of the supervisor's own for the order of a tick."""

    tick: int
    edits: list[Edit]


class CommitRecord(msgspec.Struct, frozen=True, array_like=True, tag="commit", forbid_unknown_fields=True):
    """A commit as it is published, with what the account counts: the nodes that solved a body, the solver of each free
    body, and when it was committed, how late, by the supervisor's clock."""

    commit: bytes
    solved: list[str]
    solvers: dict[str, str]
    now_ns: int
    lag_ns: int


class RecoveredRecord(msgspec.Struct, frozen=True, array_like=True, tag="recovered", forbid_unknown_fields=True):
    """A loss or a return; the epoch that follows has the owners that it leads to."""

    entry: Recovered


class Checkpoint(msgspec.Struct, array_like=True, tag="head", forbid_unknown_fields=True):
    """What is still needed of a journal's records so far: the result of a fold, and the first record of a further file,
    so that the files before can go.

    Epoch and commits are as they were published, the newest last; `edits` are those of uncommitted ticks.
    `disruptions` are the last network events that were requested: the tick at which each takes effect, the event as
    JSON; `requests` the last ones that change something.
    """

    run: RunRecord
    owners: dict[str, str]
    control: Control
    account: Account
    chain: bytes
    epoch: bytes = b""
    commits: list[bytes] = []
    edits: dict[int, list[Edit]] = {}
    answers: list[Answer] = []
    lags: Lags = msgspec.field(default_factory=Lags)
    recovered: list[Recovered] = []
    started_ns: int = 0
    committed_ns: int = 0
    end: End | None = None
    disruptions: list[tuple[int, str]] = []
    requests: list[RequestSummary] = []


Change = RequestRecord | OrderedRecord | Control | CommitRecord | RecoveredRecord | Epoch | End
Record = RunRecord | Checkpoint | Change


class History(NamedTuple):
    """The result of folding the supervisor's journal, and its last committed frame, at first that of the start."""

    kept: Checkpoint
    frame: Frame


Solved = tuple[list[str], dict[str, str]]
"""The nodes that solved a body for a frame, and the solver of each free body, by its name."""


def solved_by(barrier: Barrier, layout: Layout, absent: Collection[int]) -> Solved:
    """Return the nodes that solved a body for a frame, and the solver of each free body; `absent` has the indices of
    absent entities."""
    entities = layout.entities
    solving = [
        name
        for name, part in barrier.parts.items()
        if any(entities[index].is_solved and index not in absent for index in part.solved)
    ]
    present = [body for body in layout.free if body.index not in absent]
    return sorted(solving), {body.name: barrier.solver_of(body.index) for body in present}


def fold(deployment: Deployment, records: Iterable[bytes]) -> History:
    """Return the history of a run from a journal's records, in order and from the start of one of its files.

    Raises Malformed when they are not those of a run of this version.
    """
    kept: Checkpoint | None = None
    for raw in records:
        record = decode_any(Record, raw)
        if isinstance(record, Checkpoint):
            kept = record
        elif isinstance(record, RunRecord):
            kept = _begin(deployment, record)
        elif kept is None:
            raise Malformed("a journal of the supervisor that does not start with its run")
        else:
            _apply(kept, record)
    if kept is None:
        raise Malformed("a journal of the supervisor without a record")
    frame = first_frame(deployment, kept.run.start)
    if kept.epoch:
        decode(Epoch, kept.epoch)
    if commits := [decode(Commit, commit) for commit in kept.commits]:
        frame = committed_frame(commits[-1], frame.layout)
    return History(kept, frame)


def _begin(deployment: Deployment, run: RunRecord) -> Checkpoint:
    """Return what is known of a run at its start."""
    begun = 0 if run.start is None else run.start.origin.tick
    control = Control(run.pace, False, 0, run.ticks and begun + run.ticks, [], {}, {})
    account = Account(dict.fromkeys(sorted(deployment.nodes), 0))
    chain = first_chain(None if run.start is None else run.start.origin)
    return Checkpoint(run, deployment.owners(), control, account, chain)


def _apply(kept: Checkpoint, record: Change) -> None:
    """Take one more record into a history."""
    if isinstance(record, CommitRecord):
        _commit(kept, record)
    elif isinstance(record, Epoch):
        owners = dict(record.owners)
        before = dict(decode(Epoch, kept.epoch).owners) if kept.epoch else kept.owners
        kept.account.moves += sum(before[robot] != owner for robot, owner in owners.items())
        kept.epoch, kept.owners = encode(record), owners
    elif isinstance(record, RequestRecord):
        kept.answers = [*kept.answers, record.answer][-ANSWERS_KEPT:]
        kept.requests = [*kept.requests, summary_of(record.verb, record.answer)][-REQUESTS_KEPT:]
        kept.control, kept.owners = record.control, record.owners
        _order(kept, record)
    elif isinstance(record, OrderedRecord):
        _order(kept, record)
    elif isinstance(record, RecoveredRecord):
        kept.recovered.append(record.entry)
    elif isinstance(record, Control):
        kept.control = record
    else:
        kept.end = record


def _order(kept: Checkpoint, record: RequestRecord | OrderedRecord) -> None:
    if record.edits:
        kept.edits.setdefault(record.tick, []).extend(record.edits)
        kept.disruptions = [*kept.disruptions, *disruptions_of(record.tick, record.edits)][-DISRUPTIONS_KEPT:]


def _commit(kept: Checkpoint, record: CommitRecord) -> None:
    commit = decode(Commit, record.commit)
    kept.commits = [*kept.commits, record.commit][-limits.KEPT_TICKS :]
    kept.edits.pop(commit.tick - 1, None)
    start = kept.run.start
    if commit.tick == (0 if start is None else start.origin.tick):
        kept.started_ns = kept.committed_ns = record.now_ns
        return
    kept.chain = chain_next(kept.chain, commit.digest)
    kept.account.count(record.solved, record.solvers)
    if record.lag_ns >= 0:
        kept.lags.add(record.lag_ns)
    over = close_outages(kept.recovered, kept.committed_ns, record.now_ns)
    for entry, committed in zip(over, commit.recovered, strict=False):
        entry.outage_ns = committed.outage_ns  # the vHub's is longer than that between two commits
    kept.committed_ns = record.now_ns
