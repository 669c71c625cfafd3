"""Laws on the trace of the bus: write before you speak, committed frames only, one solver, epochs that only grow.

The checks are functions of a trace; each is also shown a planted fault and must see it.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from foosim.protocol import channels
from foosim.protocol.actions import Journal, Publish
from foosim.protocol.codec import decode, decode_any, encode
from foosim.protocol.messages import Commit, Deliveries, Epoch, Go, Part
from foosim.simulation.run import rehearse
from foosim.simulation.settings import Traced
from foosim.simulation.system import Settings
from foosim.supervisor.core import SupervisorCore
from foosim.supervisor.records import CommitRecord
from foosim.supervisor.records import Record as SupervisorRecord
from foosim.vhub.core import HubCore
from foosim.vhub.state.hub_state import HubState
from foosim.vhub.state.records import HubRecord, TickRecord
from foosim.world.frame import Frame
from foosim.world.layout import build_layout

TABLE = Path(__file__).parents[2] / "deploy" / "table.yaml"
TICKS = 200


def trace_of(settings: Settings | None = None, nodes: int = 2, moves: bool = False) -> list[Traced]:
    """Rehearse the table on the pure engine and return everything that was journalled, published and received."""
    trace: list[Traced] = []
    settings = settings or Settings()
    settings.observer = trace.append

    def prepare(system) -> None:  # type: ignore[no-untyped-def]
        for tick, node in ((20, "n2"), (40, "n1"), (90, "n2"), (91, "n1")):
            system.at_tick(tick, lambda node=node: system.request("move", robot="red.goal", node=node))

    rehearse(TABLE.read_text(), TABLE.name, TICKS, nodes, ["engine=pure"], settings, prepare=prepare if moves else None)
    return trace


def spoken_before_written(trace: Sequence[Traced]) -> list[str]:
    """Deliveries before the record of their closing, or a commit or epoch before its record."""
    faults = []
    written: dict[str, set[bytes]] = {channels.SUPERVISOR: set(), channels.VHUB: set()}
    closed: set[int] = {-1}
    for traced in trace:
        if traced.what == "journal":
            written[traced.process].add(traced.payload)
            if traced.process == channels.VHUB:
                record = decode_any(HubRecord, traced.payload)
                if isinstance(record, TickRecord):
                    closed.add(record.tick)
            elif isinstance(commit := decode_any(SupervisorRecord, traced.payload), CommitRecord):
                written[traced.process].add(commit.commit)
        elif traced.what == "publish" and traced.channel == channels.DELIVERIES.name:
            tick = decode(Deliveries, traced.payload).tick
            if tick - 1 not in closed:
                faults.append(f"deliveries {tick} before the record of tick {tick - 1}")
        elif traced.what == "publish" and traced.channel in (channels.COMMIT.name, channels.EPOCH.name):
            known = traced.payload in written[channels.SUPERVISOR]
            faults += [] if known else [f"{traced.channel} before its record"]
    return faults


def uncommitted_spoken(trace: Sequence[Traced]) -> list[str]:
    """A Go, or the deliveries of the tick after, before the supervisor has published the commit."""
    faults = []
    committed: set[int] = set()
    for traced in trace:
        if traced.what != "publish":
            continue
        if traced.channel == channels.COMMIT.name:
            committed.add(decode(Commit, traced.payload).tick)
        elif traced.channel == channels.DELIVERIES.name:
            tick = decode(Deliveries, traced.payload).tick
            if tick > 0 and tick - 1 not in committed:
                faults.append(f"deliveries {tick} from a frame that is not committed")
        elif traced.channel == channels.DOWN.name:
            message = decode_any(channels.DOWN.message, traced.payload)
            if isinstance(message, Go) and message.tick not in committed:
                faults.append(f"Go {message.tick} from a frame that is not committed")
    return faults


def two_solvers(trace: Sequence[Traced], entities: int) -> list[str]:
    """An entity with no or two solvers in a tick of an epoch; ticks or epochs that fall."""
    faults = []
    solved: dict[tuple[int, int], dict[str, list[int]]] = {}
    epoch = tick = 0
    for traced in trace:
        if traced.what != "publish":
            continue
        if traced.channel == channels.EPOCH.name:
            message = decode(Epoch, traced.payload)
            if message.epoch < epoch:
                faults.append(f"epoch {message.epoch} after {epoch}")
            epoch = message.epoch
        elif traced.channel == channels.PART.name:
            part = decode(Part, traced.payload)
            solved.setdefault((part.epoch, part.tick), {})[part.node] = part.solved
        elif traced.channel == channels.COMMIT.name:
            commit = decode(Commit, traced.payload)
            if commit.tick > 0 and commit.tick != tick + 1:
                faults.append(f"commit {commit.tick} after {tick}")
            tick = commit.tick
            parts = solved.get((commit.epoch, commit.tick), {})
            claimed = sorted(index for indices in parts.values() for index in indices)
            if commit.tick > 0 and claimed != list(range(entities)):
                faults.append(f"tick {commit.tick}: entities {claimed}")
    return faults


def test_the_system_writes_before_it_speaks() -> None:
    trace = trace_of(moves=True)
    said = [traced for traced in trace if traced.channel == channels.DELIVERIES.name and traced.what == "publish"]
    deliveries = [decode(Deliveries, traced.payload) for traced in said]
    ticks = [tick for each in deliveries for tick in range(each.tick, each.last + 1)]
    assert ticks[: TICKS + 1] == list(range(TICKS + 1)) and len(deliveries) < TICKS, "each once, some together"
    assert spoken_before_written(trace) == []


def test_deliveries_that_are_final_early_change_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    early = rehearse(TABLE.read_text(), TABLE.name, TICKS, 2, ["engine=pure"]).digests
    monkeypatch.setattr(HubState, "_following", lambda state, tick: 0)
    assert rehearse(TABLE.read_text(), TABLE.name, TICKS, 2, ["engine=pure"]).digests == early
    assert len(early) == TICKS


class _HastyHub(HubCore):
    """Publishes the deliveries before it writes the record."""

    def advance(self, now_ns: int) -> None:
        super().advance(now_ns)
        self.actions.sort(key=lambda action: not isinstance(action, Publish))


class _HastySupervisor(SupervisorCore):
    """Publishes commits before it writes them."""

    def advance(self, now_ns: int) -> None:
        super().advance(now_ns)
        self.actions.sort(key=lambda action: isinstance(action, Journal))


def test_speaking_before_writing_is_seen() -> None:
    assert spoken_before_written(trace_of(Settings(hub=_HastyHub)))
    assert spoken_before_written(trace_of(Settings(supervisor=_HastySupervisor)))


def test_everything_outside_the_nodes_follows_commits() -> None:
    assert uncommitted_spoken(trace_of(moves=True)) == []


class _EagerHub(HubCore):
    """Takes the frame of a lone node's part for committed."""

    def receive(self, channel: channels.Channel, name: str, payload: bytes, now_ns: int) -> None:
        if channel is channels.PART and self.deployment is not None:
            part = decode(Part, payload)
            layout = build_layout(self.deployment)
            values = np.empty(layout.size)
            solver = [slot for entity in layout.entities for slot in range(entity.start, entity.split)]
            owner = [slot for entity in layout.entities for slot in range(entity.split, entity.stop)]
            values[solver] = np.frombuffer(part.solver_values)
            values[owner] = np.frombuffer(part.owner_values)
            frame = Frame(part.tick, layout, values)
            commit = Commit(part.epoch, part.tick, frame.digest, values.tobytes(), [], [], part.tick >= TICKS)
            channel, payload = channels.COMMIT, encode(commit)
        super().receive(channel, name, payload, now_ns)


def test_a_hub_on_uncommitted_frames_is_seen(monkeypatch) -> None:  # type: ignore[no-untyped-def]
    monkeypatch.setattr(channels, "VHUB_READS", (*channels.VHUB_READS, (channels.PART, False)))
    assert uncommitted_spoken(trace_of(Settings(hub=_EagerHub, slow_ns={channels.SUPERVISOR: 300_000}), nodes=1))


def test_every_entity_has_one_solver_and_ticks_and_epochs_grow() -> None:
    trace = trace_of(nodes=3, moves=True)
    epochs = {decode(Epoch, traced.payload).epoch for traced in trace if traced.channel == channels.EPOCH.name}
    assert len(epochs) == 5
    assert two_solvers(trace, entities=13) == []
