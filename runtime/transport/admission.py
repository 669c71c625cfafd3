"""The admission to a plane: access control denies silently, so an admitted process is one that sees its router's
presence.

A connection with certificates that receives no presence of its router within `ADMISSION_NS` has an identity that the
deployment does not declare.
"""

from __future__ import annotations

from typing import Final

from foosim.common.addresses import Address
from foosim.runtime.transport.certificates import Credentials, NotAuthorised

ADMISSION_NS: Final = 10_000_000_000
REMINDER_NS: Final = 60_000_000_000


class Admission:
    """The wait of one connection for its admission; without certificates every connection is admitted."""

    def __init__(self, credentials: Credentials | None, router: str, locator: str, now_ns: int) -> None:
        """`router` is the name whose presence is awaited."""
        self._credentials = credentials
        self._router = router
        self._locator = locator
        self._until_ns = now_ns + ADMISSION_NS
        self._is_open = credentials is not None

    def heard(self, name: str, is_alive: bool) -> None:
        """Handle the presence of a process: that of the router shows admission."""
        if is_alive and name == self._router:
            self._is_open = False

    def check(self, now_ns: int) -> None:
        """Raise NotAuthorised when the router's presence has not been received in time."""
        if self._is_open and now_ns >= self._until_ns:
            assert self._credentials is not None
            who = self._credentials.identity
            raise NotAuthorised(
                f"{who}: not authorised, or not reachable: the {self._router} at {self._locator} accepts the "
                f"connection and sends nothing; is {who} in the deployment, and is this the right plane's address?"
            )


class Exposure:
    """Repeats every minute that a plane is open to every process that reaches it, by `--insecure`."""

    def __init__(self, address: Address, now_ns: int) -> None:
        """`address` is that of the router; there is no reminder for a loopback address, or with TLS."""
        self._address = address
        self._is_open = not address.is_loopback and address.protocol == "tcp"
        self._next_ns = now_ns

    def due(self, now_ns: int) -> str:
        """Return the reminder when it is due, else an empty text."""
        if not self._is_open or now_ns < self._next_ns:
            return ""
        self._next_ns = now_ns + REMINDER_NS
        return f"insecure: any process that reaches {self._address} can take part, without a certificate"
