"""Says every minute that a plane is open to everybody who reaches it: what `--insecure` asked for."""

from __future__ import annotations

from typing import Final

from foosim.common.addresses import Address

EVERY_NS: Final = 60_000_000_000


class Exposure:
    """The reminder of one process."""

    def __init__(self, address: Address, now_ns: int) -> None:
        """`address` is where it listens, and what for; silent for one that only this machine reaches, or with TLS."""
        self._address = address
        self._is_open = not address.is_loopback and address.protocol == "tcp"
        self._next_ns = now_ns

    def due(self, now_ns: int) -> str:
        """Return what is to be said now; mostly nothing."""
        if not self._is_open or now_ns < self._next_ns:
            return ""
        self._next_ns = now_ns + EVERY_NS
        return f"insecure: whoever reaches {self._address} takes part, without a certificate or a password"
