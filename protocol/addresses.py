"""Where a plane listens: `HOST`, `HOST:PORT` or `tcp/HOST:PORT`, read and checked.

Whoever reaches a plane takes part in it, so an address that other machines reach has to be asked for twice: with
`--insecure`. Neighbours: `session` opens the address, commands read it.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from ipaddress import ip_address
from typing import Final

from foosim.protocol.errors import BadValue, Refused

LOOPBACK: Final = "127.0.0.1"
PORT_MAX: Final = 65_535

_HOST = r"\[[0-9a-fA-F:.]{2,45}\]|[A-Za-z0-9][A-Za-z0-9.-]{0,252}"
_ADDRESS = re.compile(rf"(?:tcp/)?(?P<host>{_HOST})(?::(?P<port>[0-9]{{1,5}}))?")


class Insecure(Refused):
    """An address that others can reach, without the word that this is meant."""


@dataclass(frozen=True, slots=True)
class Address:
    """A host (a name or an IP address) and a TCP port; port 0 lets the system choose."""

    host: str
    port: int = 0

    def __str__(self) -> str:
        return f"tcp/{self.host}:{self.port}"

    @property
    def is_loopback(self) -> bool:
        """Whether only this machine can reach it."""
        try:
            return ip_address(self.host.strip("[]")).is_loopback
        except ValueError:
            return self.host == "localhost"

    @property
    def is_wildcard(self) -> bool:
        """Whether it stands for every address of this machine."""
        try:
            return ip_address(self.host.strip("[]")).is_unspecified
        except ValueError:
            return False

    def next_port(self) -> Address:
        """Return the address one port higher: the radio plane's beside the simulation plane's."""
        return self if self.port == 0 else Address(self.host, self.port + 1)


def parse_address(text: str) -> Address:
    """Return the address in `text`; raises BadValue."""
    match = _ADDRESS.fullmatch(text)
    port = int(match["port"] or 0) if match is not None else 0
    if match is None or port > PORT_MAX:
        raise BadValue("not an address (HOST, HOST:PORT or tcp/HOST:PORT)", text)
    return Address(match["host"], port)


def check_listen(text: str, insecure: bool, ports: int = 1) -> Address:
    """Return the address to listen on; raises BadValue, and Insecure when others reach it and that was not asked for.

    `ports` is how many in a row are needed.
    """
    address = parse_address(text)
    if address.port + ports - 1 > PORT_MAX:
        raise BadValue(f"no room for {ports} ports", text)
    if not address.is_loopback and not insecure:
        raise Insecure(
            f"{address} is reached by other machines, and whoever reaches it takes part; say --insecure to mean it"
        )
    return address


def reachable(locators: list[str], wanted: Address) -> str:
    """Return the locator that others should connect to, of those on which a session listens."""
    assert locators, "a listening session has a locator"
    if not wanted.is_wildcard:
        return locators[0]
    plain = [locator for locator in locators if "%" not in locator]
    outside = [locator for locator in plain if not parse_address(locator).is_loopback]
    return ([*(locator for locator in outside if "[" not in locator), *outside, *plain] or locators)[0]
