"""Where a plane listens: `HOST`, `HOST:PORT`, `tcp/HOST:PORT` or, with certificates, `tls/HOST:PORT`, read and checked.

Without certificates every process that reaches a plane can take part in it, so an address that other machines can reach
needs `--insecure`.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from ipaddress import IPv6Address, ip_address
from typing import Final, Literal

from foosim.common.errors import BadValue, Refused

LOOPBACK: Final = "127.0.0.1"
PORT_MAX: Final = 65_535

_HOST = r"\[[0-9a-fA-F:.]{2,45}\]|[A-Za-z0-9][A-Za-z0-9.-]{0,252}"
_ADDRESS = re.compile(rf"(?:(?P<protocol>tcp|tls)/)?(?P<host>{_HOST})(?::(?P<port>[0-9]{{1,5}}))?")


class Insecure(Refused):
    """An address that others can reach, without `--insecure`."""


@dataclass(frozen=True, slots=True)
class Address:
    """A host (a name or an IP address) and a TCP port; port 0 lets the system choose."""

    host: str
    port: int = 0
    protocol: Literal["tcp", "tls"] = "tcp"

    def __str__(self) -> str:
        return f"{self.protocol}/{self.host}:{self.port}"

    @property
    def is_loopback(self) -> bool:
        """Whether only this machine can reach it."""
        try:
            return ip_address(self.host.strip("[]")).is_loopback
        except ValueError:
            return self.host == "localhost"

    @property
    def is_wildcard(self) -> bool:
        """Whether it is the wildcard for every address of this machine."""
        try:
            return ip_address(self.host.strip("[]")).is_unspecified
        except ValueError:
            return False

    def next_port(self) -> Address:
        """Return the address one port higher: the radio plane's beside the simulation plane's."""
        return self if self.port == 0 else replace(self, port=self.port + 1)


def parse_address(text: str, secured: bool | None = None) -> Address:
    """Return the address in `text`; raises BadValue.

    `secured`: with certificates the address is `tls`, without it is `tcp`. None accepts either.
    """
    match = _ADDRESS.fullmatch(text)
    port = int(match["port"] or 0) if match is not None else 0
    if match is None or port > PORT_MAX:
        raise BadValue("not an address (HOST, HOST:PORT, tcp/HOST:PORT or tls/HOST:PORT)", text, _in_brackets(text))
    protocol = match["protocol"]
    if secured is True and protocol == "tcp":
        raise BadValue("not an address for certificates", text, f"tls/{match['host']}:{port}")
    if secured is False and protocol == "tls":
        raise BadValue("an address that needs certificates: give their folder by --pki DIR", text)
    return Address(match["host"], port, "tls" if secured or protocol == "tls" else "tcp")


def _in_brackets(text: str) -> str | None:
    """Return a bare IPv6 address in the brackets that it needs; None for any other text."""
    protocol, slash, host = text.rpartition("/")
    try:
        return repr(f"{protocol}{slash}[{IPv6Address(host)}]")
    except ValueError:
        return None


def check_listen(text: str, insecure: bool, ports: int = 1, secured: bool = False) -> Address:
    """Return the address to listen on; raises BadValue, and Insecure when others can reach it without permission.

    `ports` is the number of consecutive ports needed; `secured` whether there are certificates.
    """
    address = parse_address(text, secured)
    if secured and insecure:
        raise BadValue("--insecure and --pki exclude each other", text)
    if address.port + ports - 1 > PORT_MAX:
        raise BadValue(f"no room for {ports} ports", text)
    if not address.is_loopback and not insecure and not secured:
        raise Insecure(
            f"{address} is reached by other machines, and admits any process; give --pki "
            "DIR with certificates, or --insecure to allow it"
        )
    return address


def reachable(locators: list[str], wanted: Address) -> str:
    """Return the locator for others to connect to, of those on which a session listens."""
    assert locators, "a listening session has a locator"
    if not wanted.is_wildcard:
        return locators[0]
    plain = [locator for locator in locators if "%" not in locator]
    outside = [locator for locator in plain if not parse_address(locator).is_loopback]
    return ([*(locator for locator in outside if "[" not in locator), *outside, *plain] or locators)[0]
