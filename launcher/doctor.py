"""Checks whether a deployment could run, here and on its hosts, with a remedy for each problem.

A check is a row of `CHECKS`: a function that returns findings about one subject; it changes and starts nothing. It
concerns the machine it runs on. The hosts of a deployment run the checks in parallel, through ssh, and are compared
with this machine: clock, arithmetic, reached ports.

Lines on standard input and output of `foosim guard`: the greeting; for the question (JSON) the wall time in ns and the
answer (JSON). Then the host listens, where a vHub of the run would, until standard input ends, so that others can test
the connection. A host that does not answer is one finding, and does not delay the others.
"""

from __future__ import annotations

import ctypes
import importlib.metadata
import os
import platform
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext, suppress
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import IO, Final, Literal

import msgspec
from packaging.requirements import Requirement

from foosim.client.loading import player_findings
from foosim.common import limits, wall_clock
from foosim.common.addresses import Address, check_listen, parse_address
from foosim.common.errors import Malformed, Refused, describe
from foosim.deployment.loader import load_deployment
from foosim.deployment.processes import joint_processes, processes_of
from foosim.deployment.schema import Deployment, places
from foosim.kernels import KERNELS
from foosim.launcher.hosts import (
    NOT_FOUND,
    NOT_RUNNABLE,
    SSH_FAILED,
    Remote,
    check_hosts,
    listening,
    remotes,
    why_not_free,
    why_not_reached,
)
from foosim.launcher.pki import fingerprint, identities_on
from foosim.launcher.plan import place_of
from foosim.protocol import identity
from foosim.protocol.channels import SUPERVISOR, VHUB
from foosim.protocol.fingerprint import is_compiled, library_fingerprint
from foosim.runtime.process import FOOSIM, OTHER_VERSION, script
from foosim.runtime.run_folder import hosted_folder, runs_folder
from foosim.runtime.transport.certificate_files import hosts_of, read_ca, read_certificate
from foosim.runtime.transport.certificate_folder import CA_FILE, CA_KEY_FILE, KEY_SUFFIX, CertificateError
from foosim.runtime.transport.certificates import certificate_path, load_credentials

State = Literal["fine", "warning", "problem"]

HERE: Final = "here"
PLACEMENT: Final = "placement"
TIME_ERROR: Final = 5
"""Result of `adjtimex` for an unsynchronized clock."""
PYTHONS: Final = ((3, 11), (3, 14))
"""The first and the last version of Python that foosim supports."""


@dataclass(frozen=True, slots=True)
class Finding:
    """Result of one check on one host. `remedy` is empty when all is fine."""

    check: str
    subject: str
    state: State
    text: str
    remedy: str = ""
    host: str = HERE


@dataclass(frozen=True, slots=True)
class Case:
    """The planned run: the deployment, its address, and its certificates if any."""

    deployment: Deployment
    listen: str
    insecure: bool = False
    pki: Path | None = None
    captures: Path = Path("captures")
    host: str | None = None
    """Which host of the deployment this machine is; None is the supervisor's."""
    ca: str = ""
    """On a host: the fingerprint of the root that the run has; empty for a run without certificates."""
    reach: str = ""
    """On a host: the supervisor's planned address, with a test listener; empty where that cannot be tested."""

    @property
    def is_there(self) -> bool:
        return self.host is not None

    @property
    def address(self) -> Address:
        """Where the supervisor would listen."""
        return check_listen(self.listen, self.insecure, 2, self.pki is not None or bool(self.ca))

    @property
    def radio(self) -> Address:
        """Where the vHub would."""
        address, place = self.address.next_port(), places(self.deployment).get(VHUB)
        return address if place is None else replace(address, host=self.deployment.hosts[place].address)

    def provide(self, more: str = "") -> str:
        """Return the command that issues missing certificates, and sends them to a host."""
        return f"foosim pki init DIR FILE{more} --send" if self.is_there else f"foosim pki init {self.pki} FILE{more}"


def examine(case: Case) -> list[Finding]:
    """Return the findings of all checks on this machine, in the order of the checks."""
    return [Finding(name, *row, host=case.host or HERE) for name, check in CHECKS.items() for row in check(case)]


def is_well(findings: Iterable[Finding]) -> bool:
    """Whether there is no problem; warnings do not count."""
    return all(finding.state != "problem" for finding in findings)


_Row = tuple[str, State, str, str]
"""Subject, state, text, remedy."""


def _processes(case: Case) -> Iterator[_Row]:
    """Which roles share a process, on this machine."""
    hosts = places(case.deployment)
    for process in processes_of(case.deployment).values():
        if len(process.roles) > 1 and hosts.get(process.roles[0]) == case.host:
            yield process.name, "fine", f"has {', '.join(process.roles)}", ""


def _versions(case: Case) -> Iterator[_Row]:
    """Versions of foosim, Python and each library against the requirements; whether hot path and kernels
    are compiled."""
    yield "foosim", "fine", f"{importlib.metadata.version('foosim')}, protocol {limits.PROTOCOL_VERSION}", ""
    python = platform.python_version()
    if PYTHONS[0] <= sys.version_info[:2] <= PYTHONS[1]:
        yield "python", "fine", python, ""
    else:
        first, last = (".".join(map(str, version)) for version in PYTHONS)
        yield "python", "warning", f"{python}; foosim supports {first} to {last}", f"install Python {last}"
    slower = "interpreted: the same bits, more slowly; installed by pip, where there is a C compiler, it is compiled"
    yield "hot path", "fine", "compiled" if is_compiled() else slower, ""
    yield "kernels", "fine", KERNELS, ""
    for line in importlib.metadata.requires("foosim") or ():
        wanted = Requirement(line)
        if wanted.marker is None or wanted.marker.evaluate({"extra": ""}):
            yield _library(wanted)


def _library(wanted: Requirement) -> _Row:
    try:
        found = importlib.metadata.version(wanted.name)
    except importlib.metadata.PackageNotFoundError:
        return wanted.name, "problem", "not installed", f"pip install '{wanted}'"
    if not wanted.specifier.contains(found, prereleases=True):
        return wanted.name, "problem", f"{found} is not {wanted.specifier}", f"pip install '{wanted}'"
    return wanted.name, "fine", found, ""


def _engine(case: Case) -> Iterator[_Row]:
    """Whether the engine of the deployment's nodes on this machine can be built."""
    deployment, hosts = case.deployment, places(case.deployment)
    if any(hosts.get(node) == case.host for node in deployment.nodes):
        engine = deployment.engine_type
        yield engine.name, "problem" if engine.lack else "fine", engine.lack, engine.instead if engine.lack else ""


def _arithmetic(case: Case) -> Iterator[_Row]:
    """Nodes whose fingerprints differ are refused, unless the deployment has `mixed_cpu: true`."""
    yield "fingerprint", "fine", f"{library_fingerprint().hex()[:16]} on {platform.machine()}", ""


# --- certificates ----------------------------------------------------------------------------------------------------


def _certificates(case: Case) -> Iterator[_Row]:
    """The certificate of each process here: present, of this root, with its key, valid, for this host."""
    folder = case.pki
    if folder is None and case.ca:
        remedy = f"set hosts.{case.host}.pki to their folder, then {case.provide()}"
        yield "folder", "problem", "the deployment has no folder for them on this host", remedy
        return
    if folder is None:
        yield "folder", "fine", "none: only this machine can take part, or with --insecure any process", ""
        return
    try:
        ca = read_ca(folder, wall_clock.now_utc())
    except CertificateError as error:
        yield CA_FILE, "problem", error.what, case.provide()
        return
    if case.ca not in ("", fingerprint(ca)):
        yield CA_FILE, "problem", "another root than the run's", case.provide()
        return
    yield CA_FILE, "fine", "", ""
    if (folder / CA_KEY_FILE).exists():
        remedy = "remove it there" if case.is_there else "keep it where certificates are issued"
        yield CA_KEY_FILE, "problem" if case.is_there else "warning", "is beside the certificates", remedy
    declared = [f"process.{name}" for name in joint_processes(case.deployment, ("deployed",))]
    for who in identities_on(case.deployment, case.host):
        if who in declared or identity.parse_identity(who)[0] != "process":
            yield _certificate(folder, who, case)
    for path in sorted(folder.glob(f"*{KEY_SUFFIX}")):
        if path.stat().st_mode & 0o077:
            yield path.name, "problem", "can be read by others", f"chmod 600 {path}"


def _certificate(folder: Path, who: str, case: Case) -> _Row:
    """Check the certificate of one process of the run."""
    path = certificate_path(folder, who)
    if not path.exists():
        return who, "problem", "no certificate", case.provide()
    try:
        credentials = load_credentials(folder, who)
    except CertificateError as error:
        return who, "problem", error.what, f"{case.provide()}; if that refuses it, remove both files before"
    assert credentials is not None and credentials.until is not None
    address = {SUPERVISOR: case.address, VHUB: case.radio}.get(who)
    hosts = [host.lower() for host in hosts_of(read_certificate(path))]
    if address is not None and not address.is_wildcard and address.host.strip("[]").lower() not in hosts:
        remedy = case.provide(f" --host {address.host}")
        return who, "problem", f"is for {', '.join(hosts)}, not for {address.host}", remedy
    soon = credentials.ends_soon(wall_clock.now_utc())
    if soon:
        return who, "warning", soon, case.provide()
    return who, "fine", f"until {credentials.until:%Y-%m-%d}", ""


# --- this machine ----------------------------------------------------------------------------------------------------


def _ports(case: Case) -> Iterator[_Row]:
    """Whether the processes that listen on this machine can use their addresses."""
    if not case.is_there:
        yield _port("simulation plane", case.address)
    if places(case.deployment).get(VHUB) == case.host:
        yield _port("radio plane", case.radio)


def _port(plane: str, address: Address) -> _Row:
    why, remedy = why_not_free(address)
    if why:
        return plane, "problem", f"{address}: {why}", remedy
    return plane, "fine", f"{address} is free" if address.port else f"{address}: the system chooses a free port", ""


def _network(case: Case) -> Iterator[_Row]:
    """Whether processes on this host would reach the supervisor."""
    if not case.reach:
        return
    if why := why_not_reached(parse_address(case.reach)):
        remedy = "let the firewalls between pass this port, or listen at an address that this host reaches (--listen)"
        yield "supervisor", "problem", f"{case.reach} is not reached: {why}", remedy
    else:
        yield "supervisor", "fine", f"{case.reach} is reached", ""


def _placement(case: Case) -> Iterator[_Row]:
    """On the supervisor's machine: whether processes on other hosts could connect to it."""
    where = remotes(case.deployment)
    if case.is_there or not where:
        return
    try:
        check_hosts(case.deployment, case.address, where)
    except Refused as refused:
        yield PLACEMENT, "problem", refused.what, "change the deployment, or --listen"
    else:
        yield PLACEMENT, "fine", f"{len(where)} processes on {len(case.deployment.hosts)} hosts", ""


def _clock(case: Case) -> Iterator[_Row]:
    """Clocks of machines need not agree, but certificates and file names go by them."""
    now = wall_clock.now_utc()
    text = f"{now:%Y-%m-%d %H:%M:%S} UTC"
    if _clock_state() == TIME_ERROR:
        remedy = "start a time service (chrony, systemd-timesyncd); the dates of certificates go by this clock"
        yield "clock", "warning", f"{text}, and nothing keeps it in time", remedy
    else:
        yield "clock", "fine", text, ""


def _clock_state() -> int:
    """Return the kernel's clock state; TIME_ERROR if it is not synchronized, 0 if it cannot be read."""
    if sys.platform != "linux":
        return 0
    nothing_to_set = ctypes.create_string_buffer(512)
    return int(ctypes.CDLL(None).adjtimex(nothing_to_set))


def _disk(case: Case) -> Iterator[_Row]:
    """Room and the right to write where runs keep journals and captures go."""
    here = {"runs": runs_folder(), "captures": case.captures}
    for subject, folder in ({"runs": hosted_folder()} if case.is_there else here).items():
        place = place_of(case.deployment.capture, folder.absolute(), is_capture=subject == "captures")
        text = f"{place.there}: {place.room} (capture.reserve)"
        if not os.access(place.there, os.W_OK | os.X_OK):
            remedy = "let this user write there, or start elsewhere"
            yield subject, "problem", f"{place.there} cannot be written", remedy
        elif place.is_refused:
            yield subject, "problem", text, f"make room, or lower the reserve: at it {place.then}, and none is started"
        elif place.is_low:
            yield subject, "warning", text, f"make room: at the reserve {place.then}"
        else:
            yield subject, "fine", text, ""


def _commands(case: Case) -> Iterator[_Row]:
    """The command that `up` starts processes with."""
    found = shutil.which(script())
    if found is None:
        yield FOOSIM, "problem", "not found beside this Python or on PATH", "install foosim in this environment"
    else:
        yield FOOSIM, "fine", found, ""


def _players(case: Case) -> Iterator[_Row]:
    """Whether the classes of the players that are to run on this machine can be imported here."""
    deployment, elsewhere = case.deployment, places(case.deployment)
    here = [name for name in sorted(deployment.players) if elsewhere.get(name) == case.host]
    wrong = {finding.location[1]: finding for finding in player_findings(deployment, here)}
    for name in here:
        found, path = wrong.get(name), deployment.players[name].class_
        if found is None:
            yield name, "fine", path, ""
            continue
        text = describe(found.what, path, found.nearest)
        where = f"as ssh to {case.host} has it: in a file that its shell reads" if case.is_there else "of `up`"
        yield name, "problem", text, f"correct players.{name}.class, or put the module's folder on PYTHONPATH {where}"


CHECKS: Final[dict[str, Callable[[Case], Iterator[_Row]]]] = {
    "processes": _processes,
    "versions": _versions,
    "engine": _engine,
    "arithmetic": _arithmetic,
    "command": _commands,
    "players": _players,
    "certificates": _certificates,
    "ports": _ports,
    "clock": _clock,
    "disk": _disk,
    "hosts": _placement,
    "network": _network,
}
"""Every check by its name, in the order in which they are shown."""


GREETING: Final = "foosim doctor is here"
LINE_BYTES_MAX: Final = 1 << 20
LIMIT_S: Final = 40.0
"""How long one host may take: ssh alone tries for ten seconds to connect."""
GREETING_LINES_MAX: Final = 100
"""A login may print lines before the command's output."""
HOSTS_AT_ONCE: Final = 32
LAST_LINES: Final = 30
CLOCK_WARN_NS: Final = 50_000_000


class Question(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The planned run, and the requested checks: `host` is the name of this machine.

    `ca` is the fingerprint of the run's root, empty for a run without certificates. `reach` is the address of the
    supervisor, where the doctor listens meanwhile, `radio` that of a vHub on this host; empty ones are not tried.
    """

    host: str
    name: str
    text: str
    listen: str
    insecure: bool
    ca: str
    reach: str
    radio: str


class Answer(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The host's own findings, and the fingerprint of its arithmetic."""

    fingerprint: str
    findings: list[Finding]


def examine_all(case: Case, name: str, text: str, limit_s: float = LIMIT_S) -> list[Finding]:
    """Return the findings of this machine, then those of each host in name order.

    `name` and `text` are those of the deployment's file; a host has `limit_s` to answer.
    """
    found = examine(case)
    hosts = [Remote(host, about) for host, about in sorted(case.deployment.hosts.items())]
    if not hosts:
        return found
    address = case.address
    is_placed = is_well(finding for finding in found if finding.subject == PLACEMENT)
    can_be_tried = bool(address.port) and not address.is_wildcard and is_placed
    reach = str(address) if can_be_tried else ""
    root = ""
    if case.pki is not None:
        root = "unknown"
        with suppress(CertificateError):
            root = fingerprint(read_ca(case.pki, wall_clock.now_utc()))
    question = Question("", name, text, case.listen, case.insecure, root, reach, "")

    def check_host(remote: Remote) -> list[Finding]:
        radio = str(case.radio) if reach and remote.name == places(case.deployment).get(VHUB) else ""
        about = msgspec.structs.replace(question, host=remote.name, radio=radio)
        return checks_of(remote, about, limit_s, case.deployment.mixed_cpu)

    listener = listening(address) if can_be_tried else nullcontext()
    with listener, ThreadPoolExecutor(min(len(hosts), HOSTS_AT_ONCE)) as pool:
        return [*found, *(finding for findings in pool.map(check_host, hosts) for finding in findings)]


# --- one host --------------------------------------------------------------------------------------------------------


def checks_of(remote: Remote, question: Question, limit_s: float, mixed_cpu: bool = False) -> list[Finding]:
    """Run the checks of one host within a time limit; return its findings, and those of the comparison with it."""

    def unanswered(problem: str, remedy: str) -> list[Finding]:
        return [Finding("ssh", remote.host.destination, "problem", problem, remedy, remote.name)]

    words = [remote.foosim, "guard", "examine", "--version-of-launcher", version("foosim")]
    with tempfile.TemporaryFile() as errors:
        try:
            process = subprocess.Popen(
                remote.ssh(words), stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=errors, process_group=0
            )
        except FileNotFoundError:
            return unanswered("there is no ssh here", "install OpenSSH's client")
        assert process.stdin is not None and process.stdout is not None
        is_late = threading.Event()

        def end() -> None:
            is_late.set()
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)  # with its child processes

        limit = threading.Timer(limit_s, end)
        limit.start()
        try:
            findings = _converse(remote, question, process.stdin, process.stdout, mixed_cpu)
        finally:
            with suppress(OSError):
                process.stdin.close()
            code = process.wait()
            limit.cancel()
            process.stdout.close()
        errors.seek(0)
        lines = errors.read().decode("utf-8", "replace").splitlines()[-LAST_LINES:]
    if findings:
        return findings
    if is_late.is_set():
        return unanswered(f"no answer within {limit_s:g} s", f"make `{remote.typed}` work")
    why = remote.why(code, lines)
    if code == SSH_FAILED:
        return unanswered(why, f"make `{remote.typed}` work without a password")
    if lines and code not in (NOT_FOUND, NOT_RUNNABLE, OTHER_VERSION):
        why = f"{why}: {lines[-1].strip()}"
    folder = f"in the folder hosts.{remote.name}.commands"
    return unanswered(why, f"install foosim {version('foosim')} on host {remote.name}, {folder}")


def _converse(
    remote: Remote, question: Question, requests: IO[bytes], replies: IO[bytes], mixed_cpu: bool
) -> list[Finding]:
    """Compare clocks, request the checks, test the listener there; return nothing when the other side is silent."""
    try:
        if not any(replies.readline(LINE_BYTES_MAX).strip() == GREETING.encode() for _ in range(GREETING_LINES_MAX)):
            return []
        before_ns = wall_clock.now_unix_ns()
        _send(requests, msgspec.json.encode(question))
        there_ns = int(replies.readline(LINE_BYTES_MAX))
        after_ns = wall_clock.now_unix_ns()
        answer = msgspec.json.decode(replies.readline(LINE_BYTES_MAX), type=Answer)
        not_reached = why_not_reached(parse_address(question.radio)) if question.radio else ""
    except (OSError, ValueError, Refused):  # the connection ended, or the line is invalid: the exit code has the reason
        return []
    own, offset_ns, error_ns = library_fingerprint().hex(), there_ns - (before_ns + after_ns) // 2, after_ns - before_ns
    return compared(remote, answer, own, mixed_cpu, offset_ns, error_ns // 2, question.radio, not_reached)


def compared(  # what was found out of a host
    remote: Remote,
    answer: Answer,
    own: str,
    mixed_cpu: bool = False,
    offset_ns: int = 0,
    error_ns: int = 0,
    radio: str = "",
    not_reached: str = "",
) -> list[Finding]:
    """Return the findings about a host: those of the comparison with this machine, then its own.

    Its clock is `offset_ns` ahead of the one here, give or take `error_ns`; `own` is the fingerprint of this machine's
    arithmetic. `radio` is where a vHub there would listen, if that was tried, and `not_reached` why it would not be
    reached from here.
    """
    found: list[Finding] = []

    def add(check: str, subject: str, text: str, state: State = "fine", remedy: str = "") -> None:
        found.append(Finding(check, subject, state, text, remedy, remote.name))

    add("ssh", remote.host.destination, "answers")
    text = f"{offset_ns / 1e6:+.0f} ms against the clock here, within {error_ns / 1e6:.0f} ms"
    if abs(offset_ns) - error_ns <= CLOCK_WARN_NS:
        add("clock", "offset", text)
    else:
        remedy = "start a time service on both; runs do not mind, logs and the dates of certificates do"
        add("clock", "offset", text, "warning", remedy)
    text = f"{answer.fingerprint[:16]} is not {own[:16]}, that of this machine"
    if answer.fingerprint == own:
        add("arithmetic", "compared", "is that of this machine")
    elif mixed_cpu:
        add("arithmetic", "compared", text, "warning", "mixed_cpu lets it in; runs may differ in bits")
    else:
        remedy = "use equal processors and libraries, or set `mixed_cpu: true` in the deployment"
        add("arithmetic", "compared", text, "problem", remedy)
    if not_reached:
        remedy = f"let the firewalls between pass this port, or correct hosts.{remote.name}.address"
        add("network", "radio plane", f"{radio} is not reached from here: {not_reached}", "problem", remedy)
    elif radio:
        add("network", "radio plane", f"{radio} is reached from here")
    return [*found, *(replace(finding, host=remote.name) for finding in answer.findings)]


def _send(stream: IO[bytes], line: bytes) -> None:
    stream.write(line + b"\n")
    stream.flush()


# --- answering -------------------------------------------------------------------------------------------------------


def serve(requests: IO[bytes], replies: IO[bytes]) -> None:
    """Answer the requests on `requests`. Raises Malformed or DeploymentError for an invalid question."""
    _send(replies, GREETING.encode())
    line = requests.readline(LINE_BYTES_MAX).strip()
    if not line:
        return
    _send(replies, str(wall_clock.now_unix_ns()).encode())
    try:
        question = msgspec.json.decode(line, type=Question)
    except msgspec.DecodeError as error:
        raise Malformed(f"not a question: {error}") from None
    deployment = load_deployment(question.text, question.name)
    pki = deployment.hosts[question.host].pki
    folder = Path(pki) if pki is not None and question.ca else None  # its own, if the run has any
    host, ca, reach = question.host, question.ca, question.reach
    case = Case(deployment, question.listen, question.insecure, folder, host=host, ca=ca, reach=reach)
    findings = examine(case)
    with listening(parse_address(question.radio)) if question.radio else nullcontext():
        _send(replies, msgspec.json.encode(Answer(library_fingerprint().hex(), findings)))
        requests.readline(LINE_BYTES_MAX)
