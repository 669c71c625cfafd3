"""The reason of a refusal by a router: a TLS handshake of our own, since Zenoh reports every refusal as a timeout.

Only certain reasons are reported early: an untrusted certificate, or an alert of the other side. A router that
does not answer may still start.
"""

from __future__ import annotations

import socket
import ssl
from typing import Final

from foosim.common.addresses import Address
from foosim.runtime.transport.certificates import Credentials, NotAuthorised

PROBE_S: Final = 1.0
ALERT_S: Final = 0.5
"""Timeout for an alert about our certificate, which TLS 1.3 sends after the handshake."""


def probe(address: Address, credentials: Credentials | None, is_last: bool) -> None:
    """Raise NotAuthorised for a certain refusal; with `is_last` also for a likely one."""
    try:
        with socket.create_connection((address.host.strip("[]"), address.port), PROBE_S) as link:
            _shake(link, address, credentials)
    except OSError:
        return  # no router, or not yet; ssl's errors are among these
    else:
        if credentials is not None and is_last:
            raise NotAuthorised(
                f"{credentials.identity}: not authorised, or not reachable: {address} uses TLS, and refuses this "
                "certificate"
            )


def _shake(link: socket.socket, address: Address, credentials: Credentials | None) -> None:
    """Perform the handshake; raises NotAuthorised, or OSError when it fails otherwise."""
    if credentials is None:
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
        context.check_hostname = False
        context.verify_mode = ssl.CERT_NONE
        with context.wrap_socket(link):
            raise NotAuthorised(f"{address} requires a certificate: --pki DIR has its folder")
    context = ssl.create_default_context(ssl.Purpose.SERVER_AUTH, cafile=str(credentials.ca))
    context.load_cert_chain(credentials.certificate, credentials.key)
    try:
        with context.wrap_socket(link, server_hostname=address.host.strip("[]")) as secured:
            secured.settimeout(ALERT_S)
            try:
                secured.recv(1)
            except TimeoutError:
                return  # it waits for a message of Zenoh: TLS has admitted us
    except ssl.SSLCertVerificationError as error:
        raise NotAuthorised(f"{address}: its certificate is not accepted here: {error.verify_message}") from None
    except ssl.SSLError as error:
        if "ALERT" in (error.reason or ""):
            raise NotAuthorised(
                f"{address}: not authorised: it does not accept {credentials.certificate} ({_alert(error)})"
            ) from None
        raise


def _alert(error: ssl.SSLError) -> str:
    """Return the alert of the other side, in words."""
    return (error.reason or "").lower().rpartition("alert_")[2].replace("_", " ")
