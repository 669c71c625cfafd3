"""The whole system in one process on virtual time: the same cores, table of channels and codec as the processes.

Supervisor, vHub, nodes and players take turns by messages and deadlines. A process may be slow on
the virtual clock (`slow_ns`), have its engines rebuilt, or receive a request at a tick.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from heapq import heappop, heappush
from typing import Any, Final

from mypy_extensions import mypyc_attr

from foosim.client.core import ClientCore
from foosim.client.errors import PlayerError, Unanswered
from foosim.client.loading import load_player
from foosim.client.playing import PlayerLoop, report_failure
from foosim.common import limits
from foosim.common.json_text import encode_json
from foosim.node.engines_pool import Solver
from foosim.protocol import channels
from foosim.protocol.actions import Journal, Log, Publish
from foosim.protocol.channels import Channel
from foosim.protocol.codec import decode, encode
from foosim.protocol.fingerprint import library_fingerprint
from foosim.protocol.messages import Answer, Epoch, Inquiry, Request
from foosim.runtime.roles.bus import Bus, Message
from foosim.simulation.failures import Stuck
from foosim.simulation.journals import Ending, HubJournal
from foosim.simulation.settings import AtWork, Clock, Process, Settings, Traced
from foosim.supervisor.records import fold
from foosim.supervisor.settings import RunSettings
from foosim.vhub.core import HubCore
from foosim.vhub.state.records import Closing
from foosim.world.frame import Frame

__all__ = ["IDLE_NS_MAX", "OPERATOR", "Settings", "Stuck", "System"]

OPERATOR: Final = "operator"
NEVER_NS: Final = limits.COUNTER_MAX
IDLE_NS_MAX: Final = 60_000_000_000
"""Virtual time without a commit after which a rehearsal is stuck: a fault of ours."""
HUB_BACK_NS: Final = 300_000_000
"""Time after which a vHub that ended is restarted, as by a launcher."""


class People:
    """Operators and viewers of a rehearsal: requests to the supervisor, sent once or repeated until answered.

    `later(after_ns, action)` schedules a repetition.
    """

    def __init__(self, bus: Bus, later: Callable[[int, Callable[[], object]], None]) -> None:
        self.answers: dict[str, Answer] = {}
        self.verbs: dict[str, str] = {}
        """The verb of each request that was not given up, by id."""
        self._bus = bus
        self._later = later
        self._requests = 0
        self.viewed: list[bytes] = []
        """The views received, in order of arrival."""
        bus.subscribe(OPERATOR, (*channels.OPERATOR_READS, *channels.VIEW_READS))

    def request(
        self, verb: str, again_ns: int, arguments: dict[str, Any], who: str = OPERATOR, *, only_looks: bool = False
    ) -> str:
        """Send a request, every `again_ns` until it is answered (0: once); return the request's id.

        With `only_looks` it is sent as a viewer's.
        """
        self._requests += 1
        identity = f"request-{self._requests}"
        self.verbs[identity] = verb
        kind, channel = (Inquiry, channels.INQUIRY) if only_looks else (Request, channels.REQUEST)
        self._bus.subscribe(who, channels.OPERATOR_READS)
        self._send(identity, channel, who, encode(kind(who, identity, verb, encode_json(arguments))), again_ns)
        return identity

    def give_up(self, verb: str) -> None:
        """Stop repeating unanswered requests."""
        for identity in [known for known, what in self.verbs.items() if what == verb and known not in self.answers]:
            self.verbs.pop(identity)

    def hear(self, channel: Channel, payload: bytes) -> None:
        """Handle an answer or a view."""
        if channel is channels.VIEW:
            self.viewed.append(payload)
        elif channel is channels.ANSWER:
            answer = decode(Answer, payload)
            self.answers[answer.id] = answer

    def _send(self, identity: str, channel: Channel, who: str, payload: bytes, again_ns: int) -> None:
        if identity in self.answers or identity not in self.verbs:
            return
        self._bus.put(who, channel, who, payload, self._bus.now_ns)
        if again_ns:
            self._later(again_ns, lambda: self._send(identity, channel, who, payload, again_ns))


def _untriggered(core: ClientCore) -> Callable[[int], None]:
    """Return the turn of a gateway without a program that triggers steps."""

    has_joined = False

    def turn(now_ns: int) -> None:
        nonlocal has_joined
        if core.deployment is not None and not has_joined:
            has_joined = True
            rate_hz = core.deployment.clients[core.name].rate_hz
            assert rate_hz is not None, "the client of a gateway in lockstep has a rate"
            core.join(core.deployment.ticks(rate_hz), ())
        if core.go is not None:
            core.done(())

    return turn


@mypyc_attr(allow_interpreted_subclasses=True)
class System:
    """All processes of one deployment. Build it, then `run`."""

    def __init__(self, settings: RunSettings, rehearsal: Settings) -> None:
        self.settings = rehearsal
        self.bus = Bus(rehearsal.weather)
        self.processes: dict[str, Process] = {}
        self.solvers: dict[str, Solver] = {}
        self.people = People(self.bus, self.later)
        self.answers = self.people.answers
        self.players: dict[str, PlayerLoop] = {}
        self._boots_of_players = 0
        self.at_work = AtWork()
        self.healed = False
        """Whether a test has ended all faults."""
        self.flipped: set[str] = set()
        """Nodes whose memory a test has changed."""
        self._traces_receive = rehearsal.observer is not None and "receive" in rehearsal.observes
        self._at_tick: dict[int, list[Callable[[], object]]] = {}
        self._next: list[Callable[[], object]] = []
        self._timers: list[tuple[int, int, Callable[[], object]]] = []
        self._frames: list[Frame] = []
        """Committed in the present turn of the supervisor."""
        self._dying: dict[str, int] = {}
        """Processes that end amid their next actions: how many actions they still perform."""
        self._boots = 0
        self._soonest_ns = self._last_commit_ns = 0
        """A lower bound of the next wake-up of any process."""
        self._clocks = {name: replace(clock) for name, clock in rehearsal.clocks.items()}
        self._behind: dict[str, Process] = {}
        """Processes with something in their inbox."""
        self._simulation = b""
        """The fingerprint of the engine, once a node has built one."""
        self._run = settings
        self.journal: list[bytes] = []
        """The supervisor's, where it may be started again."""
        fingerprint = library_fingerprint()
        self.supervisor = rehearsal.supervisor(settings, fingerprint, self._clock(channels.SUPERVISOR).at(0))
        deployment = self.supervisor.state.deployment
        self._enter_supervisor()
        self.hub_journal = HubJournal()
        self.hub: HubCore
        self._enter_hub(fingerprint)
        for name in sorted(deployment.nodes):
            self._enter_node(name, fingerprint)
        self._enter_clients()
        self._hub_back_ns = HUB_BACK_NS

    def enter(self, name: str, core: Any, turn: Callable[[int], None], reads: tuple[tuple[Channel, bool], ...]) -> None:
        """Add a process, which takes part from now on."""
        self.bus.subscribe(name, reads)
        process = self.processes[name] = Process(name, core, turn, self.settings.slow_ns.get(name, 0))
        process.clock = self._clock(name)
        process.wake_ns = self._soonest_ns = self.bus.now_ns
        process.begin(self.bus.now_ns)

    def _clock(self, name: str) -> Clock:
        return self._clocks.setdefault(name, Clock())

    def now_of(self, name: str) -> int:
        """Return the present reading of a process's clock."""
        return self._clock(name).at(self.bus.now_ns)

    def _enter_supervisor(self) -> None:
        core = self.supervisor
        core.on_commit = self._frames.append
        self.enter(channels.SUPERVISOR, core, core.advance, channels.SUPERVISOR_READS)
        process = self.processes[channels.SUPERVISOR]
        process.took = core.progress.took
        process.stood = core.on_standstill
        self._hub_hears(True)

    def _enter_hub(self, fingerprint: bytes) -> None:
        """Add a vHub, which resumes from its predecessor's journal."""
        self._boots += 1
        start = f"boot-{self._boots}", fingerprint, self.now_of(channels.VHUB)
        hub = self.hub = self.settings.hub(*start, machine=self.hub_journal.machine)

        def turn(now_ns: int) -> None:
            build = hub.member.build
            if build is not None and hub.state is None:
                hub.begin(self.hub_journal.past(hub, build.run), now_ns)
            hub.advance(now_ns)
            if hub.member.refusal and self.settings.restart_ns and self.hub is hub:
                self.soon(lambda: self._hub_again(hub))

        self.enter(channels.VHUB, hub, turn, channels.VHUB_READS)
        self.processes[channels.VHUB].took, self.processes[channels.VHUB].stood = hub.waits.took, hub.rest

    def _enter_node(self, name: str, fingerprint: bytes) -> None:
        self._boots += 1
        core = self.settings.node(name, f"boot-{self._boots}", fingerprint, self.now_of(name))
        core.is_guarded = self.settings.is_guarded
        solver = self.solvers[name] = Solver(core, self.settings.factory)

        def turn(now_ns: int) -> None:
            # The processes of a rehearsal are one: the small run of one node is that of all.
            solver.fingerprint = solver.fingerprint or self._simulation
            solver.build()
            self._simulation = self._simulation or solver.fingerprint
            core.advance(now_ns)
            while core.work is not None:
                solver.solve(core.work)
                core.advance(now_ns)
            if core.member.refusal and self.settings.restart_ns and self.solvers.get(name) is solver:
                self.soon(lambda: self._start_again(name, solver))

        self.enter(name, core, turn, channels.NODE_READS)

    # --- running -----------------------------------------------------------------------------------------------------

    def run(self) -> None:
        """Run until the supervisor has finished."""
        bus = self.bus
        self._wake_due()
        while not self.supervisor.state.finished:
            while self._next:
                self._next.pop(0)()
            arrival_ns = bus.next_ns()
            free_ns = min([process.busy_until_ns for process in self._behind.values()]) if self._behind else NEVER_NS
            if self._timers and self._timers[0][0] <= min(free_ns, arrival_ns, self._soonest_ns):
                due_ns, _, action = heappop(self._timers)
                bus.now_ns = max(bus.now_ns, due_ns)
                self.soon(action)
            elif free_ns <= arrival_ns and free_ns <= self._soonest_ns:
                bus.now_ns = max(bus.now_ns, free_ns)
                self._catch_up()
            elif arrival_ns <= self._soonest_ns:
                bus.now_ns = max(bus.now_ns, arrival_ns)
                self._deliver()
            elif self._is_soonest_known():
                bus.now_ns = max(bus.now_ns, self._soonest_ns)
                self._wake_due()
                if bus.now_ns - self._last_commit_ns > IDLE_NS_MAX and not self.supervisor.state.pacer.paused:
                    raise Stuck(self._where())

    def close(self) -> None:
        """Free the engines."""
        for solver in self.solvers.values():
            solver.close()

    def _is_soonest_known(self) -> bool:
        """Find the next wake-up; False when it is later than the lower bound."""
        soonest_ns = min([max(process.wake_ns, process.busy_until_ns) for process in self.processes.values()])
        known, self._soonest_ns = soonest_ns == self._soonest_ns, soonest_ns
        return known

    def _deliver(self) -> None:
        """Hand the next message of the bus to its receiver, or append it to the receiver's inbox."""
        message = self.bus.pop()
        process = self.processes.get(message[2])
        if process is None:
            self.people.hear(message[3], message[5])
        elif process.inbox or process.busy_until_ns > self.bus.now_ns:
            process.inbox.append(message)
            self._behind[process.name] = process
        else:
            self._hand(process, message)

    def _catch_up(self) -> None:
        """Hand the oldest waiting message to a process that is free again."""
        process = min(self._behind.values(), key=lambda process: process.busy_until_ns)
        message = process.inbox.popleft()
        if not process.inbox:
            self._behind.pop(process.name)
        self._hand(process, message)

    def _hand(self, process: Process, message: Message) -> None:
        """Let a process receive one message and perform its actions."""
        _, _, _, channel, name, payload = message
        self._begin_turn(process)
        if self._traces_receive:
            self._trace(self.bus.now_ns, process, "receive", channel.name, payload, name)
        now_ns = process.look(self.bus.now_ns)
        process.core.receive(channel, name, payload, now_ns)
        process.turn(now_ns)
        if (
            process.slow_ns and self._core_deadline_ns(process) <= self.bus.now_ns
        ):  # a backlog does not delay its heartbeat
            process.core.wake(now_ns)
            process.turn(now_ns)
        self._perform(process)
        self._plan_wake(process)

    def _wake_due(self) -> None:
        """Wake all processes whose time has come."""
        now_ns = self.bus.now_ns
        for process in list(self.processes.values()):
            if max(process.wake_ns, process.busy_until_ns) <= now_ns:
                self.wake(process)

    def wake(self, process: Process) -> None:
        """Wake a process and perform its actions."""
        self._begin_turn(process)
        now_ns = process.look(self.bus.now_ns)
        process.core.wake(now_ns)
        process.turn(now_ns)
        self._perform(process)
        process.wake_ns = NEVER_NS
        self._plan_wake(process)
        assert process.wake_ns > self.bus.now_ns, f"{process.name} has a deadline that waking did not move"

    def _begin_turn(self, process: Process) -> None:
        self.at_work.name = process.name
        self.at_work.turns += 1

    def take_turn(self, process: Process) -> None:
        """Advance a process and perform its actions."""
        self._begin_turn(process)
        process.turn(process.clock.at(self.bus.now_ns))
        self._perform(process)
        self._plan_wake(process)

    def _core_deadline_ns(self, process: Process) -> int:
        """Return a core's next deadline, in virtual time."""
        core, clock = process.core, process.clock
        if core is self.supervisor:
            return clock.when(core.deadline_ns(clock.at(self.bus.now_ns)))
        return clock.when(core.deadline_ns())

    def _plan_wake(self, process: Process) -> None:
        """After a turn: read the process's next deadline, as its loop does.

        The supervisor's deadline counts from now: events can make it earlier, never later.
        """
        wake_ns = self._core_deadline_ns(process)
        if process.core is self.supervisor:
            wake_ns = min(wake_ns, process.wake_ns)
        process.due_ns = process.clock.at(wake_ns)
        process.wake_ns = max(wake_ns, process.busy_until_ns)
        self._soonest_ns = min(self._soonest_ns, process.wake_ns)

    def _perform(self, process: Process) -> None:
        """Perform a core's actions, in order."""
        actions = process.core.actions
        if not actions:
            return
        left = self._dying.pop(process.name, None)
        if left is not None:
            del actions[left:]
            self.leave(process.name)
        leaves_ns = self.bus.now_ns
        if process.slow_ns and any(type(action) is Publish for action in actions):
            leaves_ns += process.slow_ns
            process.busy_until_ns = leaves_ns
            process.took(process.clock.at(self.bus.now_ns), process.clock.at(leaves_ns))
        for action in actions:
            if self.hub_journal.ending and type(action) is Journal and process.core is self.hub:
                if self.hub_journal.ending == "unpublished":
                    self._keep(leaves_ns, process, action)
                self._end_hub()
                return
            if type(action) is Publish:
                self._trace(leaves_ns, process, "publish", action.channel.name, action.payload, action.name)
                self.bus.put(process.name, action.channel, action.name, action.payload, leaves_ns)
            else:
                self._keep(leaves_ns, process, action)
        actions.clear()
        if process.core is self.supervisor and self._frames:
            self._report_commits(was_cut=left is not None)
        hub_ends = process.core is self.hub and self.hub.finished and not self.hub.is_closing
        if hub_ends and process.name in self.processes:
            self._close(process, leaves_ns)

    def _close(self, process: Process, begun_ns: int) -> None:
        """Close the vHub's capture, reporting its progress, and send its farewell."""
        hub = self.hub

        def turn(now_ns: int) -> None:
            if self.settings.closing(hub, self.bus.now_ns - begun_ns) and channels.VHUB in self.processes:
                farewell, at_ns = hub.farewell(), max(begun_ns, self.bus.now_ns)
                self.bus.put(process.name, farewell.channel, farewell.name, farewell.payload, at_ns)
                self.leave(process.name)

        hub.is_closing, process.turn = True, turn
        turn(begun_ns)

    def leave(self, name: str) -> None:
        """Remove an ended process; messages in flight to it are lost."""
        self.processes.pop(name)
        self._behind.pop(name, None)
        if name == channels.SUPERVISOR:
            self._hub_hears(False)

    def _hub_hears(self, is_alive: bool) -> None:
        """Report the supervisor's presence to the vHub."""
        if channels.VHUB in self.processes:
            self.hub.orphan.hear(is_alive, self.now_of(channels.VHUB))

    def _keep(self, now_ns: int, process: Process, action: Any) -> None:
        """Hand journal records, messages and log lines to the settings' callbacks."""
        settings = self.settings
        if isinstance(action, Journal):
            self._trace(now_ns, process, "journal", "", action.record)
            if process.core is self.hub:
                self.hub_journal.append(action.record)
            if settings.keeps_journals and process.core is self.supervisor:
                self.journal.append(action.record)
            if settings.on_journal is not None:
                settings.on_journal(process.name, action.record)
        elif isinstance(action, Closing):
            self.hub_journal.captured.tick = max(self.hub_journal.captured.tick, action.frame.tick)
            if settings.on_closing is not None:
                settings.on_closing(action)
        elif isinstance(action, Epoch):
            self.hub_journal.captured.epoch = action.epoch
            if settings.on_epoch is not None:
                settings.on_epoch(action)
        elif isinstance(action, Log) and settings.on_log is not None:
            settings.on_log(process.name, action.level, action.text)

    def _trace(  # what a Traced has
        self, now_ns: int, process: Process, what: str, channel: str, payload: bytes, name: str = ""
    ) -> None:
        if self.settings.observer is not None and what in self.settings.observes:
            self.settings.observer(Traced(now_ns, process.name, what, channel, payload, name))

    def _report_commits(self, was_cut: bool) -> None:
        """Report the committed frames; a commit that a crashed supervisor had not journalled does not count."""
        frames = self._frames.copy()
        self._frames.clear()
        written = fold(self.supervisor.state.deployment, self.journal).frame.tick if was_cut else frames[-1].tick
        for frame in frames:
            if frame.tick <= written:
                self._last_commit_ns = self.bus.now_ns
                if self.settings.on_commit is not None:
                    self.settings.on_commit(frame)
                self._next += self._at_tick.pop(frame.tick, ())  # between two turns, like all outside events

    def _where(self) -> str:
        nodes = {name: process.core.waiting_for for name, process in self.processes.items() if name in self.solvers}
        tick = self.supervisor.state.frame.tick
        return f"stuck at tick {tick}: nodes wait for {nodes}, vHub for {self.hub.waiting_for!r}"

    # --- faults and requests -----------------------------------------------------------------------------------------

    def at_tick(self, tick: int, action: Callable[[], object]) -> None:
        """Call `action` when frame `tick` is committed."""
        self._at_tick.setdefault(tick, []).append(action)

    def soon(self, action: Callable[[], object]) -> None:
        """Call `action` between two turns; safe in a signal handler."""
        self._next.append(action)

    def later(self, after_ns: int, action: Callable[[], object]) -> None:
        """Call `action` when some virtual time has passed."""
        self._boots += 1
        heappush(self._timers, (self.bus.now_ns + after_ns, self._boots, action))

    def _enter_clients(self) -> None:
        """Add the players of the deployment, the lockstep clients of the rehearsal, and those of gateways."""
        deployment = self.supervisor.state.deployment
        for name, player in sorted(deployment.players.items()):
            assert player.lockstep, "a rehearsal has lockstep players only"
            self._enter_player(name, "boot")
        gateways = {name: _untriggered for name in deployment.gateways if deployment.clients[name].lockstep}
        for name, client in sorted((gateways | dict(self.settings.clients)).items()):
            core = ClientCore(name, "boot", self.now_of(name))
            self.enter(name, core, client(core), channels.CLIENT_READS)

    def _enter_player(self, name: str, boot: str) -> None:
        """Add a player's process, with new memory; if the player's code fails, it reports the error and ends."""
        core = ClientCore(name, boot, self.now_of(name))
        loop = self.players[name] = PlayerLoop(core, load_player)

        def turn(now_ns: int) -> None:
            self.at_work.tick = -1 if core.go is None else core.go.tick
            try:
                self.at_work.acts = True
                loop.step(now_ns)
                self.at_work.acts = False
            except (PlayerError, Unanswered) as error:
                self.at_work.acts = False
                report_failure(core, error)
                self.soon(lambda: self.leave(name))

        self.enter(name, core, turn, channels.CLIENT_READS)
        self.processes[name].stood = core.rest

    def _client_gone(self, name: str) -> None:
        """Report the end of a client's presence to the vHub."""
        hub = self.processes.get(channels.VHUB)
        if hub is not None:
            self.hub.client_gone(name, hub.clock.at(self.bus.now_ns))
            self.take_turn(hub)

    def kill(self, name: str) -> None:
        """End a node, a player or the supervisor at once: messages in flight to it are lost, its presence ends."""
        self.leave(name)
        if name in self.players:
            self._client_gone(name)
        elif name in self.solvers:
            self.solvers.pop(name).close()
            self._supervisor_sees_gone(name)

    def end_amid(self, name: str, actions: int) -> None:
        """End the supervisor amid its next turn, after the first `actions` of its actions."""
        self._dying[name] = actions

    def is_dying(self, name: str) -> bool:
        """Whether a process ends amid its next turn."""
        return name in self._dying

    def start(self, name: str) -> None:
        """Restart a node, a player or the supervisor, with a new boot; the supervisor resumes from its journal."""
        assert name not in self.processes, f"{name} is running"
        if name == channels.SUPERVISOR:
            self._boots += 1
            history = fold(self.supervisor.state.deployment, self.journal)
            boot = f"boot-{self._boots}"
            now_ns = self.now_of(name)
            self.supervisor = self.settings.supervisor(self._run, library_fingerprint(), now_ns, boot, history=history)
            self._enter_supervisor()
        elif name in self.players:
            self._boots_of_players += 1
            self._enter_player(name, f"boot-{self._boots_of_players}")
        else:
            self._enter_node(name, library_fingerprint())
        self.wake(self.processes[name])

    def _start_again(self, name: str, refused: Solver) -> None:
        """End a refused process; restart it after a delay, as a launcher does."""
        if self.solvers.get(name) is not refused:
            return
        self.leave(name)
        self.solvers.pop(name).close()
        self._enter_node(name, library_fingerprint())
        self.pause(name, self.settings.restart_ns)

    def kill_hub(self, ending: Ending = "now", back_ns: int = HUB_BACK_NS) -> None:
        """End the vHub's process, at once or at its next record; restart it after a delay."""
        if channels.VHUB not in self.processes or self.hub_journal.ending or self.hub.ended is not None:
            return
        self._hub_back_ns = back_ns
        if ending == "now":
            self._end_hub()
        else:
            self.hub_journal.ending = ending

    def _end_hub(self) -> None:
        """End the vHub: its pending actions are dropped, and the others see its connections close."""
        self._leave_hub()
        self._supervisor_sees_gone(channels.VHUB)

    def _supervisor_sees_gone(self, name: str) -> None:
        if channels.SUPERVISOR in self.processes:
            self.supervisor.connection_closed(name, self.now_of(channels.SUPERVISOR))
            self.take_turn(self.processes[channels.SUPERVISOR])

    def _leave_hub(self) -> None:
        self.hub_journal.ending = None
        self.leave(channels.VHUB)
        self.hub.actions.clear()
        self.later(self._hub_back_ns, self._start_hub)
        for client in self._clients_here():
            client.core.hub_gone(client.clock.at(self.bus.now_ns))
            self.take_turn(client)

    def _hub_again(self, refused: HubCore) -> None:
        """End a refused vHub, which was never present to the supervisor, and restart it after a delay."""
        if self.hub is refused and channels.VHUB in self.processes:
            self._hub_back_ns = self.settings.restart_ns
            self._leave_hub()

    def _start_hub(self) -> None:
        self._enter_hub(library_fingerprint())
        self.wake(self.processes[channels.VHUB])
        for client in self._clients_here():
            client.core.hub_here(client.clock.at(self.bus.now_ns))
            self.wake(client)

    def _clients_here(self) -> list[Process]:
        return [process for process in self.processes.values() if isinstance(process.core, ClientCore)]

    def pause(self, name: str, for_ns: int) -> None:
        """Stop a process for some virtual time, as SIGSTOP and SIGCONT do; its messages wait."""
        process = self.processes[name]
        process.busy_until_ns = max(process.busy_until_ns, self.bus.now_ns + for_ns)
        process.wake_ns = max(process.wake_ns, process.busy_until_ns)

    def resume(self, name: str) -> None:
        """Continue a stopped process."""
        process = self.processes[name]
        process.busy_until_ns = process.wake_ns = self._soonest_ns = self.bus.now_ns

    def set_forward(self, name: str, by_ns: int) -> None:
        """Let a process's clock jump, as when its machine was suspended."""
        self._clock(name).offset_ns += by_ns
        process = self.processes.get(name)
        if process is not None:
            due_ns = process.due_ns
            self._plan_wake(process)
            process.due_ns = due_ns

    def request(self, verb: str, *, again_ns: int = 0, **arguments: Any) -> str:
        """Send a request to the supervisor, every `again_ns` until it answers (0: once); return the request's id."""
        return self.people.request(verb, again_ns, arguments)
