"""Whether the other side lets us in: access control denies silently, so who is let in sees that the router is present.

A connection with certificates that brings no sign of its router within `ADMISSION_NS` is one of somebody whom the
deployment does not know.
"""

from __future__ import annotations

from typing import Final

from foosim.runtime.transport.certificates import Credentials, NotAuthorised

ADMISSION_NS: Final = 10_000_000_000


class Admission:
    """What one connection waits for before it is sure to be let in; without certificates everybody is."""

    def __init__(self, credentials: Credentials | None, router: str, locator: str, now_ns: int) -> None:
        """`router` is whose presence is the sign."""
        self._credentials = credentials
        self._router = router
        self._locator = locator
        self._until_ns = now_ns + ADMISSION_NS
        self._is_open = credentials is not None

    def heard(self, name: str, is_alive: bool) -> None:
        """Somebody is present: who hears of the router is let in."""
        if is_alive and name == self._router:
            self._is_open = False

    def check(self, now_ns: int) -> None:
        """Raise NotAuthorised when there was no sign in time."""
        if self._is_open and now_ns >= self._until_ns:
            assert self._credentials is not None
            who = self._credentials.identity
            raise NotAuthorised(
                f"{who}: not authorised, or not reachable: the {self._router} at {self._locator} lets it connect and "
                f"tells it nothing; is {who} in the deployment, and is this the right plane's address?"
            )
