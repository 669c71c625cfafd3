"""Runs the doctor's checks on the hosts of a deployment, in parallel, through ssh like a launcher.

Lines on standard input and output of `foosim guard`, so that one connection serves for everything: the greeting; for
each `clock` the wall time in ns; for the question (JSON) the answer (JSON). Then the host listens, where a vHub of the
run would, until standard input ends, so that others can test the connection. A host that does not answer is one
finding, and does not delay the others.
"""

from __future__ import annotations

import os
import signal
import subprocess
import tempfile
import threading
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext, suppress
from importlib.metadata import version
from pathlib import Path
from typing import IO, Final

import msgspec

from foosim.common import wall_clock
from foosim.common.addresses import parse_address
from foosim.common.errors import Malformed, Refused
from foosim.deployment.loader import load_deployment
from foosim.deployment.schema import places
from foosim.launcher.doctor.checks import (
    PLACEMENT,
    Answer,
    Case,
    Finding,
    Told,
    examine,
    findings_of,
    fingerprint,
    is_well,
)
from foosim.launcher.hosts.port_check import listening, why_not_reached
from foosim.launcher.hosts.ssh import NOT_FOUND, NOT_RUNNABLE, SSH_FAILED, Remote
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
END_S: Final = 5.0


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
    question = Question("", name, text, case.listen, case.insecure, _root(case), reach, "")

    def ask_one(remote: Remote) -> Told:
        radio = str(case.radio) if reach and remote.name == places(case.deployment).get(VHUB) else ""
        return ask(remote, msgspec.structs.replace(question, host=remote.name, radio=radio), limit_s)

    listener = listening(address) if can_be_tried else nullcontext()
    with listener, ThreadPoolExecutor(min(len(hosts), HOSTS_AT_ONCE)) as pool:
        told = list(pool.map(ask_one, hosts))
    own = library_fingerprint().hex()
    return [*found, *(finding for one in told for finding in findings_of(one, own, case.deployment.mixed_cpu))]


def _root(case: Case) -> str:
    """Return the fingerprint of the run's root; empty for a run without, `unknown` for one that cannot be read."""
    if case.pki is None:
        return ""
    try:
        return fingerprint(read_ca(case.pki, wall_clock.now_utc()))
    except CertificateError:
        return "unknown"


# --- asking ----------------------------------------------------------------------------------------------------------


def ask(remote: Remote, question: Question, limit_s: float) -> Told:
    """Run the checks of one host within a time limit."""
    words = [remote.foosim, "guard", "examine", "--version-of-launcher", version("foosim")]
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
    """Compare clocks, request the checks, test the listener there; None when the other side does not respond."""
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
    except (OSError, ValueError, Refused):  # the connection ended, or the line is invalid: the exit code has the reason
        return None
    return Told(remote, answer, "", "", offset_ns, error_ns, question.radio, not_reached)


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


def _kill(process: subprocess.Popen[bytes]) -> None:
    """End ssh and its child processes."""
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
    findings = examine(case_of(question))
    with listening(parse_address(question.radio)) if question.radio else nullcontext():
        _say(told, msgspec.json.encode(Answer(library_fingerprint().hex(), findings)))
        given.readline(LINE_BYTES_MAX)


def case_of(question: Question) -> Case:
    """Return the case for this host, with its own folder of certificates, if the run has any."""
    deployment = load_deployment(question.text, question.name)
    pki = deployment.hosts[question.host].pki
    folder = Path(pki) if pki is not None and question.ca else None
    host, ca, reach = question.host, question.ca, question.reach
    return Case(deployment, question.listen, question.insecure, folder, host=host, ca=ca, reach=reach)
