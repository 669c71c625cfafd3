"""Runs the doctor's checks on the hosts of a deployment, in parallel, through ssh like a launcher.

Lines on standard input and output of `foosim guard`, so that one connection serves for everything: the greeting; for
each `clock` the wall time in ns; for the question (JSON) the answer (JSON). Then the host listens, where a vHub of the
run would, until standard input ends, so that others can test the connection. A host that does not answer is one
finding, and does not delay the others. The others are compared with this machine: clock, arithmetic, reached ports.
Clocks matter for logs and for the dates of certificates; no run compares them.
"""

from __future__ import annotations

import os
import signal
import subprocess
import tempfile
import threading
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext, suppress
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import IO, Final

import msgspec

from foosim.common import wall_clock
from foosim.common.addresses import parse_address
from foosim.common.errors import Malformed, Refused
from foosim.deployment.loader import load_deployment
from foosim.deployment.schema import places
from foosim.launcher.doctor.checks import PLACEMENT, Case, Finding, State, examine, is_well
from foosim.launcher.hosts.prepare import listening, why_not_reached
from foosim.launcher.hosts.ssh import NOT_FOUND, NOT_RUNNABLE, SSH_FAILED, Remote
from foosim.launcher.pki import fingerprint
from foosim.protocol.channels import VHUB
from foosim.protocol.fingerprint import library_fingerprint
from foosim.runtime.children import OTHER_VERSION
from foosim.runtime.transport.certificate_files import read_ca
from foosim.runtime.transport.certificate_folder import CertificateError

GREETING: Final = "foosim doctor is here"
CLOCK: Final = "clock"
LINE_BYTES_MAX: Final = 1 << 20
LIMIT_S: Final = 40.0
"""How long one host may take: ssh alone tries for ten seconds to connect."""
CLOCK_TRIES: Final = 5
GREETING_LINES_MAX: Final = 100
"""A login may print lines before the command's output."""
HOSTS_AT_ONCE: Final = 32
LAST_LINES: Final = 30
CLOCK_WARN_NS: Final = 50_000_000


class Question(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The planned run, and the requested checks: `host` is the name of this machine.

    `ca` is the fingerprint of the run's root, empty for a run without certificates. `reach` is where the supervisor
    would listen, and somebody does meanwhile, `radio` where a vHub on this host would; empty what cannot be tried.
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

    `name` and `text` are those of the deployment's file; a host that says nothing for `limit_s` is not waited for.
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

    def ask_one(remote: Remote) -> list[Finding]:
        radio = str(case.radio) if reach and remote.name == places(case.deployment).get(VHUB) else ""
        about = msgspec.structs.replace(question, host=remote.name, radio=radio)
        return ask(remote, about, limit_s, case.deployment.mixed_cpu)

    listener = listening(address) if can_be_tried else nullcontext()
    with listener, ThreadPoolExecutor(min(len(hosts), HOSTS_AT_ONCE)) as pool:
        return [*found, *(finding for findings in pool.map(ask_one, hosts) for finding in findings)]


# --- asking ----------------------------------------------------------------------------------------------------------


def ask(remote: Remote, question: Question, limit_s: float, mixed_cpu: bool = False) -> list[Finding]:
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


def _converse(remote: Remote, question: Question, given: IO[bytes], said: IO[bytes], mixed_cpu: bool) -> list[Finding]:
    """Compare clocks, request the checks, test the listener there; return nothing when the other side is silent."""
    try:
        if not any(said.readline(LINE_BYTES_MAX).strip() == GREETING.encode() for _ in range(GREETING_LINES_MAX)):
            return []
        offset_ns, error_ns = min((_compare_clocks(given, said) for _ in range(CLOCK_TRIES)), key=lambda pair: pair[1])
        _say(given, msgspec.json.encode(question))
        answer = msgspec.json.decode(said.readline(LINE_BYTES_MAX), type=Answer)
        not_reached = why_not_reached(parse_address(question.radio)) if question.radio else ""
    except (OSError, ValueError, Refused):  # the connection ended, or the line is invalid: the exit code has the reason
        return []
    own = library_fingerprint().hex()
    return compared(remote, answer, own, mixed_cpu, offset_ns, error_ns, question.radio, not_reached)


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


def _compare_clocks(given: IO[bytes], said: IO[bytes]) -> tuple[int, int]:
    """Return the other clock's offset from ours, and its error: half of the round trip."""
    before_ns = wall_clock.now_unix_ns()
    _say(given, CLOCK.encode())
    there_ns = int(said.readline(LINE_BYTES_MAX))
    after_ns = wall_clock.now_unix_ns()
    return there_ns - (before_ns + after_ns) // 2, abs(after_ns - before_ns) // 2


def _say(given: IO[bytes], line: bytes) -> None:
    given.write(line + b"\n")
    given.flush()


# --- answering -------------------------------------------------------------------------------------------------------


def serve(given: IO[bytes], told: IO[bytes]) -> None:
    """Answer the requests on `given`. Raises Malformed or DeploymentError for an invalid question."""
    _say(told, GREETING.encode())
    while (line := given.readline(LINE_BYTES_MAX).strip()) == CLOCK.encode():
        _say(told, str(wall_clock.now_unix_ns()).encode())
    if not line:
        return
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
        _say(told, msgspec.json.encode(Answer(library_fingerprint().hex(), findings)))
        given.readline(LINE_BYTES_MAX)
