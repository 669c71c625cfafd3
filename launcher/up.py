"""`up`: starts all processes of a run, here and on other machines, shows the run, and ends it in order.

Supervisor, vHub, nodes, players and gateways are its children and run the simulation; it starts and monitors them,
requests the status that it shows, and forwards a Ctrl-C.
"""

from __future__ import annotations

import shlex
import signal
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any, Final

from foosim.client.control import Control, NoAnswer
from foosim.common.errors import Failed, Refused
from foosim.common.new_run import NEW_RUN
from foosim.deployment.processes import Process, process_of
from foosim.deployment.schema import Player
from foosim.kernels import KERNELS, C
from foosim.launcher.commands import Commands, kinds_of
from foosim.launcher.console_child import ConsoleChild
from foosim.launcher.display import Display, recovery_text
from foosim.launcher.hosts import check_hosts, fetch_capture
from foosim.launcher.hosts import remotes as remotes_of
from foosim.launcher.liveness import QUESTION_S, ChildTimes, OwnTime, Restarts, StalledWatch, SupervisorWatch, waited_s
from foosim.launcher.outcome import Outcome, capture_lines, plan_facts, result_without_supervisor, with_capture
from foosim.launcher.plan import Plan
from foosim.launcher.processes import Child, Launcher
from foosim.launcher.run_options import launch_of
from foosim.protocol.channels import SUPERVISOR, VHUB
from foosim.protocol.run_status import reported_text
from foosim.runtime.command import DONE, FAILED, REFUSED
from foosim.runtime.early_signals import handling
from foosim.runtime.run_folder import RunFolder, RunInfo, create_run
from foosim.runtime.transport.admission import Exposure
from foosim.runtime.transport.certificates import operator_credentials
from foosim.runtime.transport.session import ConnectError
from foosim.world.bodies.visual_meshes import undrawn_meshes

POLL_S: Final = 0.02
"""Polling period while a run starts."""
WATCH_S: Final = 0.1
"""Polling period while it runs; polling costs the run time."""
END_S: Final = 20.0
"""Deadline of an ordered end before processes are stopped: the vHub closes the capture."""
LEAVE_S: Final = 1.0
"""Deadline of the other processes after the supervisor's end, which waits for the vHub's capture."""
AWAY_S: Final = 10.0
"""The same for other machines, whose process ends are noticed later."""
HELD_S: Final = 5.0
"""The time that lines wait for the console's address during a slow start of the run."""
LOST_S: Final = 3.0
"""Time for the supervisor to notice the end of a child; it has no record of one without a hello."""
HANGS_MAX: Final = 2
"""A process with supervisor and players that has hung so often is given up: a player would make it hang again."""
ENDED: Final = ("ended", "failed")
"""States of a run that only waits for its vHub to close the capture."""


class Up:
    """One run whose processes are children of this one."""

    def __init__(
        self,
        plan: Plan,
        capture: Path | None,
        display: Display,
        run: str | None = None,
        resumed: RunFolder | None = None,
        console: Sequence[str] | None = None,
    ) -> None:
        """`capture` is the path of its capture; None captures nothing. `run` names it, `resumed` is the run to resume.

        `console` has the options of the page that is served with the run.
        """
        self.plan = plan
        self.capture = capture
        self.display = display
        machines = remotes_of(plan.deployment)
        check_hosts(plan.deployment, plan.address, machines)
        remotes = {
            name: machines[process.roles[0]] for name, process in plan.processes.items() if process.roles[0] in machines
        }
        self.folder: RunFolder = resumed or create_run(plan.deployment.world, run, plan.stamp)
        self.folder.hold_launcher()
        self.folder.write_launch(launch_of(plan.options, capture))
        units = [name for name, node in plan.deployment.nodes.items() if node.launch == "systemd"]
        self._launcher = Launcher(self.folder.name, remotes, units)
        self._commands = Commands(plan, self.folder, capture)
        self._process_of = process_of(plan.processes)
        self._console = ConsoleChild(self.folder, display, console)
        self._not_home = ""
        """Why the capture was not fetched from the machine on which it was written."""
        self._interrupts, self._gateways = 0, dict[str, str]()
        """Where gateways listen, as shown."""
        self._ending_s = self._lost_s = 0.0
        self._end_requested = False
        """Whether the supervisor was requested to end the run."""
        self._lost: Child | None = None
        self._has_begun = self._has_ended = False
        self._is_resumed, self._is_killed = resumed is not None, False
        self._restarts = Restarts()
        self._own_time = OwnTime(time.monotonic())
        self._child_times = ChildTimes(waited_s)
        self._beside = self._players(self._process_of[SUPERVISOR])
        """The players that share the supervisor's process."""
        self._hangs = 0
        """How often the supervisor's process was killed because it hung."""
        self._supervisor_watch = SupervisorWatch(plan.deployment.deadlines, has_players=bool(self._beside))
        self._stalled_watch = StalledWatch(plan.deployment.deadlines)
        self._control: Control | None = None
        self._status: dict[str, Any] = {}
        """The supervisor's last status."""
        self._stopped: set[str] = set()
        """Nodes that an operator stopped."""
        self._wanted: set[str] = set()
        """Nodes that are to be started when they have ended."""
        self._starts: dict[str, int] = {}
        """Number of handled start requests, by node."""
        self._shown = 0
        """Number of the run's recoveries that were shown."""

    def run(self) -> Outcome:
        """Start everything, show it until it is over, and return how it ended."""
        with handling(self._count), self.display, self._console:  # its pages show the end of the run
            try:
                is_started = self._start()
                if is_started:
                    self._watch()
                if self._can_resume:
                    self._launcher.kill()  # a process that ends in order would finish the capture
                elif not is_started and self._supervisor.exit_code is not None:
                    self._launcher.stop()  # processes that wait for its address
                leave_s = AWAY_S if self._launcher.remotes else LEAVE_S
                self._launcher.wait(leave_s if self.folder.result() is not None else END_S)
            finally:
                self._launcher.stop()
                self._launcher.close()
            if self._is_killed:
                result = self.unended("killed by a second Ctrl-C")
                return Outcome(result, ("killed", *self._capture_lines()), is_killed=True)
            self._bring_home()
            return self._outcome()

    @property
    def _can_resume(self) -> bool:
        """Whether the run can be resumed: its supervisor is gone or has not resumed it, and nothing has ended it."""
        is_gone = self._supervisor.exit_code is not None
        return self.folder.result() is None and (is_gone or (self._is_resumed and not self._has_begun))

    # --- starting ----------------------------------------------------------------------------------------------------

    def _start(self) -> bool:
        """Start all processes; False when the run was over before all had started.

        Those on this machine start at once and wait for the addresses of the planes. Others, and all when a run
        resumes, whose folder has the addresses of before, are started with these.
        """
        folder, display = self.folder, self.display
        first, *others = self.plan.processes.values()
        self._begin(first, None)
        remotes, launch_of = self._launcher.remotes, self.plan.deployment.launch_of
        here = [process for process in others if process.name not in remotes and launch_of(process.name) == "local"]
        early = [] if self._is_resumed else here
        for process in early:
            self._begin(process, None)
        display.say(f"run {folder.name}, logs in {folder.logs}")
        if self.plan.branch is not None:
            display.say(self.plan.branch.text)
        if C is None:
            display.say(f"kernels of rays and pictures run {KERNELS}")
        for undrawn in undrawn_meshes(self.plan.deployment.asset_files):
            display.say(undrawn)
        for process in self.plan.processes.values():
            if len(process.roles) > 1:
                display.say(f"process {process.name} has {', '.join(process.roles)}")
        from foosim.vhub.links.summary import summaries  # while the first process starts
        from foosim.vhub.links.summary_text import start_lines

        for line in start_lines(summaries(self.plan.deployment), str(self.plan.options.file)):
            display.say(line)
        for needs_radio, ready in ((False, self._own_info), (True, self._info_with_radio)):
            info = self._await(ready)
            if info is None:
                return False
            for process in others:
                if process not in early and self._commands.needs_radio(process) == needs_radio:
                    self._begin(process, info)
        return True

    def _bring_home(self) -> None:
        """Fetch the capture from the machine on which the vHub wrote it."""
        process = self._process_of[VHUB]
        remote = self._launcher.remotes.get(process)
        if remote is None or self.capture is None or process not in self._launcher.children:
            return
        try:
            fetch_capture(remote, self.folder.name, self.capture)
        except Failed as failed:
            self._not_home = str(failed)

    def _begin(self, process: Process, info: RunInfo | None) -> None:
        """Start a process, or print the command line of one that is started by hand."""
        name = process.name
        command = self._commands.of(process, info, self._launcher.remotes.get(name))
        if self.plan.deployment.launch_of(name) == "manual":
            is_node = name in self.plan.deployment.nodes
            what = "node" if is_node else "gateway" if name in self.plan.deployment.gateways else "player"
            where = "on its machine" if is_node else "in a terminal of its own"
            if is_node and self.plan.options.pki is not None:
                command, where = [*command[:-1], "DIR"], f"{where}, DIR being the folder of its certificate there"
            self.display.say(f"waiting for {what} {name}; start it {where}: {shlex.join(command)}")
        else:
            self._launch(name, command)

    def _launch(self, name: str, command: Sequence[str]) -> None:
        self._launcher.start(name, command, self.folder.log(name))
        if SUPERVISOR in self._roles(name):
            self._supervisor_watch.started(self._time_of(self._supervisor))

    @property
    def _supervisor(self) -> Child:
        """The process with the supervisor."""
        return self._launcher.children[self._process_of[SUPERVISOR]]

    def _roles(self, name: str) -> tuple[str, ...]:
        """Return the roles of a process."""
        process = self.plan.processes.get(name)
        return (name,) if process is None else process.roles

    def _players(self, name: str) -> list[Player]:
        """Return the players of a process."""
        declared = self.plan.deployment.players
        return [declared[role] for role in self._roles(name) if role in declared]

    def _own_info(self) -> RunInfo | None:
        """Return the contents of the run file, once our supervisor has written it."""
        info = self.folder.info()
        return info if info is not None and info.pid == self._supervisor.process.pid else None

    def _info_with_radio(self) -> RunInfo | None:
        info = self.folder.info()
        return info if info is not None and info.radio else None

    def _await(self, ready: Callable[[], RunInfo | None]) -> RunInfo | None:
        """Return the first value of `ready` besides None; None when the run is over, or is to end, before."""
        held_s = time.monotonic() + HELD_S
        while self._continues():
            if time.monotonic() > held_s:
                self.display.release()
            found = None if self._ending_s else ready()
            if found is not None:
                return found
            time.sleep(POLL_S)
        return None

    # --- running -----------------------------------------------------------------------------------------------------

    def _watch(self) -> None:
        """Show the run until its supervisor has ended."""
        next_s = time.monotonic()
        self._console.start()
        exposure = Exposure(self.plan.address, time.monotonic_ns())
        with ExitStack() as stack:
            while self._continues():
                if reminder := exposure.due(time.monotonic_ns()):
                    self.display.say(reminder)
                self._console.look()
                if time.monotonic() >= next_s:
                    next_s = time.monotonic() + self.display.every_s
                    self._control = self._control or self._connect(stack)
                    if self._control is not None:
                        self._show(self._control)
                time.sleep(WATCH_S)

    def _connect(self, stack: ExitStack) -> Control | None:
        """Connect to the supervisor; None when that does not succeed yet, or when it has ended before."""
        info, supervisor = self._own_info(), self._supervisor
        if info is None:
            return None
        begun_s = self._time_of(supervisor)
        try:
            credentials = operator_credentials(self.plan.options.pki)
            control = Control(
                info.simulation, credentials, lambda: supervisor.exit_code is not None or self._interrupts > 1
            )
            return stack.enter_context(control)
        except ConnectError:
            self._supervisor_watch.unconnected(self._time_of(supervisor) - begun_s)
            return None

    def _show(self, control: Control) -> None:
        supervisor = self._supervisor
        done = [child for child in self._launcher.ended() if child.exit_code == DONE]
        requested_s = self._time_of(supervisor)
        try:
            status = self._status = control.status(QUESTION_S, lambda: supervisor.exit_code is not None)
        except NoAnswer:
            self._supervisor_watch.unanswered(self._time_of(supervisor) - requested_s)
            return
        self._supervisor_watch.answered()
        now_s = self._own_time.at(time.monotonic())
        recoveries = status["recoveries"]
        while self._shown < len(recoveries) and recoveries[self._shown]["outage_ms"] is not None:  # complete
            self.display.say(recovery_text(recoveries[self._shown]))
            self._shown += 1
        if not self._has_ended:
            self.display.show(status, now_s)
        else:  # the supervisor waits as long as there is progress, and so do we
            self.display.show_closing(status)
            self._ending_s = now_s if self._ending_s else 0.0
        self._has_begun = self._has_begun or status["begun"]
        self._has_ended = status["state"] in ENDED
        self._stopped = {name for name, process in status["processes"].items() if process["stopped"]}
        for child in done if not self._has_ended else ():  # they ended before this status, and no end was published
            child.left_early = not (
                self._stopped.intersection(self._roles(child.name)) or child.name in self._launcher.units
            )
        for name, gateway in self.folder.gateways().items():
            if self._gateways.get(name) != gateway["at"]:
                self._gateways[name] = gateway["at"]
                self.display.say(f"gateway {name}: {gateway['at']}")
        self._start_wanted(status["starts"])
        if not self._has_ended and not self._ending_s:
            self._restart_ended(now_s, has_status=True)
        self._end_stalled(status)

    def _start_wanted(self, starts: dict[str, int]) -> None:
        """Start the nodes requested since: stopped ones, ones in back-off, and ones that were given up."""
        for name, count in starts.items():
            child = self._launcher.children.get(self._process_of.get(name, name))
            if child is None or count <= self._starts.get(name, 0) or name in self._stopped:
                continue
            self._restarts.forget(child.name)
            if child.exit_code is not None:
                self._launch(child.name, child.command)
            else:  # it was stopped, and has not ended yet
                self._wanted.add(child.name)
        self._starts = starts
        self._wanted -= {self._process_of.get(name, name) for name in self._stopped}

    def _end_stalled(self, status: dict[str, Any]) -> None:
        """Kill a process that hangs: the run continues without it, and a new one can take part."""
        others = [child for child in self._launcher.alive() if SUPERVISOR not in self._roles(child.name)]
        alive = {role: child for child in others for role in self._roles(child.name)}
        pids = {role: child.process.pid for role, child in alive.items()}
        away = {role for role, child in alive.items() if child.remote is not None}
        times_s = {role: self._time_of(child) for role, child in alive.items()}
        for name, why in self._stalled_watch.look(status, pids, away, times_s).items():
            self._kill(alive[name], why)

    def _end_stalled_supervisor(self, supervisor: Child) -> None:
        """Kill a supervisor that hangs: a new one resumes the run."""
        watch = self._supervisor_watch
        watch.is_found = watch.is_found or self._own_info() is not None
        why = watch.why_killed(self._time_of(supervisor))
        if why and not self._has_ended and not self._ending_s:
            self._hangs += not supervisor.killed
            self._kill(supervisor, why)

    def _time_of(self, child: Child) -> float:
        """Return the time of a child's clock, by which its deadlines run; on another machine it is the launcher's."""
        now_s = self._own_time.at(time.monotonic())
        return now_s if child.remote is not None else self._child_times.at(child.process.pid, now_s)

    def _show_starved(self) -> None:
        """Show that this machine is starved, and by which processes that was observed."""
        pids = {child.name: child.process.pid for child in self._launcher.alive()}
        if warning := self._child_times.warning(pids, self._own_time.at(time.monotonic())):
            self.display.say(warning)

    def _kill(self, child: Child, why: str) -> None:
        if not child.killed:
            child.kill(why)
            self.display.say(f"{child.name} does not answer any more{child.place}: it is killed ({why})")

    def _supervisor_comes_back(self, supervisor: Child, now_s: float) -> bool:
        """Restart a supervisor that ended before the run did; False when the run is over, or it is given up."""
        over = self._ending_s or self._has_ended or self.folder.result() is not None
        began = self.folder.info() is not None or supervisor.how.is_by_signal
        if over or not began or supervisor.exit_code == REFUSED:
            return False
        may_restart = all(player.restart for player in self._beside) or not self._has_begun
        if not may_restart or (self._beside and self._hangs >= HANGS_MAX):
            return False
        if not self._restarts.is_known(supervisor.name):
            self._restart_later(supervisor, now_s)
        self._start_due(now_s)
        return supervisor.name not in self._restarts.failed

    def _restart_ended(self, now_s: float, has_status: bool = False) -> None:
        """Restart processes that ended before the run did; give up processes that fail repeatedly or are refused.

        `has_status`: a new status has reported which nodes are stopped, and whether the run has begun.
        """
        may_decide = self._has_begun or has_status or self._control is None
        for child in self._launcher.ended() if may_decide else ():
            roles = self._roles(child.name)
            is_kept = SUPERVISOR in roles or self._stopped.intersection(roles) or self._restarts.is_known(child.name)
            has_left = child.exit_code == DONE and not child.left_early
            may_be_stopped = child.exit_code == REFUSED and not has_status  # since the last status
            if not (is_kept or has_left or may_be_stopped) and self._comes_back(child):
                self._restart_later(child, now_s)
        self._start_due(now_s)

    def _restart_later(self, child: Child, now_s: float) -> None:
        at_once = any(kind.is_awaited for kind in kinds_of(self._roles(child.name), self.plan.deployment))
        wait_s = None
        if child.exit_code == REFUSED and child.name not in self._wanted:
            self._restarts.give_up(child.name)
        else:
            self._wanted.discard(child.name)
            wait_s = self._restarts.ended(child.name, now_s, at_once=at_once, is_away=child.is_away)
        after = f"restarts in {wait_s:g} s" if wait_s else "starts again"
        if wait_s is None:
            is_node = child.name in self.plan.deployment.nodes
            after = f"is given up; foosim start {child.name} tries it again" if is_node else "is given up"
        self.display.say(f"{child.name} {child.ending}, {after}; its log is {child.log}")

    def _start_due(self, now_s: float) -> None:
        for name in self._restarts.due(now_s):
            child = self._launcher.children[name]
            command: Sequence[str] = child.command
            if VHUB in self._roles(name):  # with the address that clients have
                again, info = self.plan.processes[name], self.folder.info()
                command = self._commands.of(again, info, self._launcher.remotes.get(name))
            self._launch(name, command)

    def _comes_back(self, child: Child) -> bool:
        """Whether the run waits for a replacement of this process, which has ended.

        Before the first tick this holds for a process that something else has ended: one that failed reports why. A
        player with `restart: false` is included: it has not acted, so it loses no state.
        """
        roles = self._roles(child.name)
        restarts = {kind.restart for kind in kinds_of(roles, self.plan.deployment)}
        is_given_up = child.name in self._restarts.failed
        is_lost = child.how.is_by_signal or child.is_away
        if child.name in self.plan.deployment.gateways:
            return not is_given_up
        if "unless refused" in restarts and (child.exit_code == REFUSED or is_given_up):
            return False
        if not self._has_begun:
            has_timed_out = child.exit_code == FAILED and self._restarts.has_ended(self._process_of[SUPERVISOR])
            return (is_lost or has_timed_out) and not is_given_up
        if "after a signal" in restarts:  # a player that ends by itself has failed
            return is_lost and not is_given_up and all(player.restart for player in self._players(child.name))
        return roles != (SUPERVISOR,)  # of which `_supervisor_comes_back` decides

    def _continues(self) -> bool:
        """Handle ended children and Ctrl-C; False when the supervisor has ended."""
        if self._interrupts > 1:
            self._launcher.kill()
            self._is_killed = True
            return False
        supervisor = self._supervisor
        now_s = self._own_time.at(time.monotonic())
        if supervisor.exit_code is not None:
            if self._supervisor_comes_back(supervisor, now_s):
                self._restart_ended(now_s)
                return True
            if supervisor.exit_code == FAILED:  # it may have noticed a loss, and ended, since the last check
                self._look_for_lost(now_s)
            return False
        self._end_stalled_supervisor(supervisor)
        self._show_starved()
        if self._interrupts and not self._ending_s:
            self.display.release()
            self.display.say("ending the run; a second Ctrl-C kills it")
            self._ending_s = now_s
        if not self._has_ended and not self._ending_s:
            lost = self._lost
            if lost is not None and (self._launcher.children[lost.name] is not lost or not self._ends_run(lost)):
                self._lost = None  # it ended before we saw that the run had begun
            self._restart_ended(now_s)
        if self._lost is None:
            self._look_for_lost(now_s)
        elif not self._ending_s and (now_s > self._lost_s + LOST_S or self._lost.exit_code in (DONE, REFUSED)):
            if self._can_resume:
                return False
            self._ending_s = now_s
        if self._ending_s and not self._end_requested:
            self._request_end(supervisor)
        return not self._ending_s or now_s < self._ending_s + END_S

    def _ends_run(self, child: Child) -> bool:
        """Whether the run cannot continue without this child, which has ended."""
        deployment = self.plan.deployment
        if child.name in deployment.gateways and not deployment.clients[child.name].lockstep:
            return False
        return (child.exit_code != DONE or child.left_early) and not self._comes_back(child)

    def _look_for_lost(self, now_s: float) -> None:
        """Record the first child that ended unexpectedly; a killed one precedes the others that ended for it."""
        if self._lost is None:
            bad = [
                child
                for child in self._launcher.ended()
                if self._ends_run(child) and SUPERVISOR not in self._roles(child.name)
            ]
            self._lost = min(bad, key=lambda child: (child.exit_code or 0) > 0, default=None)
            self._lost_s = now_s

    def _request_end(self, supervisor: Child) -> None:
        """Request the end of the run, as `down` does; before the run file exists, a signal kills the supervisor."""
        if self.folder.info() is None:
            return
        self._end_requested = True
        if self._lost is not None and self._control is not None:
            with suppress(Refused):
                self._control.request("down", QUESTION_S, lost=f"{self._lost.name}: it {self._lost.ending}")
                return
        supervisor.process.send_signal(signal.SIGTERM)

    def _outcome(self) -> Outcome:
        """Report how it ended. Without a supervisor's result nothing has ended it: it can be resumed."""
        ended = self.folder.result()
        if self._lost is None and ended is None:
            self._lost = self._supervisor
        reason = "" if self._lost is None else f"lost {self._lost.name}: it {self._lost.ending}"
        if self._lost is self._supervisor and self._lost.exit_code == REFUSED:
            reason = self._lost.how.last_words
        if ended is None:
            result = self.unended(reason)
            may_resume = (self._is_resumed or self._has_begun) and NEW_RUN not in reason
            then = f"; foosim up --resume {self.folder.name} resumes it" if may_resume else ""
            line = f"the run did not end in order{then}"
        else:
            result = {**ended, "reason": reason, "failed": True} if reason and not ended["failed"] else ended
            line = f"the run has ended: {result['reason']}"
            result = with_capture(result, self.capture)
        if ended is not None and result != ended:
            with suppress(OSError):
                self.folder.write_result(result)
        summary = [", ".join(result["summary"])] if result["summary"] else []
        lines = [*map(recovery_text, result["recoveries"][self._shown :]), line, *summary]
        lines += reported_text(result["metrics"])
        return Outcome(result, (*lines, *self._lost_lines(result), *self._capture_lines()))

    def unended(self, reason: str) -> dict[str, Any]:
        """Return the result of a run without an ordered end."""
        known = {"run": self.folder.name, **plan_facts(self.plan.deployment), **self._status}
        return with_capture(result_without_supervisor(known, reason), self.capture)

    def _lost_lines(self, result: Mapping[str, Any]) -> list[str]:
        """Report the child that ended before the run did, with the end of its log, and the path of the log to blame."""
        child = self._lost
        if child is None:
            name = result["reason"].removeprefix("lost ").partition(" ")[0].rstrip(":")
            blamed = self._launcher.children.get(self._process_of.get(name, name))
            if blamed is None:
                return []
            has_failed = blamed.exit_code not in (None, DONE) or blamed.left_early
            how = f"{name} {blamed.ending}{blamed.place}; its log is" if has_failed else f"the log of {name} is"
            return [f"{how} {blamed.log}"]
        reason = result["reason"]
        is_named = child.ending in reason or child.name in self._restarts.failed
        how = f"the log of {child.name} is" if is_named else f"{child.name} {child.ending}; its log is"
        end = [f"    {line}" for line in child.last_lines() if not reason or reason not in line]
        return [f"{how} {child.log}", *end]

    def _capture_lines(self) -> list[str]:
        """Report the capture's path, and whether it is finished, which a process that was killed did not do."""
        journals = None if self._process_of[VHUB] in self._launcher.remotes else self.folder.journals
        lines = capture_lines(self.capture, self.folder.result(), journals)
        return lines or ([self._not_home] if self._not_home else [])

    def _count(self, number: int, frame: object) -> None:
        """Take note of a Ctrl-C, SIGTERM or SIGHUP."""
        self._interrupts += 1
