"""Checks whether a deployment could run on this machine, with a remedy for each problem.

Each check is a function that returns findings about one subject, and a row of `CHECKS`; it changes and starts nothing.
A check concerns the machine it runs on, the supervisor's or a host of the deployment: `doctor.remote` collects the
findings of the hosts, and compares them with this machine.
"""

from __future__ import annotations

import ctypes
import importlib.metadata
import os
import platform
import shutil
import sys
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final, Literal

from packaging.requirements import Requirement

from foosim.client.loading import player_findings
from foosim.common import limits, wall_clock
from foosim.common.addresses import Address, check_listen, parse_address
from foosim.common.errors import Refused, describe
from foosim.deployment.processes import joint_processes, processes_of
from foosim.deployment.schema import Deployment, places
from foosim.launcher.hosts.prepare import check_hosts, why_not_free, why_not_reached
from foosim.launcher.hosts.ssh import remotes
from foosim.launcher.new_capture import place_of
from foosim.launcher.pki import fingerprint, identities_on
from foosim.protocol import identity
from foosim.protocol.channels import SUPERVISOR, VHUB
from foosim.protocol.fingerprint import is_compiled, library_fingerprint
from foosim.runtime.children import FOOSIM, script
from foosim.runtime.run_folder import hosted_folder, runs_folder
from foosim.runtime.transport.certificate_files import hosts_of, read_ca, read_certificate
from foosim.runtime.transport.certificate_folder import CA_FILE, CA_KEY_FILE, KEY_SUFFIX, CertificateError
from foosim.runtime.transport.certificates import certificate_path, load_credentials

State = Literal["fine", "warning", "problem"]

HERE: Final = "here"
PLACEMENT: Final = "placement"
TIME_ERROR: Final = 5
"""Result of `adjtimex` for a clock that is not synchronized."""
PYTHON_TESTED: Final = (3, 11)


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
    return [Finding(name, *said, host=case.host or HERE) for name, check in CHECKS.items() for said in check(case)]


def is_well(findings: Iterable[Finding]) -> bool:
    """Whether there is no problem; warnings do not count."""
    return all(finding.state != "problem" for finding in findings)


_Said = tuple[str, State, str, str]
"""Subject, state, text, remedy."""


def _processes(case: Case) -> Iterator[_Said]:
    """Which roles share a process, on this machine."""
    hosts = places(case.deployment)
    for process in processes_of(case.deployment).values():
        if len(process.roles) > 1 and hosts.get(process.roles[0]) == case.host:
            yield process.name, "fine", f"has {', '.join(process.roles)}", ""


def _versions(case: Case) -> Iterator[_Said]:
    """Versions of foosim, Python and each library against the requirements; whether the hot path is compiled."""
    yield "foosim", "fine", f"{importlib.metadata.version('foosim')}, protocol {limits.PROTOCOL_VERSION}", ""
    python = platform.python_version()
    if sys.version_info[:2] == PYTHON_TESTED:
        yield "python", "fine", python, ""
    else:
        tested = ".".join(map(str, PYTHON_TESTED))
        yield "python", "warning", f"{python}; foosim is tested with {tested}", f"install Python {tested}"
    slower = "interpreted: the same bits, more slowly; installed by pip, where there is a C compiler, it is compiled"
    yield "hot path", "fine", "compiled" if is_compiled() else slower, ""
    for line in importlib.metadata.requires("foosim") or ():
        wanted = Requirement(line)
        if wanted.marker is None or wanted.marker.evaluate({"extra": ""}):
            yield _library(wanted)


def _library(wanted: Requirement) -> _Said:
    try:
        found = importlib.metadata.version(wanted.name)
    except importlib.metadata.PackageNotFoundError:
        return wanted.name, "problem", "not installed", f"pip install '{wanted}'"
    if not wanted.specifier.contains(found, prereleases=True):
        return wanted.name, "problem", f"{found} is not {wanted.specifier}", f"pip install '{wanted}'"
    return wanted.name, "fine", found, ""


def _arithmetic(case: Case) -> Iterator[_Said]:
    """Nodes whose fingerprints differ are refused, unless the deployment has `mixed_cpu: true`."""
    yield "fingerprint", "fine", f"{library_fingerprint().hex()[:16]} on {platform.machine()}", ""


# --- certificates ----------------------------------------------------------------------------------------------------


def _certificates(case: Case) -> Iterator[_Said]:
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
    declared = [identity.process(name) for name in joint_processes(case.deployment, ("deployed",))]
    for who in identities_on(case.deployment, case.host):
        if who in declared or identity.parse_identity(who)[0] != "process":
            yield _certificate(folder, who, case)
    for path in sorted(folder.glob(f"*{KEY_SUFFIX}")):
        if path.stat().st_mode & 0o077:
            yield path.name, "problem", "can be read by others", f"chmod 600 {path}"


def _certificate(folder: Path, who: str, case: Case) -> _Said:
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


def _ports(case: Case) -> Iterator[_Said]:
    """Whether the processes that listen on this machine can use their addresses."""
    if not case.is_there:
        yield _port("simulation plane", case.address)
    if places(case.deployment).get(VHUB) == case.host:
        yield _port("radio plane", case.radio)


def _port(plane: str, address: Address) -> _Said:
    why, remedy = why_not_free(address)
    if why:
        return plane, "problem", f"{address}: {why}", remedy
    return plane, "fine", f"{address} is free" if address.port else f"{address}: the system chooses a free port", ""


def _network(case: Case) -> Iterator[_Said]:
    """Whether processes on this host would reach the supervisor."""
    if not case.reach:
        return
    if why := why_not_reached(parse_address(case.reach)):
        remedy = "let the firewalls between pass this port, or listen at an address that this host reaches (--listen)"
        yield "supervisor", "problem", f"{case.reach} is not reached: {why}", remedy
    else:
        yield "supervisor", "fine", f"{case.reach} is reached", ""


def _placement(case: Case) -> Iterator[_Said]:
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


def _clock(case: Case) -> Iterator[_Said]:
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


def _disk(case: Case) -> Iterator[_Said]:
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


def _commands(case: Case) -> Iterator[_Said]:
    """The command that `up` starts processes with."""
    found = shutil.which(script())
    if found is None:
        yield FOOSIM, "problem", "not found beside this Python or on PATH", "install foosim in this environment"
    else:
        yield FOOSIM, "fine", found, ""


def _players(case: Case) -> Iterator[_Said]:
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


CHECKS: Final[dict[str, Callable[[Case], Iterator[_Said]]]] = {
    "processes": _processes,
    "versions": _versions,
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
