"""Where a vHub that goes on from a journal stands, and whether it may go on from there.

Its journal may have lost its end with the machine. So it tells the supervisor how far it has come, and closes nothing,
takes no commit and lets nobody in until it hears that it may proceed. Where others had come further, the run goes on as
a branch: what was said before is named anew, so that nothing of what is void can be taken for it.
Neighbours: `core` goes on, `resume` reads the journal, `supervisor.failover` decides.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from foosim.protocol import channels, limits
from foosim.protocol.actions import Journal, Publish, Say
from foosim.protocol.codec import encode
from foosim.protocol.hub_messages import Proceed, Standing
from foosim.protocol.messages import Commit, Deliveries, Want
from foosim.vhub.naming import in_branch

if TYPE_CHECKING:
    from foosim.vhub.core import HubCore


class Footing:
    """Whether one vHub waits, and what follows when it does not any more. `machine` is the present start of its
    machine, empty where that has no name."""

    def __init__(self, core: HubCore, machine: str) -> None:
        self.waits = False
        self.lost_machine = False
        """Whether the journal was written before the machine was started the last time."""
        self._core = core
        self._machine = self._written_on = machine
        self._published: list[bytes] = []
        """What is said first: the last deliveries of the vHub before, which may have been written and not said."""
        self._owing: list[str] = []
        """Clients that left at its last tick, owing the Done: the same holds for the packets of their Go."""
        self._from = limits.COUNTER_MAX
        """The epoch from which on it may proceed."""

    @property
    def machine(self) -> str:
        """What the journal names: the start of the machine before, until its end is known to be all there is."""
        return self._written_on if self.waits else self._machine

    def stand(self, machine: str, published: bytes, owing: list[str]) -> None:
        """Wait: the journal that is gone on with names this start of a machine, these deliveries as the last, and who
        left `owing` at its last tick."""
        self.waits, self._written_on, self._owing = True, machine, owing
        self._published = [published] if published else []
        self.lost_machine = "" != machine != self._machine != ""

    def standing(self) -> Publish:
        """Say how far the world has come here."""
        core, state = self._core, self._core.state
        assert state is not None and core.member.build is not None
        standing = Standing(
            channels.VHUB,
            core.member.boot,
            core.member.build.supervisor,
            core.epoch,
            state.branch,
            state.branch_tick,
            *core.commits.last(state.deployment),
            state.final,
            self.waits,
            self.lost_machine,
        )
        return Publish(channels.STANDING, channels.VHUB, encode(standing))

    def proceed(self, proceed: Proceed, payload: bytes, now_ns: int) -> None:
        """The supervisor knows where this vHub stands."""
        if proceed.boot != self._core.member.boot or not self.waits:
            self._core.repeated += 1
            return
        self._from = proceed.epoch
        self.entered()

    def entered(self) -> None:
        """An epoch has begun, or may be gone on in: say the last deliveries, and ask for what comes behind them."""
        core, state = self._core, self._core.state
        if self.waits and core.epoch < self._from:
            return
        core.member.entered()
        if not self.waits or state is None:
            return
        self.waits = False
        if self.lost_machine:
            core.actions.append(Journal(core.head()))
        for payload in self._published:
            core.actions.append(Publish(channels.DELIVERIES, channels.VHUB, payload))
        for name in self._owing:
            core.sessions.say_again(name, state.members[name].downlink)
        for tick in range(state.closed + 1, state.final + 2):
            for kind in (channels.COMMIT, channels.SAMPLES):
                want = encode(Want(channels.VHUB, kind.name, tick, core.epoch, []))
                core.actions.append(Publish(channels.WANT, channels.VHUB, want))

    def fences(self, commit: Commit, epoch_tick: int) -> bool:
        """Whether a commit does not count: of an older epoch than began at `epoch_tick`, of what a branch left behind.

        Up to the epoch's start it is as good under its old epoch: in a branch, what is committed never changes.
        """
        core, state = self._core, self._core.state
        is_old = commit.epoch < core.epoch and commit.tick > epoch_tick
        is_void = state is not None and commit.epoch < state.branch and commit.tick > state.branch_tick
        return is_old or is_void or self.waits

    def branch_off(self, sent: dict[int, bytes]) -> None:
        """A branch begins behind the last closed tick. `sent` are the deliveries that others may ask for: they have
        forgotten those that are still to be computed with."""
        core, state = self._core, self._core.state
        assert state is not None
        core.actions.append(Say("warning", f"the run goes on as branch {state.branch} from tick {state.branch_tick}"))
        for tick, payload in sent.items():
            sent[tick] = in_branch(Deliveries, payload, state.branch)
        self._published = [payload for tick, payload in sorted(sent.items()) if tick >= state.closed]
        core.sessions.downlinks.turn_to(state.branch)
