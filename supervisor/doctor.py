"""Looks whether a deployment could run here, before it does: what is fine, what is not, and what to do.

Each check is a function that gives findings about one subject, and a row of `CHECKS`; nothing is changed, nothing is
started. Checks of one host are about the machine they run on: for another one, the same command runs there, and its
findings come home as JSON. Neighbours: `doctor_command`, `protocol.certificates`.
"""

from __future__ import annotations

import ctypes
import errno
import importlib.metadata
import os
import platform
import shutil
import socket
import sys
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

from packaging.requirements import Requirement

from foosim.protocol import identity, limits, wall
from foosim.protocol.addresses import Address, check_listen
from foosim.protocol.certificates import (
    CA_KEY_FILE,
    KEY_SUFFIX,
    PASSWORD_SUFFIX,
    CertificateError,
    certificate_path,
    check_certificate,
    check_key,
    hosts_of,
    key_path,
    load_credentials,
    read_ca,
    read_certificate,
    read_password,
)
from foosim.protocol.channels import SUPERVISOR, VHUB
from foosim.protocol.deployment import Deployment
from foosim.protocol.fingerprint import library_fingerprint
from foosim.supervisor.run_folder import runs_folder

State = Literal["fine", "warning", "problem"]

GIB: Final = 1 << 30
DISK_WARN_BYTES: Final = 4 * GIB
DISK_BYTES_MIN: Final = GIB // 4
HERE: Final = "here"
TIME_ERROR: Final = 5
"""What `adjtimex` returns of a clock that nothing keeps in time."""
PYTHON_TESTED: Final = (3, 11)


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that was looked at, on one host. `remedy` says what to do; it is empty when all is fine."""

    check: str
    subject: str
    state: State
    text: str
    remedy: str = ""
    host: str = HERE


@dataclass(frozen=True, slots=True)
class Case:
    """What is to be run: the deployment, where it would listen, and its certificates if any."""

    deployment: Deployment
    listen: str
    insecure: bool = False
    pki: Path | None = None
    captures: Path = Path("captures")


def examine(case: Case) -> list[Finding]:
    """Return the findings of all checks on this machine, in the order of the checks."""
    return [finding for name, check in CHECKS.items() for finding in _made(name, check(case))]


def is_well(findings: Iterable[Finding]) -> bool:
    """Whether nothing stands in the way; warnings do not."""
    return all(finding.state != "problem" for finding in findings)


_Said = tuple[str, State, str, str]
"""Subject, state, text, remedy."""


def _made(name: str, said: Iterable[_Said]) -> Iterator[Finding]:
    for subject, state, text, remedy in said:
        yield Finding(name, subject, state, text, remedy)


# --- versions --------------------------------------------------------------------------------------------------------


def _versions(case: Case) -> Iterator[_Said]:
    """foosim, Python and each library against what this foosim asks for."""
    yield "foosim", "fine", f"{importlib.metadata.version('foosim')}, protocol {limits.PROTOCOL_VERSION}", ""
    python = platform.python_version()
    if sys.version_info[:2] == PYTHON_TESTED:
        yield "python", "fine", python, ""
    else:
        tested = ".".join(map(str, PYTHON_TESTED))
        yield "python", "warning", f"{python}; foosim is tested with {tested}", f"install Python {tested}"
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
    """Nodes whose fingerprints differ are refused, unless the deployment says `mixed_cpu: true`."""
    yield "fingerprint", "fine", f"{library_fingerprint().hex()[:16]} on {platform.machine()}", ""


# --- certificates ----------------------------------------------------------------------------------------------------


def _certificates(case: Case) -> Iterator[_Said]:
    """Everybody's certificate or password: there, of this root, its own key, valid, for the right host."""
    folder = case.pki
    if folder is None:
        yield "folder", "fine", "none: only this machine can take part, or whoever reaches it with --insecure", ""
        return
    try:
        read_ca(folder, wall.now_utc())
    except CertificateError as error:
        yield "ca.pem", "problem", error.what, f"foosim-pki init {folder}"
        return
    yield "ca.pem", "fine", "", ""
    if (folder / CA_KEY_FILE).exists():
        yield (
            CA_KEY_FILE,
            "warning",
            "is beside the certificates",
            "keep it where certificates are issued",
        )
    for who in identity.identities_of(case.deployment):
        yield _certificate(folder, who, case)
    for path in sorted((*folder.glob(f"*{KEY_SUFFIX}"), *folder.glob(f"*{PASSWORD_SUFFIX}"))):
        if path.stat().st_mode & 0o077:
            yield path.name, "problem", "can be read by others", f"chmod 600 {path}"


def _certificate(folder: Path, who: str, case: Case) -> _Said:
    """Look at what one of the run shows; where clients have passwords, at a client's."""
    if who.startswith("client.") and case.deployment.access.radio == "password":
        path = folder / f"{who}{PASSWORD_SUFFIX}"
        try:
            read_password(path)
        except CertificateError as error:
            return who, "problem", error.what, f"foosim-pki issue {folder} {who} --password"
        if certificate_path(folder, who).exists():
            return who, "problem", "has a password and a certificate, which this run does not take", "remove its .pem"
        return who, "fine", "has a password", ""
    path = certificate_path(folder, who)
    if not path.exists():
        return who, "problem", "no certificate", f"foosim-pki issue {folder} {who}"
    try:
        now = wall.now_utc()
        found = read_certificate(path)
        check_certificate(path, found, who, read_ca(folder, now), now)
        check_key(key_path(folder, who), found)
        credentials = load_credentials(folder, who)
    except CertificateError as error:
        return who, "problem", error.what, f"foosim-pki renew {folder} {who}, or remove both files and issue anew"
    assert credentials is not None
    address = check_listen(case.listen, case.insecure, 2, secured=True)
    hosts = [host.lower() for host in hosts_of(found)]
    if who in (SUPERVISOR, VHUB) and not address.is_wildcard and address.host.strip("[]").lower() not in hosts:
        remedy = f"foosim-pki renew {folder} {who} --host {address.host}"
        return who, "problem", f"is for {', '.join(hosts)}, not for {address.host}", remedy
    soon = credentials.ends_soon(wall.now_utc())
    if soon:
        return who, "warning", soon, f"foosim-pki renew {folder} {who}"
    return who, "fine", f"until {found.not_valid_after_utc:%Y-%m-%d}", ""


# --- this machine ----------------------------------------------------------------------------------------------------


def _ports(case: Case) -> Iterator[_Said]:
    """Whether both planes can listen where they are asked to."""
    address = check_listen(case.listen, case.insecure, 2, case.pki is not None)
    for plane, its in (("simulation plane", address), ("radio plane", address.next_port())):
        yield _port(plane, its)


def _port(plane: str, address: Address) -> _Said:
    host = address.host.strip("[]")
    try:
        family, kind, number, _, place = socket.getaddrinfo(host, address.port, type=socket.SOCK_STREAM)[0]
        with socket.socket(family, kind, number) as tried:
            tried.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            tried.bind(place)
    except socket.gaierror as error:
        return plane, "problem", f"{address}: no such host, {error.strerror}", "give a name or address of this machine"
    except OSError as error:
        remedies = {
            errno.EADDRINUSE: "end what listens there, or take another port",
            errno.EADDRNOTAVAIL: "give an address of this machine, see `ip address`",
            errno.EACCES: "take a port above 1023",
        }
        return plane, "problem", f"{address}: {error.strerror}", remedies.get(error.errno or 0, "take another address")
    return plane, "fine", f"{address} is free" if address.port else f"{address}: the system chooses a free port", ""


def _clock(case: Case) -> Iterator[_Said]:
    """Clocks of machines need not agree, but certificates and file names go by them."""
    now = wall.now_utc()
    text = f"{now:%Y-%m-%d %H:%M:%S} UTC"
    if _clock_state() == TIME_ERROR:
        remedy = "start a time service (chrony, systemd-timesyncd); the dates of certificates go by this clock"
        yield "clock", "warning", f"{text}, and nothing keeps it in time", remedy
    else:
        yield "clock", "fine", text, ""


def _clock_state() -> int:
    """Ask the kernel how it keeps time; TIME_ERROR where it does not, 0 where it cannot be asked."""
    if sys.platform != "linux":
        return 0
    nothing_to_set = ctypes.create_string_buffer(512)
    return int(ctypes.CDLL(None).adjtimex(nothing_to_set))


def _disk(case: Case) -> Iterator[_Said]:
    """Room and the right to write where runs keep journals and captures go."""
    for subject, folder in (("runs", runs_folder()), ("captures", case.captures)):
        place = folder.absolute()
        while not place.exists():
            place = place.parent
        free = shutil.disk_usage(place).free
        text = f"{free / GIB:.1f} GiB free at {place}"
        if not os.access(place, os.W_OK | os.X_OK):
            yield subject, "problem", f"{place} cannot be written", "let this user write there, or start elsewhere"
        elif free < DISK_BYTES_MIN:
            yield subject, "problem", text, "make room: a run without room stops"
        elif free < DISK_WARN_BYTES:
            yield subject, "warning", text, "make room before a long run"
        else:
            yield subject, "fine", text, ""


def _commands(case: Case) -> Iterator[_Said]:
    """The processes that `up` starts."""
    for name in ("foosim-supervisor", "foosim-vhub", "foosim-node", "foosim-player"):
        beside = Path(sys.executable).with_name(name)
        found = str(beside) if beside.is_file() else shutil.which(name)
        if found is None:
            yield name, "problem", "not found beside this Python or on PATH", "install foosim in this environment"
        else:
            yield name, "fine", found, ""


CHECKS: Final[dict[str, Callable[[Case], Iterator[_Said]]]] = {
    "versions": _versions,
    "arithmetic": _arithmetic,
    "commands": _commands,
    "certificates": _certificates,
    "ports": _ports,
    "clock": _clock,
    "disk": _disk,
}
"""Every check by its name, in the order in which they are shown."""
