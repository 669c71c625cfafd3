"""Makes certificates: a root, and one for each process, client and operator under it; and which of them a host needs.

Elliptic curve P-256. The root lasts ten years and may issue no further authority; what it issues lasts 90 days, names
one identity, and serves both sides of a connection, since every process connects and two listen. Keys are never
overwritten, and can be read by their owner only.
"""

from __future__ import annotations

import os
import re
import socket
from collections.abc import Sequence
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
from foosim.deployment.processes import joint_processes
from foosim.deployment.schema import Deployment, places
from foosim.protocol import identity as names_of
from foosim.protocol.channels import SUPERVISOR, VHUB
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
from foosim.runtime.transport.certificates import certificate_path, identities_in, key_path, load_credentials

ROOT_NAME: Final = "foosim"
ROOT_DAYS: Final = 3650
LEAF_DAYS: Final = 90
RENEW_DAYS: Final = 30
LEAF_DAYS_MAX: Final = 825
"""More than this some libraries refuse."""
SLACK: Final = timedelta(hours=1)
"""Tolerance for slow clocks of other machines: a certificate is valid from this time before now on."""
LOCAL_HOSTS: Final = ("localhost", "127.0.0.1", "::1")
LISTENERS: Final = frozenset({SUPERVISOR, VHUB})
"""Identities whose certificates have host names: the others only connect."""
LABEL: Final = "[a-z0-9]([a-z0-9-]{0,61}[a-z0-9])?"
HOST_NAME: Final = re.compile(rf"(?=.{{1,253}}$){LABEL}(\.{LABEL})*", re.IGNORECASE | re.ASCII)


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


def provide(
    folder: Path,
    identities: Sequence[str],
    hosts: Sequence[str] = (),
    days: int = LEAF_DAYS,
    within_days: int = RENEW_DAYS,
) -> list[Path]:
    """Issue the missing files for these identities, and return their names: the root, certificates.

    `hosts`: names and addresses by which others reach supervisor and vHub. A certificate that ends within
    `within_days`, lacks such a host or has another root is issued anew. Raises CertificateError, BadValue.
    """
    made: list[Path] = [] if (folder / CA_FILE).exists() else [init(folder)]
    ca, there = read_ca(folder, wall_clock.now_utc()), identities_in(folder)
    for who in identities:
        reached = hosts if who in LISTENERS else ()
        if who not in there:
            made += issue(folder, [who], reached, days)
        elif _is_due(folder, who, ca, reached, within_days):
            made.append(renew(folder, who, reached))
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
    """Make the folder with a root, and return the root's path. Raises Refused."""
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    except OSError as error:
        raise CertificateError(f"{folder}: cannot be made, {error.strerror}") from None
    _refuse_existing(folder / CA_FILE, folder / CA_KEY_FILE)
    key = ec.generate_private_key(ec.SECP256R1())
    _write(folder / CA_KEY_FILE, _key_bytes(key))
    _write(folder / CA_FILE, _signed(ROOT_NAME, key.public_key(), ROOT_DAYS, (None, key)))
    return folder / CA_FILE


def issue(folder: Path, identities: Sequence[str], hosts: Sequence[str] = (), days: int = LEAF_DAYS) -> list[Path]:
    """Issue a certificate and key to each identity; all of them, or none. Raises BadValue, CertificateError.

    `hosts`: names and addresses by which others reach it, beside those of this machine.
    """
    own = socket.gethostname().lower()
    known = [*LOCAL_HOSTS, *([own] if HOST_NAME.fullmatch(own) else []), *hosts]
    names = [_alternative(host) for host in dict.fromkeys(known)]
    if not 1 <= days <= LEAF_DAYS_MAX:
        raise BadValue(f"days of a certificate are from 1 to {LEAF_DAYS_MAX}", days)
    for identity in identities:
        names_of.parse_identity(identity)
    _refuse_existing(*(path(folder, identity) for identity in identities for path in (certificate_path, key_path)))
    authority = _authority(folder)
    for identity in identities:
        key = ec.generate_private_key(ec.SECP256R1())
        _write(key_path(folder, identity), _key_bytes(key))
        leaf = _signed(identity, key.public_key(), days, authority, [x509.DNSName(identity), *names])
        _write(certificate_path(folder, identity), leaf)
    return [certificate_path(folder, identity) for identity in identities]


def renew(folder: Path, identity: str, hosts: Sequence[str] = ()) -> Path:
    """Issue a certificate anew, for the same key, names and length of time; `hosts` are added to the names.

    A process takes the new one when it is started again. Raises CertificateError, BadValue.
    """
    path = certificate_path(folder, identity)
    old = read_certificate(path)
    check_key(key_path(folder, identity), old)
    days = max(1, (old.not_valid_after_utc - old.not_valid_before_utc).days)
    key = old.public_key()
    assert isinstance(key, ec.EllipticCurvePublicKey), "issued here"
    alternatives = old.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    names = list(dict.fromkeys([*alternatives, *map(_alternative, hosts)]))
    fresh = path.with_name(f"{path.name}.new")
    fresh.unlink(missing_ok=True)
    _write(fresh, _signed(identity, key, days, _authority(folder), names))
    return fresh.replace(path)


def show_folder(folder: Path) -> list[Shown]:
    """Return the folder's contents: the root, then by identity. Raises CertificateError when there is no root."""
    read_certificate(folder / CA_FILE)
    return [_shown(folder, identity) for identity in ("", *identities_in(folder))]


def _shown(folder: Path, identity: str) -> Shown:
    """Return the shown properties of an identity's certificate, or of the root's without one."""
    now, problem = wall_clock.now_utc(), ""
    path = certificate_path(folder, identity) if identity else folder / CA_FILE
    try:
        if identity:
            load_credentials(folder, identity)
        else:
            read_ca(folder, now)
    except CertificateError as error:
        problem = error.what
    try:
        found = read_certificate(path)
    except CertificateError:
        return Shown(identity, str(path), now, now, (), "", problem)
    hosts = tuple(host for host in hosts_of(found) if host != identity)
    begins, ends = found.not_valid_before_utc, found.not_valid_after_utc
    return Shown(identity or common_name(found), str(path), begins, ends, hosts, fingerprint(found), problem)


def fingerprint(certificate: x509.Certificate) -> str:
    """Return the fingerprint of a certificate, in hex."""
    return certificate.fingerprint(hashes.SHA256()).hex()


def identities_on(deployment: Deployment, host: str | None) -> list[str]:
    """Return a run's identities on a host, in the order of `identities_of`; None: those on no host."""
    where = places(deployment)
    roles = (VHUB, *deployment.nodes, *deployment.players)
    known = {names_of.of_role(role, deployment): where.get(role) for role in roles}
    known |= {f"process.{name}": where.get(its.roles[0]) for name, its in joint_processes(deployment).items()}
    return [who for who in names_of.identities_of(deployment) if known.get(who) == host]


def files_for(deployment: Deployment, host: str, folder: Path) -> dict[str, bytes]:
    """Return the files of a folder that a host needs, by name: the root, and each key before its certificate.

    Raises CertificateError for one that would be refused.
    """
    contents = {CA_FILE: (folder / CA_FILE).read_bytes()}
    for who in identities_on(deployment, host):
        load_credentials(folder, who)
        for path in (key_path(folder, who), certificate_path(folder, who)):
            contents[path.name] = path.read_bytes()
    return contents


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


def _signed(
    name: str,
    key: ec.EllipticCurvePublicKey,
    days: int,
    authority: tuple[x509.Certificate | None, ec.EllipticCurvePrivateKey],
    hosts: Sequence[x509.GeneralName] = (),
) -> bytes:
    """Return a certificate in PEM, signed by a root and its key; without a root it is one itself."""
    root, root_key = authority
    is_ca = root is None
    subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])
    now = wall_clock.now_utc()
    begins = now - SLACK
    usage = x509.KeyUsage(
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
    builder = (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(subject if root is None else root.subject)
        .public_key(key)
        .serial_number(x509.random_serial_number())
        .not_valid_before(begins)
        .not_valid_after(begins + timedelta(days=days))
        .add_extension(x509.BasicConstraints(ca=is_ca, path_length=0 if is_ca else None), critical=True)
        .add_extension(usage, critical=True)
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(key), critical=False)
    )
    if not is_ca:
        issuer = x509.AuthorityKeyIdentifier.from_issuer_public_key(root_key.public_key())
        sides = x509.ExtendedKeyUsage([ExtendedKeyUsageOID.SERVER_AUTH, ExtendedKeyUsageOID.CLIENT_AUTH])
        for extension in (x509.SubjectAlternativeName(hosts), sides, issuer):
            builder = builder.add_extension(extension, critical=False)
    return builder.sign(root_key, hashes.SHA256()).public_bytes(serialization.Encoding.PEM)


def _alternative(host: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ip_address(host))
    except ValueError:
        pass
    if not HOST_NAME.fullmatch(host):
        raise BadValue("not a host name or an IP address", host)
    return x509.DNSName(host)


def _refuse_existing(*paths: Path) -> None:
    existing = [str(path) for path in paths if path.exists()]
    if existing:
        raise Refused(f"exists already, and is not overwritten: {', '.join(existing)}")


def _write(path: Path, content: bytes) -> None:
    """Write a new file that only its owner reads. Raises CertificateError."""
    try:
        file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC, 0o600)
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
