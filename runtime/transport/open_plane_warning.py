"""Repeats every minute that a plane is open to every process that reaches it, by `--insecure`."""

from __future__ import annotations

from typing import Final

from foosim.common.addresses import Address

EVERY_NS: Final = 60_000_000_000


class Exposure:
    """The reminder of one process."""

    def __init__(self, address: Address, now_ns: int) -> None:
        """`address` is that of the router; there is no reminder for a loopback address, or with TLS."""
        self._address = address
        self._is_open = not address.is_loopback and address.protocol == "tcp"
        self._next_ns = now_ns

    def due(self, now_ns: int) -> str:
        """Return the reminder when it is due, else an empty text."""
        if not self._is_open or now_ns < self._next_ns:
            return ""
        self._next_ns = now_ns + EVERY_NS
        return f"insecure: any process that reaches {self._address} can take part, without a certificate"
