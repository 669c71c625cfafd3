"""Asks the hosts of a deployment how they are, all at once, through ssh as a launcher would; `doctor_there` answers.

A host that does not answer is one finding, and holds no other up. What a host says of itself is completed by what only
a comparison tells: its clock, its arithmetic, its version, whether its ports are reached from here. Clocks are looked
at for people, and for the dates of certificates; no run compares them.
"""

from __future__ import annotations

import os
import signal
import subprocess
import tempfile
import threading
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext, suppress
from dataclasses import dataclass, replace
from importlib.metadata import version
from typing import IO, Final

import msgspec

from foosim.common import wall_clock
from foosim.common.addresses import parse_address
from foosim.common.errors import Refused
from foosim.deployment.schema import places
from foosim.launcher.doctor.checks import Case, Finding, examine, fingerprint, is_well
from foosim.launcher.doctor.remote import CLOCK, GREETING, LINE_BYTES_MAX, Answer, Question
from foosim.launcher.hosts.port_check import listening, why_not_reached
from foosim.launcher.hosts.prepare import check_hosts
from foosim.launcher.hosts.ssh import NOT_FOUND, NOT_RUNNABLE, SSH_FAILED, Remote, remotes
from foosim.protocol.channels import VHUB
from foosim.protocol.fingerprint import library_fingerprint
from foosim.runtime.children import GUARD, OTHER_VERSION
from foosim.runtime.transport.certificate_files import read_ca
from foosim.runtime.transport.certificate_folder import CertificateError

LIMIT_S: Final = 40.0
"""How long one host may take: ssh alone tries for ten seconds to connect."""
CLOCK_TRIES: Final = 5
CLOCK_WARN_NS: Final = 50_000_000
GREETING_LINES_MAX: Final = 100
"""A login may say something before it does what it is told."""
HOSTS_AT_ONCE: Final = 32
LAST_LINES: Final = 30
END_S: Final = 5.0


@dataclass(frozen=True, slots=True)
class Told:
    """What was heard of one host: its answer, or a `problem` and its `remedy`.

    Its clock is `offset_ns` ahead of the one here, give or take `error_ns`. `radio` is where a vHub there would listen,
    if that was tried, and `not_reached` why it would not be reached from here.
    """

    remote: Remote
    answer: Answer | None = None
    problem: str = ""
    remedy: str = ""
    offset_ns: int = 0
    error_ns: int = 0
    radio: str = ""
    not_reached: str = ""


def examine_all(case: Case, name: str, text: str, limit_s: float = LIMIT_S) -> list[Finding]:
    """Return the findings of this machine, then those of each host in name order.

    `name` and `text` are those of the deployment's file; a host that says nothing for `limit_s` is not waited for.
    """
    placement = list(_placement(case))
    found = [*examine(case), *placement]
    hosts = [Remote(host, about) for host, about in sorted(case.deployment.hosts.items())]
    if not hosts:
        return found
    address = case.address
    can_be_tried = bool(address.port) and not address.is_wildcard and is_well(placement)
    reach = str(address) if can_be_tried else ""
    question = Question("", name, text, case.listen, case.insecure, _root(case), reach, "")

    def ask_one(remote: Remote) -> Told:
        radio = str(case.radio) if reach and remote.name == places(case.deployment).get(VHUB) else ""
        return ask(remote, msgspec.structs.replace(question, host=remote.name, radio=radio), limit_s)

    listener = listening(address) if can_be_tried else nullcontext()
    with listener, ThreadPoolExecutor(min(len(hosts), HOSTS_AT_ONCE)) as pool:
        told = list(pool.map(ask_one, hosts))
    own = library_fingerprint().hex()
    return [*found, *(finding for one in told for finding in findings_of(one, own, case.deployment.mixed_cpu))]


def _placement(case: Case) -> Iterator[Finding]:
    """Whether what is placed on hosts could connect to here."""
    where = remotes(case.deployment)
    if not where:
        return
    try:
        check_hosts(case.deployment, case.address, where)
    except Refused as refused:
        yield Finding("hosts", "placement", "problem", refused.what, "change the deployment, or --listen")
    else:
        yield Finding("hosts", "placement", "fine", f"{len(where)} processes on {len(case.deployment.hosts)} hosts")


def _root(case: Case) -> str:
    """Return the fingerprint of the run's root; empty for a run without, `unknown` for one that cannot be read."""
    if case.pki is None:
        return ""
    try:
        return fingerprint(read_ca(case.pki, wall_clock.now_utc()))
    except CertificateError:
        return "unknown"


# --- one host --------------------------------------------------------------------------------------------------------


def ask(remote: Remote, question: Question, limit_s: float) -> Told:
    """Ask one host, and return what was heard within a time."""
    words = [remote.path(GUARD), "examine", "--version-of-launcher", version("foosim")]
    with tempfile.TemporaryFile() as errors:
        try:
            process = subprocess.Popen(
                remote.ssh(words), stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=errors, process_group=0
            )
        except FileNotFoundError:
            return Told(remote, problem="there is no ssh here", remedy="install OpenSSH's client")
        is_late = threading.Event()

        def end() -> None:
            is_late.set()
            _kill(process)

        limit = threading.Timer(limit_s, end)
        limit.start()
        try:
            told = _converse(remote, question, process)
        finally:
            limit.cancel()
            code = _end(process)
        if told is not None:
            return told
        errors.seek(0)
        lines = errors.read().decode("utf-8", "replace").splitlines()[-LAST_LINES:]
    if is_late.is_set():
        return Told(remote, problem=f"no answer within {limit_s:g} s", remedy=f"make `{remote.typed}` work")
    return Told(remote, problem=_why(remote, code, lines), remedy=_remedy(remote, code))


def _converse(remote: Remote, question: Question, process: subprocess.Popen[bytes]) -> Told | None:
    """Compare clocks, ask, try to reach what listens there; None when the other side does not take part."""
    assert process.stdin is not None and process.stdout is not None
    given, said = process.stdin, process.stdout
    try:
        if not any(said.readline(LINE_BYTES_MAX).strip() == GREETING.encode() for _ in range(GREETING_LINES_MAX)):
            return None
        offset_ns, error_ns = min((_compare_clocks(given, said) for _ in range(CLOCK_TRIES)), key=lambda pair: pair[1])
        _say(given, msgspec.json.encode(question))
        line = said.readline(LINE_BYTES_MAX)
        answer = msgspec.json.decode(line, type=Answer)
        not_reached = why_not_reached(parse_address(question.radio)) if question.radio else ""
    except (OSError, ValueError, Refused):  # the connection ended, or what came is no answer: how it ended says why
        return None
    return Told(remote, answer, "", "", offset_ns, error_ns, question.radio, not_reached)


def _compare_clocks(given: IO[bytes], said: IO[bytes]) -> tuple[int, int]:
    """Return how far the other clock is ahead of ours, and how far that may be off: half of what the way took."""
    before_ns = wall_clock.now_unix_ns()
    _say(given, CLOCK.encode())
    there_ns = int(said.readline(LINE_BYTES_MAX))
    after_ns = wall_clock.now_unix_ns()
    return there_ns - (before_ns + after_ns) // 2, abs(after_ns - before_ns) // 2


def _say(given: IO[bytes], line: bytes) -> None:
    given.write(line + b"\n")
    given.flush()


def _kill(process: subprocess.Popen[bytes]) -> None:
    """End ssh, and what it has started to get there."""
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)


def _end(process: subprocess.Popen[bytes]) -> int:
    """End the conversation, and return how ssh ended."""
    assert process.stdin is not None and process.stdout is not None
    with suppress(OSError):
        process.stdin.close()
    try:
        return process.wait(END_S)
    except subprocess.TimeoutExpired:
        _kill(process)
        return process.wait()
    finally:
        process.stdout.close()


def _why(remote: Remote, code: int, lines: Sequence[str]) -> str:
    """Return why a host has not answered."""
    why = remote.why(code, lines)
    known = code in (SSH_FAILED, NOT_FOUND, NOT_RUNNABLE, OTHER_VERSION)
    return why if known or not lines else f"{why}: {lines[-1].strip()}"


def _remedy(remote: Remote, code: int) -> str:
    """Return what to do about it."""
    if code == SSH_FAILED:
        return f"make `{remote.typed}` work without a password"
    return f"install foosim {version('foosim')} on host {remote.name}, in the folder hosts.{remote.name}.commands"


# --- what it means ---------------------------------------------------------------------------------------------------


def findings_of(told: Told, own_fingerprint: str, mixed_cpu: bool) -> list[Finding]:
    """Return what is to be said of a host: what it found itself, and what comparing it with this machine tells."""
    name, answer = told.remote.name, told.answer
    if answer is None:
        return [Finding("ssh", told.remote.host.destination, "problem", told.problem, told.remedy, name)]
    compared = [
        Finding("ssh", told.remote.host.destination, "fine", "answers", host=name),
        _clock_finding(told),
        _arithmetic_finding(name, answer.fingerprint, own_fingerprint, mixed_cpu),
    ]
    if told.radio:
        compared.append(_radio_finding(name, told.radio, told.not_reached))
    return [*compared, *(replace(finding, host=name) for finding in answer.findings)]


def _clock_finding(told: Told) -> Finding:
    offset_ns, error_ns, name = told.offset_ns, told.error_ns, told.remote.name
    text = f"{offset_ns / 1e6:+.0f} ms against the clock here, within {error_ns / 1e6:.0f} ms"
    if abs(offset_ns) - error_ns <= CLOCK_WARN_NS:
        return Finding("clock", "offset", "fine", text, host=name)
    remedy = "start a time service on both; runs do not mind, logs and the dates of certificates do"
    return Finding("clock", "offset", "warning", text, remedy, name)


def _arithmetic_finding(name: str, there: str, here: str, mixed_cpu: bool) -> Finding:
    if there == here:
        return Finding("arithmetic", "compared", "fine", "is that of this machine", host=name)
    text = f"{there[:16]} is not {here[:16]}, that of this machine"
    if mixed_cpu:
        return Finding("arithmetic", "compared", "warning", text, "mixed_cpu lets it in; runs may differ in bits", name)
    remedy = "use processors and libraries that are alike, or say `mixed_cpu: true` in the deployment"
    return Finding("arithmetic", "compared", "problem", text, remedy, name)


def _radio_finding(name: str, address: str, why: str) -> Finding:
    if not why:
        return Finding("network", "radio plane", "fine", f"{address} is reached from here", host=name)
    remedy = f"let the firewalls between pass this port, or correct hosts.{name}.address"
    return Finding("network", "radio plane", "problem", f"{address} is not reached from here: {why}", remedy, name)
