"""The names of the files in a folder of certificates, and how they are read."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from foosim.common.errors import Refused

CA_FILE: Final = "ca.pem"
CA_KEY_FILE: Final = "ca.key"
CERTIFICATE_SUFFIX: Final = ".pem"
KEY_SUFFIX: Final = ".key"
FILE_BYTES_MAX: Final = 65_536


class CertificateError(Refused):
    """A certificate or key is missing or would be rejected; the text has the reason."""


def read_bounded(path: Path) -> bytes:
    """Return the content of a file of the folder, of a huge one the beginning. Raises CertificateError."""
    try:
        with path.open("rb") as file:
            return file.read(FILE_BYTES_MAX)
    except OSError as error:
        raise CertificateError(f"{path}: cannot be read, {error.strerror}") from None
