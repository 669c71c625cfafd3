"""The settings of a session: common settings, certificates, grants. Zenoh's names, without Zenoh.

Each line is here because its default did not fit.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

from foosim.common import limits
from foosim.common.addresses import Address
from foosim.protocol.access import Access, access_control
from foosim.protocol.channels import CHANNELS, Plane
from foosim.runtime.transport.certificates import Credentials

LEASE_MS: Final = 1000
"""The silence after which a peer is lost."""
BLOCK_US: Final = 500_000
"""The longest time a stuck reader may block a sender; then its link is closed."""
QUERY_S: Final = 2.0


@dataclass(frozen=True, slots=True)
class Security:
    """The identity, and the grants of a router."""

    credentials: Credentials
    access: Access | None = None


def router_settings(address: Address, message_bytes_max: int, security: Security | None) -> dict[str, Any]:
    """Return the settings of a plane's router."""
    settings = _common_settings("router", message_bytes_max, address.protocol) | {
        "listen/endpoints": [str(address)],
        "listen/timeout_ms": 0,
        "listen/exit_on_failure": True,
        "connect/endpoints": [],
        # Its own admin space has the chosen port. It can be read, never written.
        "adminspace/enabled": True,
        "adminspace/permissions": {"read": True, "write": False},
    }
    if security is None:
        return settings
    assert security.access is not None, "a router with certificates has access rules"
    return settings | _certificate_settings(security) | _access_settings(security.access)


def client_settings(
    address: Address, message_bytes_max: int, timeout_s: float, security: Security | None
) -> dict[str, Any]:
    """Return the settings of a client that tries to connect for so long."""
    settings = _common_settings("client", message_bytes_max, address.protocol) | {
        "listen/endpoints": [],
        "connect/endpoints": [str(address)],
        "connect/timeout_ms": max(1, int(1000 * timeout_s)),
        "connect/exit_on_failure": True,
        "connect/retry": {"period_init_ms": 50, "period_max_ms": 200, "period_increase_factor": 2.0},
        "adminspace/enabled": False,
    }
    return settings if security is None else settings | _certificate_settings(security)


def holds(found: Any, given: Any) -> bool:
    """Whether Zenoh returns the settings that it was given; missing keys of a mapping are null."""
    if isinstance(given, dict) and isinstance(found, dict):
        return all(holds(value, given.get(key)) for key, value in found.items()) and given.keys() <= found.keys()
    if isinstance(given, list) and isinstance(found, list):
        return len(found) == len(given) and all(map(holds, found, given))
    return bool(found == given)


def _common_settings(mode: str, message_bytes_max: int, protocol: str) -> dict[str, Any]:
    """Return the settings of router and client."""
    return {
        "mode": mode,
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
        "scouting/delay": 0,  # a router would wait half a second for peers that it does not look for
        "timestamping/enabled": {"router": False, "peer": False, "client": False},  # ticks are our time
        "queries_default_timeout": int(QUERY_S * 1000),
        "transport/shared_memory/enabled": False,  # loses queries when a reader stalls
        "transport/unicast/lowlatency": False,  # lost messages above 64 kB between hosts
        "transport/unicast/qos/enabled": True,
        "transport/unicast/accept_timeout": 2000,  # half-open connections are dropped sooner
        "transport/unicast/accept_pending": 200,
        "transport/unicast/open_timeout": 5000,
        "transport/unicast/max_sessions": limits.NODES_MAX + limits.CLIENTS_MAX,
        "transport/unicast/max_links": 1,
        "transport/link/protocols": [protocol],
        "transport/link/tx/lease": LEASE_MS,
        "transport/link/tx/keep_alive": 4,
        "transport/link/tx/queue/batching/enabled": True,  # without, also bursts cost a packet for each message
        "transport/link/tx/queue/congestion_control/block/wait_before_close": BLOCK_US,
        "transport/link/tx/queue/congestion_control/drop/wait_before_drop": 1000,
        "transport/link/tx/queue/congestion_control/drop/max_wait_before_drop_fragments": 1000,  # of each of its parts
        "transport/link/rx/max_message_size": message_bytes_max,  # a gigabyte by default
    }


def _certificate_settings(security: Security) -> dict[str, Any]:
    """Return root and certificate: both sides need `enable_mtls`, or no client certificate is sent."""
    mine = security.credentials
    side = "connect" if security.access is None else "listen"
    settings: dict[str, Any] = {
        "root_ca_certificate": str(mine.ca),
        "enable_mtls": True,
        "verify_name_on_connect": True,
        "close_link_on_expiration": True,
        f"{side}_certificate": str(mine.certificate),
        f"{side}_private_key": str(mine.key),
    }
    return {f"transport/link/tls/{key}": value for key, value in settings.items()}


def _access_settings(access: Access) -> dict[str, Any]:
    return {"access_control": access_control(access), "low_pass_filter": _size_limits(access.plane)}


def _size_limits(plane: Plane) -> list[dict[str, Any]]:
    """Return the limits of channels with smaller messages than their plane's largest, from the table of channels."""
    channels = [channel for channel in CHANNELS if channel.plane is plane]
    largest = max(channel.bytes_max for channel in channels)
    return [
        {
            "id": f"size of {channel.name}",
            "flows": ["ingress"],
            "messages": ["put"],
            "key_exprs": [channel.key_for_all],
            "size_limit": channel.bytes_max,
        }
        for channel in channels
        if channel.bytes_max < largest
    ]
