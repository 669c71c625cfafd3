"""The state of a run as the supervisor keeps it: one value that the core and its helpers share.

`RunState` holds the last committed frame, the epoch and who owns what in it, orders and commits of the last ticks, what
requests have changed, the account, and the actions for the shell. `checkpoint` returns it as the record with which a
journal file starts, `restore` puts it where a journal ends, `catch_up` at a later frame. Its methods change the
state and append the records and messages that belong to the change; decisions are those of the core and its helpers.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Iterable
from contextlib import suppress
from typing import Any

from foosim.common import limits
from foosim.common.errors import Malformed
from foosim.common.units import parse_pace
from foosim.protocol import channels
from foosim.protocol.actions import Action, Journal, Log, Publish
from foosim.protocol.channels import Channel
from foosim.protocol.codec import decode, encode
from foosim.protocol.hub_messages import ResumeGrant, ResumeState
from foosim.protocol.kept_answers import KeptAnswers
from foosim.protocol.messages import Commit, Deliveries, End, Epoch, Part, Tempo
from foosim.supervisor.pacing import Pacer
from foosim.supervisor.records import (
    ANSWERS_KEPT,
    DISRUPTIONS_KEPT,
    REQUESTS_KEPT,
    Account,
    Checkpoint,
    Control,
    History,
    OrderedRecord,
    Recovered,
    RecoveredRecord,
    RequestSummary,
    RunRecord,
    disruptions_of,
)
from foosim.supervisor.roster import Roster
from foosim.supervisor.settings import RunSettings
from foosim.world.assembly.initial_state import first_chain, first_frame
from foosim.world.components.view import ComponentError
from foosim.world.edits import Edit, written
from foosim.world.frame import Frame
from foosim.world.setting.scheduled import Schedule


class InputBuffer:
    """Parts of nodes and deliveries of the vHub for uncommitted ticks."""

    def __init__(self) -> None:
        self.parts: dict[int, list[Part]] = {}
        """By the tick of the frame that they are parts of."""
        self.deliveries: dict[int, bytes] = {}
        self.delivered = 0
        """The last tick whose deliveries are here."""

    def reset(self, tick: int) -> None:
        """Drop everything: frame `tick` is the last committed one."""
        self.parts.clear()
        self.deliveries.clear()
        self.delivered = tick - 1

    def take_part(self, part: Part, committed: int, members: Collection[str]) -> bool:
        """Take a part of the present epoch; False for a repeat. Raises Malformed for a part of another node."""
        if not committed < part.tick <= committed + limits.KEPT_TICKS:
            return False
        if part.node not in members:
            raise Malformed(f"a part of {part.node}, the roster is {', '.join(members)}")
        parts = self.parts.setdefault(part.tick, [])
        if any(known.node == part.node for known in parts):
            return False
        parts.append(part)
        return True

    def take_deliveries(self, deliveries: Deliveries, payload: bytes, committed: int) -> bool:
        """Take received deliveries; False for a repeat. Raises Malformed for a tick too far ahead."""
        if deliveries.tick in self.deliveries or deliveries.tick < committed:
            return False
        if deliveries.last > committed + limits.KEPT_TICKS:
            raise Malformed(f"deliveries of tick {deliveries.last}, the last commit is {committed}")
        self.deliveries[deliveries.tick] = payload
        self.delivered = max(self.delivered, deliveries.last)
        for tick in range(deliveries.tick + 1, deliveries.last + 1):
            self.deliveries.setdefault(tick, encode(Deliveries(tick, [])))
        return True

    def missing(self, tick: int, members: Collection[str]) -> list[str]:
        """Return the nodes whose parts of frame `tick` have not come."""
        known = {part.node for part in self.parts.get(tick, ())}
        return [node for node in members if node not in known]

    def drop(self, tick: int, nodes: Collection[str]) -> None:
        """Drop the invalid parts of these nodes, which are requested again."""
        self.parts[tick] = [part for part in self.parts[tick] if part.node not in nodes]

    def committed(self, tick: int) -> None:
        """Tick `tick` is computed: drop its parts, and the deliveries that no node can still request."""
        self.parts.pop(tick + 1)
        self.deliveries.pop(tick - limits.KEPT_TICKS, None)


class RunState:
    """The state of one run."""

    busy: float = 0.0
    """The share of its time in which the supervisor's loop does not sleep."""
    repeated: int = 0
    """Repeated messages, and messages of a former process."""
    epoch: int = 0
    epoch_payload: bytes = b""
    """The epoch as it was published."""
    is_open: bool = False
    """Whether an epoch of this supervisor has begun."""
    members: tuple[str, ...] = ()
    """The nodes that take part in the epoch, in name order."""
    disruptions: int = 0
    """Requested events of the network."""
    started_ns: int = 0
    committed_ns: int = 0
    end: End | None = None
    cut_off: str = ""
    """Why the capture has no end; empty where it has one, or where there is none."""
    finished: bool = False
    is_resuming: bool = False
    """Whether a supervisor that was started again waits for vHub and nodes (`failover`)."""
    is_vhub_away: bool = False
    """Whether the run waits for a vHub that was lost (`vhub_loss`)."""
    granted_boot: str = ""
    """Boot of the vHub that was last granted its resume."""
    found_living: bool = False
    """Whether a process has reported that took part before this supervisor was started."""
    abandoned: str = ""
    """Why a resumed run does not continue."""
    _is_resumed: bool = False

    def __init__(self, settings: RunSettings, fingerprint: bytes, boot: str, clock: str) -> None:
        """`boot` names this start of the supervisor, `clock` the monotonic clock of its times."""
        self.settings, self.boot, self.clock = settings, boot, clock
        self.actions: list[Action] = []
        """The next actions of the shell."""
        self.deployment = settings.load_deployment()
        self._events = Schedule(self.deployment)
        text = settings.deployment_name, settings.deployment_text
        self.run_record = RunRecord(settings.run, *text, str(settings.pace), settings.ticks, clock, settings.start)
        self.roster = Roster(self.deployment, fingerprint)
        self.pacer = Pacer(self.deployment.tick_ns, settings.pace)
        self.frame = first_frame(self.deployment, settings.start)
        """The last committed one."""
        self.chain = first_chain(settings.origin)
        """The digest over all frames up to it."""
        self.first_tick = self._resumed_tick = self.frame.tick
        self.owners = self.deployment.owners()
        self.inputs = InputBuffer()
        self.released = self.frame.tick
        """The first tick whose order is not released."""
        self.orders: dict[int, list[Edit]] = {}
        self.commits: dict[int, bytes] = {}
        """The last ones, as they were published."""
        self.coming_edits: dict[int, list[Edit]] = {}
        """Edits of unreleased ticks."""
        self.answers = KeptAnswers(ANSWERS_KEPT)
        """By sender and id of the request."""
        self.last_requests: deque[RequestSummary] = deque(maxlen=REQUESTS_KEPT)
        """The last requests that change something, for people."""
        self.last_disruptions: deque[tuple[int, str]] = deque(maxlen=DISRUPTIONS_KEPT)
        """The last of them: the tick at which each takes effect, the event as JSON."""
        self.account = Account(dict.fromkeys(sorted(self.deployment.nodes), 0))
        self.recovered: list[Recovered] = []
        """Losses and returns, the oldest first."""
        self.returns: dict[str, str] = {}
        """Robots that were adopted: the node that they go back to."""
        self.stop_at = settings.last_tick
        """The tick of the frame that ends the run; 0: none."""

    # --- output ------------------------------------------------------------------------------------------------------

    def log(self, level: str, text: str) -> None:
        """Log a line for people."""
        self.actions.append(Log(level, text))

    def publish(self, channel: Channel, name: str, message: Any) -> None:
        """Publish a message on a channel; `name` fills the key."""
        self.actions.append(Publish(channel, name, encode(message)))

    def journal(self, record: Any) -> None:
        """Write one record to the journal."""
        self.actions.append(Journal(encode(record)))

    def publish_epoch(self) -> None:
        """Publish the present epoch again."""
        self.actions.append(Publish(channels.EPOCH, channels.SUPERVISOR, self.epoch_payload))

    def publish_tempo(self) -> None:
        """Send the pace to the vHub."""
        self.publish(channels.TEMPO, channels.SUPERVISOR, Tempo(str(self.pacer.pace), self.pacer.paused))

    def publish_end(self) -> None:
        """Publish the end of the run again, if there is one."""
        if self.end is not None:
            self.publish(channels.END, channels.SUPERVISOR, self.end)

    def grant(self, standing: ResumeState) -> None:
        """Grant the vHub's resume: its position is known."""
        self.granted_boot = standing.boot
        self.publish(channels.RESUME_GRANT, channels.VHUB, ResumeGrant(channels.VHUB, standing.boot, self.epoch))

    # --- epochs ------------------------------------------------------------------------------------------------------

    def begin_epoch(self, owners: dict[str, str], members: Iterable[str] | None) -> None:
        """Begin a new epoch at the last commit: journal it, then publish it. Without `members` they stay."""
        self.epoch += 1
        self.is_open = True
        self.owners = owners
        if members is not None:
            self.members = tuple(sorted(members))
        self.inputs.parts.clear()
        frame, who = self.frame, (list(self.members), sorted(owners.items()), self.roster.arithmetic)
        self.epoch_payload = encode(Epoch(self.epoch, frame.tick, frame.digest, *who))
        self.actions.append(Journal(self.epoch_payload))
        self.publish_epoch()

    def hold(self) -> None:
        """No node is left: nothing is computed until one joins."""
        self.members = ()
        self.inputs.parts.clear()

    def note_recovery(
        self, what: str, name: str, reason: str, epoch: int | None = None, tick: int | None = None
    ) -> Recovered:
        """Add a loss or a return to the account: by default at the last commit, with the next epoch."""
        at = self.frame.tick if tick is None else tick
        entry = Recovered(what, name, reason, at, self.epoch + 1 if epoch is None else epoch)
        self.recovered.append(entry)
        self.journal(RecoveredRecord(entry))
        return entry

    # --- the world ---------------------------------------------------------------------------------------------------

    @property
    def lacks_inputs(self) -> bool:
        """Whether a released tick waits for parts or deliveries."""
        return self.is_open and self.end is None and self.frame.tick < self.released

    @property
    def missing_nodes(self) -> list[str]:
        """The nodes without whose parts the next frame cannot be put together."""
        return self.inputs.missing(self.frame.tick + 1, self.members)

    def coming_numbers(self) -> list[float]:
        """Return the numbers of the newest frame after all that is ordered, released or not, and the events of the
        ticks that are released: those of a tick follow its order."""
        edits: list[Edit] = []
        for tick in range(self.frame.tick, self.released):
            edits += self.orders[tick]
            with suppress(ComponentError):  # the nodes report it, and the run ends at that tick
                edits += self._events.edits(tick, self.frame, edits)
        edits += [edit for tick in sorted(self.coming_edits) for edit in self.coming_edits[tick]]
        return written(self.frame.layout, self.frame.numbers, edits)

    def present_owners(self) -> dict[str, str]:
        """Return the owners of the robots that are in the world."""
        frame = self.frame
        return {name: node for name, node in self.owners.items() if not frame.layout[name].is_absent(frame.numbers)}

    def order(self, tick: int, edits: list[Edit]) -> None:
        """Add edits of the supervisor's own to the order of an uncommitted tick.

        The epoch that follows publishes again the orders that were released.
        """
        if not edits:
            return
        self.journal(OrderedRecord(tick, edits))
        self.note_disruptions(tick, edits)
        if tick < self.released:
            self.orders[tick] = [*self.orders[tick], *edits]
        else:
            self.coming_edits.setdefault(tick, []).extend(edits)

    def note_disruptions(self, tick: int, edits: list[Edit]) -> None:
        """Keep the network events among the edits of a tick for the status."""
        self.last_disruptions.extend(disruptions_of(tick, edits))

    # --- the start of a run ------------------------------------------------------------------------------------------

    @property
    def is_starting(self) -> bool:
        """Whether processes are still being started.

        All processes of a run that is started or resumed start at about the same time, some of them slowly. A
        supervisor that alone was started again finds processes that live: they send heartbeats before a hello.
        """
        tick = self.frame.tick
        return tick <= self.first_tick or (tick <= self._resumed_tick and not self.found_living)

    def wait_ns(self, deadline_ns: int) -> int:
        """Return how long to wait where a running world waits for `deadline_ns`: until the first commit only
        `deadlines.start` counts."""
        return max(deadline_ns, self.deployment.deadlines.start_ns) if self.is_starting else deadline_ns

    def resumed(self) -> None:
        """The run continues from the present frame."""
        self._resumed_tick, self._is_resumed = self.frame.tick, True

    def abandons(self, reason: str) -> bool:
        """Whether a run that cannot continue, for this reason, is left as it was when it was resumed, with its journals
        and its capture, so that it can be resumed once more: before its first commit."""
        if self._is_resumed and not self.found_living and self.frame.tick <= self._resumed_tick:
            self.abandoned = reason
        return bool(self.abandoned)

    # --- checkpoint, restore, catch up -------------------------------------------------------------------------------

    def control(self) -> Control:
        """Return the settings by requests, for the journal."""
        pacer, roster = self.pacer, self.roster
        people = sorted(roster.stopped), dict(self.returns), dict(roster.starts)
        return Control(str(pacer.pace), pacer.paused, pacer.granted, self.stop_at, *people, self.disruptions)

    def checkpoint(self) -> bytes:
        """Return the record with which a journal file starts, so that the files before it can go."""
        orders = {tick: self.orders[tick] for tick in range(self.frame.tick, self.released)} | self.coming_edits
        checkpoint = Checkpoint(
            self.run_record,
            self.owners,
            self.control(),
            self.account,
            self.chain,
            self.epoch_payload,
            list(self.commits.values()),
            {tick: edits for tick, edits in sorted(orders.items()) if edits},
            list(self.answers.values()),
            self.pacer.lags,
            self.recovered,
            self.started_ns,
            self.committed_ns,
            self.end,
            list(self.last_disruptions),
            list(self.last_requests),
        )
        return encode(checkpoint)

    def restore(self, history: History) -> None:
        """Restore the state at the end of a journal, before an epoch."""
        kept, self.frame = history
        self.chain, self.end, self.account = kept.chain, kept.end, kept.account
        self.released = self.frame.tick
        self.inputs.reset(self.frame.tick)
        self.commits = {decode(Commit, commit).tick: commit for commit in kept.commits}
        if kept.epoch:
            epoch = decode(Epoch, kept.epoch)
            self.epoch, self.owners, self.epoch_payload = epoch.epoch, dict(epoch.owners), kept.epoch
        self.started_ns, self.committed_ns = kept.started_ns, kept.committed_ns
        control, pacer = kept.control, self.pacer
        self.stop_at, self.returns = control.stop_at, dict(control.returns)
        pacer.pace, pacer.paused, pacer.granted = parse_pace(control.pace), control.paused, control.granted
        pacer.lags = kept.lags
        self.roster.stopped, self.roster.starts = set(control.stopped), dict(control.starts)
        self.recovered = kept.recovered
        self.restore_requests(kept)
        self.last_requests.extend(kept.requests)

    def restore_requests(self, kept: Checkpoint) -> None:
        """Restore the effects of requests, and the last answers."""
        self.coming_edits, self.disruptions = kept.edits, kept.control.disruptions
        self.last_disruptions.extend(kept.disruptions)
        self.answers = KeptAnswers(ANSWERS_KEPT, kept.answers)

    def catch_up(self, frame: Frame, chain: bytes, commit: bytes) -> None:
        """Put the state at a committed frame after the last one in the journal, which begins anew with it."""
        self.frame, self.chain = frame, chain
        self.released = frame.tick
        self.inputs.reset(frame.tick)
        self.coming_edits = {tick: edits for tick, edits in self.coming_edits.items() if tick >= frame.tick}
        self.commits = {frame.tick: commit}
        self.actions.append(Journal(self.checkpoint()))
