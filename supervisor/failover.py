"""A supervisor that was started again goes on with a run whose nodes and vHub live.

It stands where its journal ends. Who takes part finds it by the address that it had before, is recalled, and says hello
and ready once more. The vHub tells its last commit, which is the later one when the supervisor's machine was lost. Then
a new epoch begins at the last commit, without the nodes that have not come in time, and the same ticks are computed
again from the same inputs.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from foosim.protocol import channels
from foosim.protocol.actions import Publish
from foosim.protocol.hub_messages import Standing
from foosim.supervisor.records import History
from foosim.supervisor.state import stand_on

if TYPE_CHECKING:
    from foosim.supervisor.core import SupervisorCore

REJOIN_NS: Final = 1_000_000_000
"""How long, beside the deadline of heartbeats, nodes have to find the supervisor again."""


class TakeOver:
    """The time between the start of such a supervisor and its first epoch."""

    def __init__(self, core: SupervisorCore, history: History, now_ns: int) -> None:
        """Let `core` stand where the journal ends. Times of another clock are moved to that of `now_ns`."""
        deadlines = core.deployment.deadlines
        self._core = core
        self._standing: Standing | None = None
        self._living_ns = now_ns + deadlines.heartbeat_ns + REJOIN_NS
        self._start_ns = now_ns + deadlines.start_ns
        self._hub_ns = now_ns + max(deadlines.orphan_ns, deadlines.start_ns)
        self._roster = [] if history.epoch is None else list(history.epoch.roster)
        self._owners = history.owners
        """Who owns what by the last request, also if no epoch has begun with it."""
        if history.run.clock != core.clock:
            history.started_ns += now_ns - history.committed_ns
            history.committed_ns = now_ns
        stand_on(core, history)
        core.beginning.go_on(core.frame.tick)
        core.say("warning", f"started again: the journal ends at tick {core.frame.tick}, epoch {core.epoch}")

    def standing(self, standing: Standing, now_ns: int) -> bool:
        """The vHub tells how far it has come: go on from its last commit when the journal has lost that, or when the
        vHub has lost what came behind. False for a repeat."""
        core = self._core
        if self._standing is not None and self._standing.boot == standing.boot:
            return False
        if core.end is not None:
            self._standing = standing
            core.watch.ended_ns = now_ns
            core.branches.proceed(standing)
            return True
        if core.branches.is_behind(standing):
            core.branches.begin(standing, now_ns)
        elif core.branches.is_further(standing):
            core.branches.stand(standing)
            core.say("warning", f"goes on from the vHub's commit {core.frame.tick}, the journal lost what led to it")
        core.epoch = max(core.epoch, standing.epoch)
        core.prepare(core.frame.layout)
        self._standing = standing
        core.beginning.go_on(core.frame.tick)
        return True

    def rest(self, stood_ns: int) -> None:
        """The supervisor stood still for so long: nobody could come back to it."""
        self._living_ns += stood_ns
        self._start_ns += stood_ns
        self._hub_ns += stood_ns

    def waits_for_hub(self, now_ns: int) -> bool:
        """Whether a run that has ended, perhaps before this start, waits for the vHub to close its capture."""
        return self._standing is None and now_ns <= self._hub_ns

    def lose_hub(self) -> None:
        """The vHub is gone again: the next one tells where it stands."""
        self._standing = None

    def wake(self, now_ns: int) -> None:
        """Begin the epoch when everybody is here, or when those who are not have had their time."""
        core = self._core
        if core.end is not None or core.finished:
            return
        if self._standing is None:
            if now_ns > self._hub_ns:
                wait_s = max(core.deployment.deadlines.orphan_ns, core.deployment.deadlines.start_ns) / 1e9
                core.finish(f"lost {channels.VHUB}: it has not come to the supervisor within {wait_s:g} s", failed=True)
            return
        layout, known = core.frame.layout.digest, core.roster.by_name
        expected = [name for name in self._roster if name not in core.roster.stopped]
        here = [name for name in expected if name in known and layout in known[name].ready and not known[name].lost]
        waits_until_ns = self._living_ns if core.beginning.found_living else self._start_ns
        if len(here) == len(expected) or now_ns >= waits_until_ns:
            self._open(here, [name for name in expected if name not in here], now_ns)

    def _open(self, here: list[str], missing: list[str], now_ns: int) -> None:
        core = self._core
        core.take_over = None
        core.is_open = True
        beats = [process.heartbeat for process in core.roster.by_name.values()]
        is_branch = core.branches.is_pending
        core.epoch = max([core.epoch, *(beat.epoch for beat in beats if beat is not None)])  # both journals may lack it
        if is_branch:
            core.branches.enter(core.epoch + 1)
        core.pacer.start(now_ns, core.frame.tick)
        core.actions.append(Publish(channels.TEMPO, channels.SUPERVISOR, core.tempo()))
        core.recovery.note(channels.SUPERVISOR, channels.SUPERVISOR, "started again")
        core.account.moves += sum(core.owners[robot] != owner for robot, owner in self._owners.items())
        core.owners = dict(self._owners)
        core.members = tuple(here)
        core.recovery.begin(here, missing, now_ns)
        if core.finished:
            return
        core.say_last_commit(now_ns)
        assert self._standing is not None
        core.branches.proceed(self._standing)
        core.say("info", f"goes on from tick {core.frame.tick} with {', '.join(here) or 'no node yet'}")
