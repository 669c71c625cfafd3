"""The admission to a plane: access control denies silently, so an admitted process is one that sees its router's
presence.

A connection with certificates that receives no presence of its router within `ADMISSION_NS` has an identity that the
deployment does not declare.
"""

from __future__ import annotations

from typing import Final

from foosim.runtime.transport.certificates import Credentials, NotAuthorised

ADMISSION_NS: Final = 10_000_000_000


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
