"""Makes certificates: a root, and one for each process, client and operator under it.

Elliptic curve P-256. The root lasts ten years and may issue no further authority; what it issues lasts 90 days, names
one identity, and serves both sides of a connection, since every process connects and two listen. Keys are never
overwritten, and can be read by their owner only.
"""

from __future__ import annotations

import os
import socket
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from ipaddress import ip_address
from pathlib import Path
from typing import Final

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from foosim.common import wall_clock
from foosim.common.errors import BadValue, Refused
from foosim.protocol.channels import SUPERVISOR, VHUB
from foosim.protocol.identity import parse_identity
from foosim.runtime.transport.certificate_files import (
    check_certificate,
    check_key,
    common_name,
    hosts_of,
    read_ca,
    read_certificate,
    read_key,
)
from foosim.runtime.transport.certificate_folder import CA_FILE, CA_KEY_FILE, CertificateError
from foosim.runtime.transport.certificates import certificate_path, identities_in, key_path

ROOT_NAME: Final = "foosim"
ROOT_DAYS: Final = 3650
LEAF_DAYS: Final = 90
RENEW_DAYS: Final = 30
LEAF_DAYS_MAX: Final = 825
"""More than this some libraries refuse."""
SLACK: Final = timedelta(hours=1)
"""How far clocks of machines may be behind: from so long before now a certificate is valid."""
LOCAL_HOSTS: Final = ("localhost", "127.0.0.1", "::1")
LISTENERS: Final = frozenset({SUPERVISOR, VHUB})
"""Identities whose certificates have host names: the others only connect."""
HOST_LENGTH_MAX: Final = 253


class FileExists(Refused):
    """A certificate or key that is there already and is not overwritten."""


@dataclass(frozen=True, slots=True)
class Shown:
    """One certificate, for people and scripts. `problem` is empty when its holder would be let in."""

    identity: str
    path: str
    begins: datetime
    ends: datetime
    hosts: tuple[str, ...]
    fingerprint: str
    problem: str

    def days_left(self, now: datetime) -> float:
        return (self.ends - now) / timedelta(days=1)


def provide(
    folder: Path,
    identities: Sequence[str],
    hosts: Sequence[str] = (),
    days: int = LEAF_DAYS,
    within_days: int = RENEW_DAYS,
) -> list[Path]:
    """Issue the missing files for these identities, and return their names: the root, certificates.

    `hosts`: names and addresses by which others reach supervisor and vHub. A certificate that ends within so many days,
    lacks such a host or has another root is issued anew. Raises CertificateError, BadValue.
    """
    made: list[Path] = [] if (folder / CA_FILE).exists() else [init(folder)]
    ca, there = read_ca(folder, wall_clock.now_utc()), identities_in(folder)
    for reached, who_has in ((hosts, LISTENERS), ((), set(identities) - LISTENERS)):
        wanted = [who for who in identities if who in who_has]
        made += issue(folder, [who for who in wanted if who not in there], reached, days)
        due = [who for who in wanted if who in there and _is_due(folder, who, ca, reached, within_days)]
        made += renew(folder, due, reached)
    return made


def _is_due(folder: Path, identity: str, ca: x509.Certificate, hosts: Sequence[str], within_days: int) -> bool:
    """Whether a certificate is due for renewal. Raises CertificateError for one of another identity."""
    path, now = certificate_path(folder, identity), wall_clock.now_utc()
    found = read_certificate(path)
    try:
        check_certificate(path, found, identity, ca, now)
    except CertificateError:
        if common_name(found) != identity:
            raise
        return True
    has_hosts = {host.lower() for host in hosts} <= {host.lower() for host in hosts_of(found)}
    return not has_hosts or found.not_valid_after_utc - now <= timedelta(days=within_days)


def init(folder: Path) -> Path:
    """Make the folder with a root, and return the root's path. Raises FileExists."""
    _make_folder(folder)
    _refuse_existing(folder / CA_FILE, folder / CA_KEY_FILE)
    key = ec.generate_private_key(ec.SECP256R1())
    subject = _subject(ROOT_NAME)
    root = (
        _builder(subject, subject, key.public_key(), ROOT_DAYS)
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .add_extension(_usage(is_ca=True), critical=True)
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(key.public_key()), critical=False)
        .sign(key, hashes.SHA256())
    )
    _write(folder / CA_KEY_FILE, _key_bytes(key))
    _write(folder / CA_FILE, root.public_bytes(serialization.Encoding.PEM))
    return folder / CA_FILE


def issue(folder: Path, identities: Sequence[str], hosts: Sequence[str] = (), days: int = LEAF_DAYS) -> list[Path]:
    """Issue a certificate and key to each identity; all of them, or none. Raises BadValue, CertificateError.

    `hosts`: names and addresses by which others reach it, beside those of this machine.
    """
    names = _alternatives(hosts)
    days = _checked_days(days)
    for identity in identities:
        parse_identity(identity)
    _refuse_existing(*(path(folder, identity) for identity in identities for path in (certificate_path, key_path)))
    if not identities:
        return []
    root, root_key = _authority(folder)
    made = []
    for identity in identities:
        key = ec.generate_private_key(ec.SECP256R1())
        own = [x509.DNSName(identity), *names]
        _write(key_path(folder, identity), _key_bytes(key))
        certificate = _leaf(identity, key.public_key(), own, days, root, root_key)
        _write(certificate_path(folder, identity), certificate.public_bytes(serialization.Encoding.PEM))
        made.append(certificate_path(folder, identity))
    return made


def renew(folder: Path, identities: Sequence[str], hosts: Sequence[str] = ()) -> list[Path]:
    """Issue certificates anew, for the same keys, names and lengths of time; `hosts` are added to the names.

    A process takes the new one when it is started again. Raises CertificateError, BadValue.
    """
    further = [_alternative(host) for host in hosts]
    if not identities:
        return []
    root, root_key = _authority(folder)
    made = []
    for identity in identities:
        path = certificate_path(folder, identity)
        old = read_certificate(path)
        check_key(key_path(folder, identity), old)
        days = max(1, (old.not_valid_after_utc - old.not_valid_before_utc).days)
        alternatives = old.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
        key = old.public_key()
        assert isinstance(key, ec.EllipticCurvePublicKey), "issued here"
        names = list(dict.fromkeys([*alternatives, *further]))
        certificate = _leaf(identity, key, names, days, root, root_key)
        fresh = path.with_name(f"{path.name}.new")
        fresh.unlink(missing_ok=True)
        _write(fresh, certificate.public_bytes(serialization.Encoding.PEM))
        fresh.replace(path)
        made.append(path)
    return made


def show_folder(folder: Path) -> list[Shown]:
    """Return the folder's contents: the root, then by identity. Raises CertificateError when there is no root."""
    now = wall_clock.now_utc()
    ca = read_certificate(folder / CA_FILE)
    shown = [_shown("", folder / CA_FILE, ca, _problem(lambda: read_ca(folder, now)))]
    for identity in identities_in(folder):
        path = certificate_path(folder, identity)
        try:
            found = read_certificate(path)
        except CertificateError as error:
            shown.append(Shown(identity, str(path), now, now, (), "", error.what))
            continue

        def check(identity: str = identity, path: Path = path, found: x509.Certificate = found) -> None:
            check_certificate(path, found, identity, ca, now)
            check_key(key_path(folder, identity), found)

        shown.append(_shown(identity, path, found, _problem(check)))
    return shown


# --- inside ----------------------------------------------------------------------------------------------------------


def _authority(folder: Path) -> tuple[x509.Certificate, ec.EllipticCurvePrivateKey]:
    """Return the root and its key. Raises CertificateError."""
    root = read_ca(folder, wall_clock.now_utc())
    path = folder / CA_KEY_FILE
    if not path.exists():
        raise CertificateError(f"{folder} has no {CA_KEY_FILE}: certificates are issued where the root's key is kept")
    check_key(path, root)
    key = read_key(path)
    if not isinstance(key, ec.EllipticCurvePrivateKey):
        raise CertificateError(f"{path}: not a key of an elliptic curve")
    return root, key


def _leaf(
    identity: str,
    key: ec.EllipticCurvePublicKey,
    names: Sequence[x509.GeneralName],
    days: int,
    root: x509.Certificate,
    root_key: ec.EllipticCurvePrivateKey,
) -> x509.Certificate:
    sides = [ExtendedKeyUsageOID.SERVER_AUTH, ExtendedKeyUsageOID.CLIENT_AUTH]
    return (
        _builder(_subject(identity), root.subject, key, days)
        .add_extension(x509.SubjectAlternativeName(names), critical=False)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(_usage(is_ca=False), critical=True)
        .add_extension(x509.ExtendedKeyUsage(sides), critical=False)
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(key), critical=False)
        .add_extension(x509.AuthorityKeyIdentifier.from_issuer_public_key(root_key.public_key()), critical=False)
        .sign(root_key, hashes.SHA256())
    )


def _builder(
    subject: x509.Name, issuer: x509.Name, key: ec.EllipticCurvePublicKey, days: int
) -> x509.CertificateBuilder:
    now = wall_clock.now_utc()
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .public_key(key)
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - SLACK)
        .not_valid_after(now - SLACK + timedelta(days=days))
    )


def _subject(name: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])


def _usage(is_ca: bool) -> x509.KeyUsage:
    return x509.KeyUsage(
        digital_signature=not is_ca,
        content_commitment=False,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=False,
        key_cert_sign=is_ca,
        crl_sign=is_ca,
        encipher_only=False,
        decipher_only=False,
    )


def _alternatives(hosts: Sequence[str]) -> list[x509.GeneralName]:
    """Return the hosts as in a certificate, those of this machine first. Raises BadValue."""
    return [_alternative(host) for host in dict.fromkeys([*LOCAL_HOSTS, *_own_names(), *hosts])]


def _alternative(host: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ip_address(host))
    except ValueError:
        pass
    labels = host.split(".")
    if not host.isascii() or len(host) > HOST_LENGTH_MAX or not all(_is_label(label) for label in labels):
        raise BadValue("not a host name or an IP address", host)
    return x509.DNSName(host)


def _is_label(label: str) -> bool:
    return 0 < len(label) <= 63 and label.replace("-", "a").isalnum() and label[0] != "-" and label[-1] != "-"


def _own_names() -> list[str]:
    """Return this machine's name where others could use it."""
    name = socket.gethostname().lower()
    return [name] if name.isascii() and all(map(_is_label, name.split("."))) else []


def _checked_days(days: int) -> int:
    if not 1 <= days <= LEAF_DAYS_MAX:
        raise BadValue(f"days of a certificate are from 1 to {LEAF_DAYS_MAX}", days)
    return days


def _make_folder(folder: Path) -> None:
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    except OSError as error:
        raise CertificateError(f"{folder}: cannot be made, {error.strerror}") from None


def _refuse_existing(*paths: Path) -> None:
    existing = [str(path) for path in paths if path.exists()]
    if existing:
        raise FileExists(f"exists already, and is not overwritten: {', '.join(existing)}")


def _write(path: Path, content: bytes) -> None:
    """Write a new file that only its owner reads. Raises FileExists, CertificateError."""
    try:
        file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC, 0o600)
    except FileExistsError:
        raise FileExists(f"exists already, and is not overwritten: {path}") from None
    except OSError as error:
        raise CertificateError(f"{path}: cannot be made, {error.strerror}") from None
    with os.fdopen(file, "wb") as stream:
        stream.write(content)
        stream.flush()
        os.fsync(stream.fileno())


def _key_bytes(key: ec.EllipticCurvePrivateKey) -> bytes:
    return key.private_bytes(
        serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
    )


def _problem(check: Callable[[], object]) -> str:
    try:
        check()
    except CertificateError as error:
        return error.what
    return ""


def _shown(identity: str, path: Path, found: x509.Certificate, problem: str) -> Shown:
    fingerprint = found.fingerprint(hashes.SHA256()).hex()
    begins, ends = found.not_valid_before_utc, found.not_valid_after_utc
    hosts = tuple(host for host in hosts_of(found) if host != identity)
    return Shown(identity or common_name(found), str(path), begins, ends, hosts, fingerprint, problem)
