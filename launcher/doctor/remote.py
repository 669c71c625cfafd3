"""The doctor on a host: tells the clock, takes a question, examines this machine, answers. `foosim-guard` is its entry.

Lines on standard input and output, so that one connection of ssh serves for everything: the greeting; for each `clock`
the wall time in ns; for the question (JSON) the answer (JSON). Then the machine listens, where a vHub of the run would,
until standard input ends: whether others reach it can only be tried.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import IO, Final

import msgspec

from foosim.common import wall_clock
from foosim.common.addresses import parse_address
from foosim.common.errors import Malformed
from foosim.deployment.loader import load_deployment
from foosim.launcher.doctor.checks import Case, Finding, examine
from foosim.launcher.hosts.port_check import listening, why_not_reached
from foosim.protocol.fingerprint import library_fingerprint

GREETING: Final = "foosim-doctor is here"
CLOCK: Final = "clock"
LINE_BYTES_MAX: Final = 1 << 20


class Question(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What is to be run, and what is asked: `host` is which host this machine is.

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
    """What the host finds of itself, and the fingerprint of its arithmetic."""

    fingerprint: str
    findings: list[Finding]


def serve(given: IO[bytes], told: IO[bytes]) -> None:
    """Answer what stands on `given`. Raises Malformed or DeploymentError for a question that is none."""
    _say(told, GREETING.encode())
    while (line := given.readline(LINE_BYTES_MAX).strip()) == CLOCK.encode():
        _say(told, str(wall_clock.now_unix_ns()).encode())
    if not line:
        return
    try:
        question = msgspec.json.decode(line, type=Question)
    except msgspec.DecodeError as error:
        raise Malformed(f"not a question: {error}") from None
    findings = [*examine(case_of(question)), *_reaches(question)]
    with listening(parse_address(question.radio)) if question.radio else nullcontext():
        _say(told, msgspec.json.encode(Answer(library_fingerprint().hex(), findings)))
        given.readline(LINE_BYTES_MAX)


def case_of(question: Question) -> Case:
    """Return what this host is to be examined for: with its own folder of certificates, if the run has any."""
    deployment = load_deployment(question.text, question.name)
    pki = deployment.hosts[question.host].pki
    folder = Path(pki) if pki is not None and question.ca else None
    return Case(deployment, question.listen, question.insecure, folder, host=question.host, ca=question.ca)


def _reaches(question: Question) -> Sequence[Finding]:
    if not question.reach:
        return []
    address = parse_address(question.reach)
    why = why_not_reached(address)
    if not why:
        return [Finding("network", "supervisor", "fine", f"{address} is reached", host=question.host)]
    remedy = "let the firewalls between pass this port, or listen at an address that this host reaches (--listen)"
    return [Finding("network", "supervisor", "problem", f"{address} is not reached: {why}", remedy, question.host)]


def _say(told: IO[bytes], line: bytes) -> None:
    told.write(line + b"\n")
    told.flush()
