"""The folder of certificates, by which a process proves its identity.

    ca.pem                   the root that all processes trust
    IDENTITY.pem .key        a certificate and its key; the certificate's common name is the identity

A refused connection looks like a missing router, to both sides. So everything that can be checked here is
checked before anything is opened. A process of a run without certificates, which most are, does not load what reads
them.
"""

from __future__ import annotations

import logging
import os
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path
from typing import Final

from foosim.common import wall_clock
from foosim.common.addresses import parse_address
from foosim.common.errors import Refused
from foosim.protocol.identity import parse_identity
from foosim.runtime.transport.certificate_folder import (
    CA_FILE,
    CERTIFICATE_SUFFIX,
    KEY_SUFFIX,
    CertificateError,
)

OPERATOR_VARIABLE: Final = "FOOSIM_OPERATOR"
"""Names the operator whose certificate control commands show, where there are several."""
VIEWER_VARIABLE: Final = "FOOSIM_VIEWER"
"""The same of the viewer whose certificate a reading client uses."""
SOON: Final = timedelta(days=14)
"""A certificate that ends within this is to be renewed."""


class NotAuthorised(Refused):
    """The router rejects this process, or the other way round; the text has the reason where it is known."""


@dataclass(frozen=True, slots=True)
class Credentials:
    """The certificate of a process, and the roots that it trusts."""

    identity: str
    ca: Path
    certificate: Path
    key: Path
    until: datetime | None = None
    """When the certificate ends."""

    @property
    def name(self) -> str:
        return parse_identity(self.identity)[1]

    def ends_soon(self, now: datetime) -> str:
        """Return a warning when the certificate ends soon; connections end with it."""
        if self.until is None or self.until - now > SOON:
            return ""
        return f"{self.certificate} ends on {self.until:%Y-%m-%d %H:%M} UTC, and its connections with it: renew it"


def load_credentials(folder: Path | None, identity: str) -> Credentials | None:
    """Return the checked credentials of an identity in the folder; None without a folder. Raises CertificateError."""
    if folder is None:
        return None
    from foosim.runtime.transport import certificate_files as files

    now = wall_clock.now_utc()
    ca = files.read_ca(folder, now)
    certificate, key = certificate_path(folder, identity), key_path(folder, identity)
    if not certificate.exists():
        known = ", ".join(identities_in(folder)) or "none"
        raise CertificateError(f"{folder} has no certificate of {identity}; it has: {known}")
    found = files.read_certificate(certificate)
    files.check_certificate(certificate, found, identity, ca, now)
    files.check_key(key, found)
    return Credentials(identity, folder / CA_FILE, certificate, key, until=found.not_valid_after_utc)


def certificate_path(folder: Path, identity: str) -> Path:
    """Return where the certificate of an identity is."""
    return folder / f"{identity}{CERTIFICATE_SUFFIX}"


def key_path(folder: Path, identity: str) -> Path:
    """Return where its key is."""
    return folder / f"{identity}{KEY_SUFFIX}"


def identities_in(folder: Path) -> list[str]:
    """Return the identities that the folder has certificates of, in name order."""
    stems = [path.name.removesuffix(CERTIFICATE_SUFFIX) for path in folder.glob(f"*{CERTIFICATE_SUFFIX}")]
    return sorted(stem for stem in stems if stem != CA_FILE.removesuffix(CERTIFICATE_SUFFIX))


def operator_credentials(folder: Path | None) -> Credentials | None:
    """Return those of the operator that FOOSIM_OPERATOR names, or of the only one there; as `load_credentials`."""
    return None if folder is None else _credentials_of_one(folder, "operator", OPERATOR_VARIABLE)


def viewer_credentials(folder: Path | None) -> Credentials | None:
    """Return those of the viewer that FOOSIM_VIEWER names, or of the only one there; as `load_credentials`.

    Without a viewer, those of an operator, which may read as well.
    """
    if folder is None:
        return None
    has_viewer = VIEWER_VARIABLE in os.environ or any(who.startswith("viewer.") for who in identities_in(folder))
    return _credentials_of_one(folder, "viewer", VIEWER_VARIABLE) if has_viewer else operator_credentials(folder)


def _credentials_of_one(folder: Path, role: str, variable: str) -> Credentials | None:
    """Return the credentials in a role that a variable of the environment names, or the only ones."""
    name = os.environ.get(variable)
    if name is not None:
        return load_credentials(folder, f"{role}.{name}")
    known = [who for who in identities_in(folder) if who.startswith(f"{role}.")]
    if len(known) != 1:
        there = f"several {role}s ({', '.join(known)})" if known else f"no {role}'s certificate"
        raise CertificateError(f"{folder} has {there}: set {variable}=NAME in the environment")
    return load_credentials(folder, known[0])


def warn_of_end(credentials: Credentials | None, log: logging.Logger) -> None:
    """Log a warning when a certificate ends soon."""
    warning = "" if credentials is None else credentials.ends_soon(wall_clock.now_utc())
    if warning:
        log.warning(warning)


def check_host(credentials: Credentials | None, locator: str) -> None:
    """Raise CertificateError when our certificate lacks the host of the address where we listen."""
    if credentials is None:
        return
    from foosim.runtime.transport.certificate_files import hosts_of, read_certificate

    host = parse_address(locator).host.strip("[]").lower()
    known = [name.lower() for name in hosts_of(read_certificate(credentials.certificate))]
    if host not in known:
        who = credentials.identity
        shown = ", ".join(name for name in known if name != who)
        raise CertificateError(
            f"{credentials.certificate} is for {shown}, not for {host}, where {who} listens: "
            f"foosim pki init {credentials.certificate.parent} FILE --host {host}"
        )
