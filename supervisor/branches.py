"""The run goes on as a branch when the vHub has lost the end of its journal with its machine.

What the vHub closed last is the last that it knows: nobody can give it the inputs of the ticks behind. So the run
stands where the vHub does, as it does when it takes the later commit of the two, and all that was behind is void:
commits, arrivals, orders, deliveries. A branch has a number, that of the first epoch in it; deliveries and what is said
to clients and by them name it, so that nothing that is void and still on its way counts. Requests keep their ids, ticks
and answers, and what they change is ordered again at their ticks. Neighbours: `vhub.core` waits for the decision,
`take_over` and `core` hear the vHub, `head` writes it as one record.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from foosim.protocol import channels
from foosim.protocol.actions import Publish
from foosim.protocol.codec import decode, encode
from foosim.protocol.errors import Malformed
from foosim.protocol.frame import Frame, frame_from_bytes
from foosim.protocol.hub_messages import Proceed, Standing
from foosim.protocol.layout import build_layout
from foosim.protocol.messages import Commit
from foosim.supervisor.account import Recovered, close_outages, tell_again
from foosim.supervisor.head import stand_at

if TYPE_CHECKING:
    from foosim.supervisor.core import SupervisorCore


class Branches:
    """The last branch of a run: its number, and the tick behind which it began."""

    def __init__(self, core: SupervisorCore) -> None:
        self.number = self.tick = 0
        self._core = core
        self._known = ""
        """Boot of the vHub of which it is known where it stands."""

    def take(self, standing: Standing, now_ns: int) -> bool:
        """The vHub tells how far it has come; False when that is another one's, or for another supervisor."""
        core = self._core
        process = core.roster.by_name.get(channels.VHUB)
        if process is None or process.boot != standing.boot or standing.supervisor != core.boot:
            return False
        if core.take_over is not None:
            return core.take_over.standing(standing, now_ns)
        if standing.boot != self._known and self.is_behind(standing):
            if core.end is not None:
                return False  # it ends where it stands
            self.begin(standing, now_ns)
            if core.members:
                core.recovery.open(core.owners, core.members, now_ns)
        self.proceed(standing)
        return True

    def proceed(self, standing: Standing) -> None:
        """Let the vHub go on: it is known where it stands.

        A branch without an epoch, since no node is here, begins with the first one that comes.
        """
        self._known = standing.boot
        core = self._core
        proceed = Proceed(channels.VHUB, standing.boot, max(core.epoch, self.number))
        core.actions.append(Publish(channels.PROCEED, channels.VHUB, encode(proceed)))

    @property
    def is_pending(self) -> bool:
        """Whether the branch has begun and no epoch is in it yet: nobody else knows of it."""
        return self.number > self._core.epoch

    def enter(self, epoch: int) -> None:
        """Name the branch that has begun after the first epoch in it."""
        self.number = self._core.arrivals.branch = epoch

    def is_behind(self, standing: Standing) -> bool:
        """Whether somebody knows more, or may, than the vHub that goes on from a journal."""
        core = self._core
        if not standing.waits or not standing.commit:
            return False
        return standing.lost_machine or max(core.frame.tick - 1, core.arrivals.delivered) > standing.final

    def is_further(self, standing: Standing) -> bool:
        """Whether the vHub knows of commits, or of a branch, that are not in the supervisor's journal."""
        newer = bool(standing.commit) and decode(Commit, standing.commit).tick > self._core.frame.tick
        return newer or standing.branch > self.number

    def stand(self, standing: Standing) -> None:
        """Stand where the vHub does. Raises Malformed for a commit that does not fit its frame."""
        frame = self._frame(standing)
        if standing.branch > self.number:
            self.number, self.tick = standing.branch, standing.branch_tick
        core = self._core
        # What was open is over by a commit that the journal lost, and that told how long it took: it is not told again.
        close_outages(core.recovery.recovered, core.committed_ns, core.committed_ns, frame.tick)
        stand_at(core, frame, standing.chain, standing.commit)

    def begin(self, standing: Standing, now_ns: int) -> None:
        """Begin a branch behind the vHub's last closed tick, with the epoch that is opened next.

        It is one record of the journal, with what people are told of it. Whoever ends before that epoch, the supervisor
        or the vHub, asks or is asked again: the branch that has begun where the vHub stands is that one.
        """
        core, frame = self._core, self._frame(standing)
        if self.is_pending and standing.branch < self.number and frame.tick == self.tick:
            return
        tick, before = frame.tick, core.frame.tick
        core.epoch = max(core.epoch, standing.epoch)
        reason = f"branch from tick {tick}: " + (
            f"{before - tick} ticks are lost" if before > tick else "its machine was lost, and what was on its way"
        )
        unknown = core.requests.issued.forgotten
        if unknown >= tick:
            reason += f", and what requests changed up to tick {unknown}"
        tell_again(core.recovery.recovered, tick)
        core.recovery.recovered.append(Recovered("vhub", channels.VHUB, reason, tick, core.epoch + 1))
        core.pacer.set_back(max(0, before - tick), tick, now_ns)
        core.watch.set_back(tick, now_ns)
        self.number, self.tick = core.epoch + 1, tick
        stand_at(core, frame, standing.chain, standing.commit)
        core.say("warning", f"goes on as {reason}")

    def _frame(self, standing: Standing) -> Frame:
        commit = decode(Commit, standing.commit)
        layout = build_layout(self._core.deployment, [(entity.name, entity.model) for entity in standing.added])
        frame = frame_from_bytes(commit.tick, layout, commit.values, commit.outboxes)
        if frame.digest != commit.digest:
            raise Malformed(f"commit {commit.tick} of the vHub has another digest than its frame")
        return frame
