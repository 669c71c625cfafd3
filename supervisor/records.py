"""The records of the supervisor's journal, the account of a run, and the fold of a journal.

Each record is written before its message is published. A fold gives everything that a restarted supervisor needs: the
last committed frames, the epoch, the edits of later ticks, answers, pace, and the account. What
belongs together is one record, so that a journal never ends between a request and its effect.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Final

import msgspec

from foosim.common import limits
from foosim.common.errors import Malformed
from foosim.common.histogram import Lags
from foosim.deployment.schema import Deployment
from foosim.protocol import messages
from foosim.protocol.barrier import Barrier
from foosim.protocol.codec import decode, decode_any
from foosim.protocol.kept_answers import KeptAnswers
from foosim.protocol.messages import Answer, Commit, End, Epoch
from foosim.world.assembly.initial_state import first_chain, first_frame
from foosim.world.edits import Disrupt, Edit
from foosim.world.frame import CHAIN_START, Frame, chain_next, frame_from_bytes
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


class Checkpoint(msgspec.Struct, frozen=True, array_like=True, tag="head", forbid_unknown_fields=True):
    """The first record of a further journal file: what is still needed of the files before, so that they can go.

    Epoch and commits are as they were published.
    """

    run: RunRecord
    epoch: bytes
    commits: list[bytes]
    chain: bytes
    edits: list[tuple[int, list[Edit]]]
    answers: list[Answer]
    owners: dict[str, str]
    control: Control
    account: Account
    lags: Lags
    recovered: list[Recovered]
    started_ns: int
    committed_ns: int
    end: End | None
    disruptions: list[tuple[int, str]] = []
    requests: list[RequestSummary] = []


Change = RequestRecord | OrderedRecord | Control | CommitRecord | RecoveredRecord | Epoch | End
Record = RunRecord | Checkpoint | Change


@dataclass(slots=True)
class History:
    """The result of folding the supervisor's journal."""

    run: RunRecord
    frame: Frame
    """The last committed one, at first that of the start."""
    owners: dict[str, str]
    control: Control
    account: Account
    epoch: Epoch | None = None
    commits: dict[int, bytes] = field(default_factory=dict)
    """The last ones, by tick, as they were published."""
    chain: bytes = CHAIN_START
    edits: dict[int, list[Edit]] = field(default_factory=dict)
    """Edits of uncommitted ticks."""
    answers: KeptAnswers = field(default_factory=lambda: KeptAnswers(ANSWERS_KEPT))
    """By sender and id of the request."""
    lags: Lags = field(default_factory=Lags)
    recovered: list[Recovered] = field(default_factory=list)
    started_ns: int = 0
    committed_ns: int = 0
    end: End | None = None
    disruptions: list[tuple[int, str]] = field(default_factory=list)
    """The last network events that were requested: the tick at which each takes effect, the event as JSON."""
    requests: list[RequestSummary] = field(default_factory=list)
    """The last requests that change something."""


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
    history: History | None = None
    for raw in records:
        record = decode_any(Record, raw)
        if isinstance(record, RunRecord | Checkpoint):
            history = _begin(deployment, record)
        elif history is None:
            raise Malformed("a journal of the supervisor that does not start with its run")
        else:
            _apply(history, record)
    if history is None:
        raise Malformed("a journal of the supervisor without a record")
    if history.commits:
        commit = decode(Commit, history.commits[max(history.commits)])
        history.frame = frame_from_bytes(commit.tick, history.frame.layout, commit.values, commit.outboxes)
        if history.frame.digest != commit.digest:
            raise Malformed(f"commit {commit.tick} of the supervisor's journal has another digest than its frame")
    return history


def _begin(deployment: Deployment, first: RunRecord | Checkpoint) -> History:
    """Return the history of a file's first record."""
    if isinstance(first, RunRecord):
        begun = 0 if first.start is None else first.start.origin.tick
        control = Control(first.pace, False, 0, first.ticks and begun + first.ticks, [], {}, {})
        account = Account(dict.fromkeys(sorted(deployment.nodes), 0))
        frame = first_frame(deployment, first.start)
        chain = first_chain(None if first.start is None else first.start.origin)
        return History(first, frame, deployment.owners(), control, account, chain=chain)
    return History(
        first.run,
        first_frame(deployment, first.run.start),
        first.owners,
        first.control,
        first.account,
        epoch=decode(Epoch, first.epoch) if first.epoch else None,
        commits={decode(Commit, raw).tick: raw for raw in first.commits},
        chain=first.chain,
        edits={tick: list(edits) for tick, edits in first.edits},
        answers=KeptAnswers(ANSWERS_KEPT, first.answers),
        lags=first.lags,
        recovered=first.recovered,
        started_ns=first.started_ns,
        committed_ns=first.committed_ns,
        end=first.end,
        disruptions=list(first.disruptions),
        requests=list(first.requests),
    )


def _apply(history: History, record: Change) -> None:
    """Take one more record into a history."""
    if isinstance(record, CommitRecord):
        _commit(history, record)
    elif isinstance(record, Epoch):
        owners = dict(record.owners)
        before = dict(history.owners if history.epoch is None else history.epoch.owners)
        history.account.moves += sum(before[robot] != owner for robot, owner in owners.items())
        history.epoch, history.owners = record, owners
    elif isinstance(record, RequestRecord):
        history.answers.keep(record.answer)
        history.requests = [*history.requests, summary_of(record.verb, record.answer)][-REQUESTS_KEPT:]
        history.control, history.owners = record.control, record.owners
        _order(history, record)
    elif isinstance(record, OrderedRecord):
        _order(history, record)
    elif isinstance(record, RecoveredRecord):
        history.recovered.append(record.entry)
    elif isinstance(record, Control):
        history.control = record
    else:
        history.end = record


def _order(history: History, record: RequestRecord | OrderedRecord) -> None:
    if record.edits:
        history.edits.setdefault(record.tick, []).extend(record.edits)
        history.disruptions = [*history.disruptions, *disruptions_of(record.tick, record.edits)][-DISRUPTIONS_KEPT:]


def _commit(history: History, record: CommitRecord) -> None:
    commit = decode(Commit, record.commit)
    history.commits[commit.tick] = record.commit
    history.commits.pop(commit.tick - limits.KEPT_TICKS, None)
    history.edits.pop(commit.tick - 1, None)
    start = history.run.start
    if commit.tick == (0 if start is None else start.origin.tick):
        history.started_ns = history.committed_ns = record.now_ns
        return
    history.chain = chain_next(history.chain, commit.digest)
    history.account.count(record.solved, record.solvers)
    if record.lag_ns >= 0:
        history.lags.add(record.lag_ns)
    over = close_outages(history.recovered, history.committed_ns, record.now_ns)
    for entry, committed in zip(over, commit.recovered, strict=False):
        entry.outage_ns = committed.outage_ns  # the vHub's is longer than that between two commits
    history.committed_ns = record.now_ns
