"""Payloads that a capture keeps as hashes: rows without them, and who needs them all the same.

With `capture.payloads: hashed` no payload stands in the file: not in rows of packets, nor in deliveries and outboxes,
which a re-simulation is fed with. A hash tells whether two payloads are equal, and whether one is what somebody thinks
it is; what can be guessed is not hidden by it. Neighbours: `rows` (the fields), `capture_file` (writes them so).
"""

from __future__ import annotations

from hashlib import blake2b
from typing import Final

from msgspec.structs import replace

from foosim.protocol.deployment import Deployment
from foosim.vhub.mcap_checks import CaptureError
from foosim.vhub.rows import FrameRow, PacketRow, Row, TickRow

HASH_BYTES: Final = 16
HASHED: Final = "hashed"


def payload_hash(payload: bytes) -> bytes:
    """Return what stands for a payload: its BLAKE2b, 16 bytes, without a key (`b2sum -l 128`)."""
    return blake2b(payload, digest_size=HASH_BYTES).digest()


def hashed_row(row: Row) -> Row:
    """Return a row with hashes in the place of payloads."""
    if isinstance(row, PacketRow):
        return replace(row, payload=b"", payload_hash=payload_hash(row.payload))
    if isinstance(row, TickRow) and row.deliveries:
        deliveries = [replace(d, payload=b"", payload_hash=payload_hash(d.payload)) for d in row.deliveries]
        return replace(row, deliveries=deliveries)
    if isinstance(row, FrameRow) and row.outboxes:
        outboxes = [replace(o, packets=b"", packets_hash=payload_hash(o.packets)) for o in row.outboxes]
        return replace(row, outboxes=outboxes)
    return row


def keeps_hashes(deployment: Deployment) -> bool:
    """Whether captures of a deployment have hashes in the place of payloads."""
    return deployment.capture.payloads == HASHED


def check_payloads(capture: str, deployment: Deployment, who: str) -> None:
    """Raise CaptureError for a capture without payloads, by its name; `who` needs them."""
    if keeps_hashes(deployment):
        raise CaptureError(f"{capture}: its payloads are hashed (capture.payloads), and {who} needs them as they were")
