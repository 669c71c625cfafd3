"""The contents of files of certificates and keys: read, and checked against each other."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path

from cryptography import x509
from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives import serialization
from cryptography.x509.oid import NameOID

from foosim.common.errors import show
from foosim.runtime.transport.certificate_folder import CA_FILE, CERTIFICATE_SUFFIX, CertificateError, read_bounded


def read_ca(folder: Path, now: datetime) -> x509.Certificate:
    """Return the root, checked. Raises CertificateError."""
    path = folder / CA_FILE
    if not path.exists():
        raise CertificateError(f"{folder} has no {CA_FILE}; foosim pki init {folder} FILE makes one")
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
        return x509.load_pem_x509_certificate(read_bounded(path))
    except ValueError as error:
        raise CertificateError(f"{path}: not a certificate in PEM, {show(str(error), 120)}") from None


def read_key(path: Path) -> serialization.PrivateFormat | object:
    """Return the private key in a file. Raises CertificateError."""
    try:
        return serialization.load_pem_private_key(read_bounded(path), None)
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
    _check_dates(path, found, now, f"foosim pki init {path.parent} FILE")


def check_key(path: Path, found: x509.Certificate) -> None:
    """Raise CertificateError unless the key is that of the certificate."""
    key = read_key(path)
    public = getattr(key, "public_key", None)
    if public is None or public() != found.public_key():
        raise CertificateError(f"{path}: the key does not belong to the certificate {path.stem}{CERTIFICATE_SUFFIX}")


def common_name(found: x509.Certificate) -> str:
    """Return the identity in a certificate; empty without one, and with more than one."""
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


def _check_dates(path: Path, found: x509.Certificate, now: datetime, remedy: str) -> None:
    if now > found.not_valid_after_utc:
        raise CertificateError(f"{path}: expired on {found.not_valid_after_utc:%Y-%m-%d %H:%M} UTC; {remedy}")
    if now < found.not_valid_before_utc:
        begin = f"{found.not_valid_before_utc:%Y-%m-%d %H:%M}"
        raise CertificateError(f"{path}: valid from {begin} UTC, and it is {now:%Y-%m-%d %H:%M} here: mind the clock")
