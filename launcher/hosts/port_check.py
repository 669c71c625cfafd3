"""Tests whether a machine can reach a port of another one, with a listener and a connection that send nothing.

Only a connection to a listener shows whether a firewall closes a port.
"""

from __future__ import annotations

import errno
import socket
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Final

from foosim.common.addresses import Address
from foosim.common.errors import Failed

REACH_S: Final = 3.0
BACKLOG: Final = 64
REMEDIES: Final = {
    errno.EADDRINUSE: "end what listens there, or take another port",
    errno.EADDRNOTAVAIL: "give an address of this machine, see `ip address`",
    errno.EACCES: "take a port above 1023",
}


def listen(address: Address) -> socket.socket:
    """Return a socket that listens at an address. Raises OSError."""
    family, kind, number, _, place = socket.getaddrinfo(
        address.host.strip("[]"), address.port, type=socket.SOCK_STREAM
    )[0]
    listener = socket.socket(family, kind, number)
    try:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind(place)
        listener.listen(BACKLOG)  # the system accepts connections; no process does
    except OSError:
        listener.close()
        raise
    return listener


def check_free(addresses: Iterable[Address]) -> None:
    """Raise Failed for the first address that cannot be listened on, with the remedy."""
    for address in addresses:
        try:
            listen(address).close()
        except OSError as error:
            remedy = REMEDIES.get(error.errno or 0, "take another address")
            what = f"cannot listen on {address}: {error.strerror}"
            raise Failed(f"{what}; {remedy} (--listen HOST:PORT, or `listen:` in the deployment)") from None


@contextmanager
def listening(address: Address) -> Iterator[None]:
    """Ensure that an address has a listener: our own if there is none and the address is free."""
    try:
        listener = listen(address)
    except OSError:
        yield
        return
    with listener:
        yield


def why_not_reached(address: Address, timeout_s: float = REACH_S) -> str:
    """Return why nothing can be connected to at an address, an empty text when it can."""
    try:
        with socket.create_connection((address.host.strip("[]"), address.port), timeout_s):
            return ""
    except TimeoutError:
        return f"no answer within {timeout_s:g} s"
    except OSError as error:
        return error.strerror or str(error)
