"""The folder of certificates, and how a process proves from it who it is.

    ca.pem                   the root that everybody trusts
    IDENTITY.pem .key        a certificate and its key; the certificate's common name is the identity
    client.NAME.password     instead of these, where clients of the radio plane have passwords

A refused connection looks like a router that is not there, to both sides. So everything that can be checked here is
checked before anything is opened. Neighbours: `identity`, `tls_probe` (what only the other side can say),
`supervisor.pki` makes what is in the folder.
"""

from __future__ import annotations

import logging
import os
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from pathlib import Path
from typing import Final

from cryptography import x509
from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives import serialization
from cryptography.x509.oid import NameOID

from foosim.protocol import wall
from foosim.protocol.addresses import parse_address
from foosim.protocol.errors import Refused, show
from foosim.protocol.identity import operator, parse_identity

CA_FILE: Final = "ca.pem"
CA_KEY_FILE: Final = "ca.key"
CERTIFICATE_SUFFIX: Final = ".pem"
KEY_SUFFIX: Final = ".key"
PASSWORD_SUFFIX: Final = ".password"
FILE_BYTES_MAX: Final = 65_536
OPERATOR_VARIABLE: Final = "FOOSIM_OPERATOR"
"""Names the operator whose certificate control commands show, where there are several."""
SOON: Final = timedelta(days=14)
"""A certificate that ends within this is to be renewed."""


class CertificateError(Refused):
    """A certificate, key or password that is not there, or with which nobody would be let in; the text says why."""


@dataclass(frozen=True, slots=True)
class Credentials:
    """What a process shows and whom it trusts. Either it has a certificate with its key, or a user and a password."""

    identity: str
    ca: Path
    certificate: Path | None = None
    key: Path | None = None
    user: str = ""
    password: str = field(default="", repr=False)
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


def load_credentials(folder: Path | None, identity: str, password: str = "") -> Credentials | None:
    """Return what the folder has for an identity, checked; None without a folder. Raises CertificateError.

    `password`: use this one, and of the folder only the root.
    """
    if folder is None:
        if password:
            raise CertificateError("a password needs the root certificate, too: it is sent to the right vHub only")
        return None
    now = wall.now_utc()
    ca = read_ca(folder, now)
    certificate, key = certificate_path(folder, identity), key_path(folder, identity)
    role, name = parse_identity(identity)
    own_password = folder / f"{identity}{PASSWORD_SUFFIX}"
    if role == "client" and not password and own_password.exists():
        if certificate.exists():
            raise CertificateError(f"{folder} has a certificate and a password of {identity}: remove what is not used")
        password = read_password(own_password)
    if password:
        return Credentials(identity, folder / CA_FILE, user=name, password=password)
    if not certificate.exists():
        known = ", ".join(identities_in(folder)) or "none"
        raise CertificateError(f"{folder} has no certificate of {identity}; it has: {known}")
    found = read_certificate(certificate)
    check_certificate(certificate, found, identity, ca, now)
    check_key(key, found)
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
    if folder is None:
        return None
    name = os.environ.get(OPERATOR_VARIABLE)
    if name is not None:
        return load_credentials(folder, operator(name))
    known = [who for who in identities_in(folder) if who.startswith("operator.")]
    if len(known) != 1:
        there = f"several operators ({', '.join(known)})" if known else "no operator's certificate"
        raise CertificateError(f"{folder} has {there}: {OPERATOR_VARIABLE}=NAME in the environment says which it is")
    return load_credentials(folder, known[0])


def warn_of_end(credentials: Credentials | None, log: logging.Logger) -> None:
    """Log a warning when a certificate ends soon."""
    warning = "" if credentials is None else credentials.ends_soon(wall.now_utc())
    if warning:
        log.warning(warning)


@contextmanager
def passwords_file(folder: Path, clients: Sequence[str]) -> Iterator[Path]:
    """Give a file with the users and passwords of these clients, as a router reads it; a client without one is left
    out. It is gone afterwards. Raises CertificateError.
    """
    paths = {name: folder / f"client.{name}{PASSWORD_SUFFIX}" for name in clients}
    lines = [f"{name}:{read_password(path)}\n" for name, path in paths.items() if path.exists()]
    with tempfile.NamedTemporaryFile("w", encoding="ascii") as file:  # only its owner can read it
        file.writelines(lines)
        file.flush()
        yield Path(file.name)


def read_password(path: Path) -> str:
    """Return the one line of a password file. Raises CertificateError."""
    try:
        password = _read(path).decode("ascii").strip()
    except UnicodeDecodeError:
        raise CertificateError(f"{path}: not a line of ASCII") from None
    check_password(str(path), password)
    return password


def check_password(where: str, password: str) -> None:
    """Raise CertificateError for a password that cannot be one."""
    if not password or not password.isascii() or not password.isprintable() or set(" :") & set(password):
        raise CertificateError(f"{where}: a password is printable ASCII without blanks and colons, and not empty")


def read_ca(folder: Path, now: datetime) -> x509.Certificate:
    """Return the root, checked. Raises CertificateError."""
    path = folder / CA_FILE
    if not path.exists():
        raise CertificateError(f"{folder} has no {CA_FILE}; foosim-pki init {folder} makes one")
    ca = read_certificate(path)
    try:
        is_ca = ca.extensions.get_extension_for_class(x509.BasicConstraints).value.ca
    except x509.ExtensionNotFound:
        is_ca = False
    if not is_ca:
        raise CertificateError(f"{path}: not the certificate of an authority")
    _check_dates(path, ca, now, "make a new root, and new certificates under it")
    return ca


def read_certificate(path: Path) -> x509.Certificate:
    """Return the first certificate in a file. Raises CertificateError."""
    try:
        return x509.load_pem_x509_certificate(_read(path))
    except ValueError as error:
        raise CertificateError(f"{path}: not a certificate in PEM, {show(str(error), 120)}") from None


def read_key(path: Path) -> serialization.PrivateFormat | object:
    """Return the private key in a file. Raises CertificateError."""
    try:
        return serialization.load_pem_private_key(_read(path), None)
    except (ValueError, TypeError) as error:
        raise CertificateError(
            f"{path}: not a private key in PEM, without a password: {show(str(error), 80)}"
        ) from None


def check_certificate(path: Path, found: x509.Certificate, identity: str, ca: x509.Certificate, now: datetime) -> None:
    """Raise CertificateError unless this certificate is of this identity, from this root, and valid now."""
    named = common_name(found)
    if named != identity:
        raise CertificateError(f"{path}: a certificate of {show(named)}, not of {identity}")
    try:
        found.verify_directly_issued_by(ca)
    except (ValueError, TypeError, InvalidSignature):
        raise CertificateError(f"{path}: not issued by the root in {CA_FILE} beside it") from None
    _check_dates(path, found, now, f"foosim-pki renew {path.parent} {identity}")


def check_key(path: Path, found: x509.Certificate) -> None:
    """Raise CertificateError unless the key is that of the certificate."""
    key = read_key(path)
    public = getattr(key, "public_key", None)
    if public is None or public() != found.public_key():
        raise CertificateError(f"{path}: the key does not belong to the certificate {path.stem}{CERTIFICATE_SUFFIX}")


def common_name(found: x509.Certificate) -> str:
    """Return whom a certificate names; empty when nobody, or more than one."""
    names = found.subject.get_attributes_for_oid(NameOID.COMMON_NAME)
    return str(names[0].value) if len(names) == 1 else ""


def hosts_of(found: x509.Certificate) -> list[str]:
    """Return the host names and addresses under which its holder may listen."""
    try:
        alternatives = found.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    except x509.ExtensionNotFound:
        return []
    names = alternatives.get_values_for_type(x509.DNSName)
    return [*names, *map(str, alternatives.get_values_for_type(x509.IPAddress))]


def check_host(credentials: Credentials | None, locator: str) -> None:
    """Raise CertificateError when those who connect to where we listen would not find its host in our certificate."""
    if credentials is None or credentials.certificate is None:
        return
    host = parse_address(locator).host.strip("[]").lower()
    known = [name.lower() for name in hosts_of(read_certificate(credentials.certificate))]
    if host not in known:
        who = credentials.identity
        shown = ", ".join(name for name in known if name != who)
        raise CertificateError(
            f"{credentials.certificate} is for {shown}, not for {host}, where {who} listens: "
            f"foosim-pki renew {credentials.certificate.parent} {who} --host {host}"
        )


def _check_dates(path: Path, found: x509.Certificate, now: datetime, remedy: str) -> None:
    if now > found.not_valid_after_utc:
        raise CertificateError(f"{path}: expired on {found.not_valid_after_utc:%Y-%m-%d %H:%M} UTC; {remedy}")
    if now < found.not_valid_before_utc:
        begin = f"{found.not_valid_before_utc:%Y-%m-%d %H:%M}"
        raise CertificateError(f"{path}: valid from {begin} UTC, and it is {now:%Y-%m-%d %H:%M} here: mind the clock")


def _read(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(FILE_BYTES_MAX)
    except OSError as error:
        raise CertificateError(f"{path}: cannot be read, {error.strerror}") from None
