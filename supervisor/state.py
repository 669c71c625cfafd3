"""What the supervisor's core stands on, as a record, and the core put on it again.

A head begins a file of the journal, so that the files before it can go.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from foosim.common.units import parse_pace
from foosim.protocol.actions import Journal
from foosim.protocol.codec import encode
from foosim.supervisor.records import Control, HeadRecord, History
from foosim.world.frame import Frame
from foosim.world.initial_state import added_to

if TYPE_CHECKING:
    from foosim.supervisor.core import SupervisorCore


def control_of(core: SupervisorCore) -> Control:
    """Return what people have set."""
    pacer = core.pacer
    people = sorted(core.roster.stopped), dict(core.recovery.returns), dict(core.roster.starts)
    return Control(str(pacer.pace), pacer.paused, pacer.granted, core.stop_at, *people, core.requests.disruptions)


def head_of(core: SupervisorCore) -> bytes:
    """Return the record with which a file of the journal starts."""
    coming, answers = core.requests.journalled()
    orders = {tick: core.orders[tick] for tick in range(core.frame.tick, core.released)}
    head = HeadRecord(
        core.run_record,
        added_to(core.deployment, core.frame.layout),
        core.epoch_payload,
        list(core.commits.values()),
        core.chain,
        sorted((tick, edits) for tick, edits in {**orders, **coming}.items() if edits),
        answers,
        core.owners,
        control_of(core),
        core.account,
        core.pacer.lags,
        core.recovery.recovered,
        core.started_ns,
        core.committed_ns,
        core.end,
        (core.branches.number, core.branches.tick),
        core.requests.issued.forgotten,
        sorted(core.requests.issued.by_tick.items()),
        list(core.requests.asked),
    )
    return encode(head)


def stand_on(core: SupervisorCore, history: History) -> None:
    """Put a core that has not begun where a journal ends, before an epoch."""
    core.frame, core.chain = history.frame, history.chain
    core.released = core.frame.tick
    core.arrivals.stand_at(core.frame.tick, history.branch[0])
    core.commits = dict(history.commits)
    if history.epoch is not None:
        core.epoch, core.owners = history.epoch.epoch, dict(history.epoch.owners)
        core.epoch_payload = encode(history.epoch)
    core.stop_at, core.end, core.account = history.control.stop_at, history.end, history.account
    core.started_ns, core.committed_ns = history.started_ns, history.committed_ns
    control, pacer = history.control, core.pacer
    pacer.pace, pacer.paused, pacer.granted = parse_pace(control.pace), control.paused, control.granted
    pacer.lags = history.lags
    core.roster.stopped, core.roster.starts = set(control.stopped), dict(control.starts)
    core.recovery.recovered, core.recovery.returns = history.recovered, dict(control.returns)
    core.branches.number, core.branches.tick = history.branch
    core.requests.resume(history.edits, history.answers, history.issued, control.disruptions)
    core.requests.asked.extend(history.asked)


def stand_at(core: SupervisorCore, frame: Frame, chain: bytes, commit: bytes) -> None:
    """Put it at a frame that is committed and not the last one in the journal, which begins anew with it."""
    core.frame, core.chain = frame, chain
    core.released = frame.tick
    core.arrivals.stand_at(frame.tick, core.branches.number)
    core.orders.clear()
    core.requests.set_back(frame.tick)
    core.commits = {frame.tick: commit}
    core.actions.append(Journal(head_of(core)))
