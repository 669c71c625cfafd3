"""Failover: a restarted supervisor resumes a run whose nodes and vHub may still be running.

The state is restored from the journal. The other processes find the supervisor by the address that it had before, are
recalled, and repeat hello and ready. The vHub reports its resume position with its last commit, which is the later one
when the supervisor's machine was lost. Then a new epoch begins at the last commit, without late nodes, and the same
ticks are computed again from the same inputs. A run whose vHub has lost inputs with its machine ends: these
ticks cannot be computed again.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from foosim.common.new_run import new_run_text
from foosim.protocol import channels
from foosim.protocol.barrier import committed_frame
from foosim.protocol.codec import decode
from foosim.protocol.hub_messages import ResumeState
from foosim.protocol.messages import Commit, Epoch
from foosim.supervisor.node_loss import NodeLoss
from foosim.supervisor.progress import ClosingMonitor
from foosim.supervisor.records import History, close_outages
from foosim.supervisor.state import RunState

REJOIN_NS: Final = 1_000_000_000
"""How long, beside the deadline of heartbeats, nodes have to find the supervisor again."""


def lacks_inputs(state: RunState, standing: ResumeState) -> bool:
    """Whether a vHub that resumes from a journal lacks inputs of ticks that other processes have, or may have.

    Its journal lacks them when its machine was lost with the end of it. No other process has them.
    """
    if not standing.waits:
        return False
    return standing.lost_machine or max(state.frame.tick - 1, state.inputs.delivered) > standing.final


def why_it_ends(state: RunState, standing: ResumeState) -> tuple[str, int]:
    """Return the reason with which a run ends whose vHub lacks inputs, and the last tick that the vHub has.

    The reason has the command that begins a new run with the last captured frame.
    """
    tick = decode(Commit, standing.commit).tick if standing.commit else state.first_tick
    known = max(state.frame.tick - 1, state.inputs.delivered)
    lost = f"deliveries are known up to tick {known}" if known > standing.final else "its machine was lost meanwhile"
    reason = f"{channels.VHUB} has lost the end of its journal: it ends at tick {tick}, {lost}"
    return f"{reason}. {new_run_text(state.settings.arguments, standing.capture)}", tick


class Failover:
    """The time between the start of such a supervisor and its first epoch."""

    def __init__(
        self,
        state: RunState,
        closing: ClosingMonitor,
        node_loss: NodeLoss,
        fail: Callable[..., None],
        publish_commit: Callable[[int], None],
    ) -> None:
        """`fail` ends the run as failed, `publish_commit` publishes its last commit again."""
        self._state = state
        self._closing = closing
        self._node_loss = node_loss
        self._fail = fail
        self._publish_commit = publish_commit
        self._standing: ResumeState | None = None
        """The resume position of the vHub, once it is known."""
        self._living_ns = self._start_ns = self._hub_ns = 0
        self._roster: list[str] = []
        self._owners: dict[str, str] = {}
        """The owners by the last request, also if no epoch has begun with them."""

    def begin(self, history: History, now_ns: int) -> None:
        """Restore the state from a journal. Times of another clock are moved to that of `now_ns`."""
        state, deadlines = self._state, self._state.deployment.deadlines
        state.is_resuming = True
        self._living_ns = now_ns + deadlines.heartbeat_ns + REJOIN_NS
        self._start_ns = now_ns + deadlines.start_ns
        self._hub_ns = now_ns + max(deadlines.orphan_ns, deadlines.start_ns)
        kept = history.kept
        self._roster = decode(Epoch, kept.epoch).roster
        self._owners = kept.owners
        if kept.run.clock != state.clock:
            kept.started_ns += now_ns - kept.committed_ns
            kept.committed_ns = now_ns
        state.restore(history)
        state.resumed()
        state.log("warning", f"started again: the journal ends at tick {state.frame.tick}, epoch {state.epoch}")

    def on_standing(self, standing: ResumeState, now_ns: int) -> bool:
        """The vHub reports its resume position: continue from its last commit when the journal has lost that.

        False for a repeat.
        """
        state = self._state
        if self._standing is not None and self._standing.boot == standing.boot:
            return False
        if state.end is not None:
            self._standing = standing
            self._closing.ended(now_ns)
            if not lacks_inputs(state, standing):
                state.grant(standing)
            return True
        is_ahead = bool(standing.commit) and decode(Commit, standing.commit).tick > state.frame.tick
        if is_ahead and not lacks_inputs(state, standing):
            self._catch_up(standing)
        state.epoch = max(state.epoch, standing.epoch)
        self._standing = standing
        state.resumed()
        return True

    def on_standstill(self, stood_ns: int) -> None:
        """Extend the deadlines by a standstill of the supervisor: no process could reconnect."""
        self._living_ns += stood_ns
        self._start_ns += stood_ns
        self._hub_ns += stood_ns

    def waits_for_hub(self, now_ns: int) -> bool:
        """Whether a run that has ended, perhaps before this start, waits for the vHub to close its capture."""
        return self._state.is_resuming and self._standing is None and now_ns <= self._hub_ns

    def lose_hub(self) -> None:
        """The vHub is lost again: the next one reports its resume position."""
        self._standing = None

    def wake(self, now_ns: int) -> None:
        """Begin the epoch when all processes are here, or when the deadline of the missing ones is over.

        Where the vHub lacks inputs the run ends then, or as soon as a process is known to have survived.
        """
        state, deadlines = self._state, self._state.deployment.deadlines
        if not state.is_resuming or state.end is not None or state.finished:
            return
        if self._standing is None:
            if now_ns > self._hub_ns:
                wait_s = max(deadlines.orphan_ns, deadlines.start_ns) / 1e9
                self._fail(f"lost {channels.VHUB}: it has not come to the supervisor within {wait_s:g} s")
            return
        known = state.roster.by_name
        expected = [name for name in self._roster if name not in state.roster.stopped]
        here = [name for name in expected if name in known and known[name].ready and not known[name].lost]
        waits_until_ns = self._living_ns if state.found_living else self._start_ns
        is_due = len(here) == len(expected) or now_ns >= waits_until_ns
        if lacks_inputs(state, self._standing):
            if is_due or state.found_living:
                self._fail(*why_it_ends(state, self._standing))
        elif is_due:
            self._open(self._standing, here, [name for name in expected if name not in here], now_ns)

    def _catch_up(self, standing: ResumeState) -> None:
        """Continue from the vHub's last commit. Raises Malformed for one that does not fit its frame."""
        state = self._state
        frame = committed_frame(decode(Commit, standing.commit), state.frame.layout)
        # A commit that the journal lost has reported the open outages, with their length: they are not reported again.
        close_outages(state.recovered, state.committed_ns, state.committed_ns)
        state.catch_up(frame, standing.chain, standing.commit)
        state.log("warning", f"continues from the vHub's commit {state.frame.tick}, the journal lost what led to it")

    def _open(self, standing: ResumeState, here: list[str], missing: list[str], now_ns: int) -> None:
        state = self._state
        state.is_resuming = False
        state.is_open = True
        beats = [process.heartbeat for process in state.roster.by_name.values()]
        state.epoch = max(
            [state.epoch, *(beat.epoch for beat in beats if beat is not None)]
        )  # both journals may lack it
        state.pacer.start(now_ns, state.frame.tick)
        state.publish_tempo()
        state.note_recovery(channels.SUPERVISOR, channels.SUPERVISOR, "started again")
        state.account.moves += sum(state.owners[robot] != owner for robot, owner in self._owners.items())
        state.owners = dict(self._owners)
        state.members = tuple(here)
        self._node_loss.begin(here, missing, now_ns)
        if state.finished:
            return
        self._publish_commit(now_ns)
        state.grant(standing)
        state.log("info", f"continues from tick {state.frame.tick} with {', '.join(here) or 'no node yet'}")
        for process in [*state.roster.by_name.values()]:
            is_new = process.role == "node" and process.name not in (*state.members, *state.roster.stopped)
            if is_new and process.ready and not process.lost:  # it was before its time
                self._node_loss.join(process, now_ns)
