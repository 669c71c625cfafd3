"""Every limit of the project, in one file.

A limit is what keeps a wrong or hostile peer, file or request from costing more than it should. Code that
refuses something names the limit it broke.
"""

from typing import Final

PROTOCOL_VERSION: Final = 2
"""Version of the messages; a peer with another one is refused at the handshake, both versions named."""

NAME_LENGTH_MAX: Final = 32
ENTITIES_MAX: Final = 4096
NODES_MAX: Final = 256
CLIENTS_MAX: Final = 1024
OPERATORS_MAX: Final = 64
WATCHED_MAX: Final = 64
"""Links that people look at at once, and readings."""
OPERATOR_LENGTH_MAX: Final = 24
"""Of an operator's or viewer's name: each of his sessions adds a dot and seven characters."""

COUNTER_MAX: Final = 2**63 - 1
"""Ticks, epochs, nanoseconds and sequence numbers: what every MessagePack reader holds in a signed 64-bit integer."""

PAYLOAD_BYTES_MAX: Final = 32 * 1024
"""Opaque bytes of one packet."""
MESSAGE_BYTES_MAX: Final = 4 * 1024 * 1024
"""One message of the simulation plane (a commit of a large world, a build with models)."""
RADIO_MESSAGE_BYTES_MAX: Final = 1024 * 1024
"""One message from or to a client."""
SMALL_MESSAGE_BYTES_MAX: Final = 64 * 1024
"""One message of those that have no list of packets, numbers or entities: what anybody who is let in may say first."""
PACKETS_PER_MESSAGE_MAX: Final = 65_536
DEPLOYMENT_BYTES_MAX: Final = 64 * 1024
TEXT_LENGTH_MAX: Final = 8 * 1024

ASSET_BYTES_MAX: Final = 10 * 1024 * 1024
"""One file that a deployment refers to."""
ASSETS_BYTES_MAX: Final = 64 * 1024 * 1024
"""All of them."""
ASSET_PIECE_BYTES: Final = 1024 * 1024
"""What one message carries of such a file."""
MESH_TRIANGLES_MAX: Final = 200_000
SCENERY_TRIANGLES_MAX: Final = 400_000
"""All meshes of a world: a viewer is told of them in one message, and a capture's chunk holds it."""

ROBOT_PACKETS_PER_TICK_MAX: Final = 1 << 16
"""A robot's sequence number is tick x 2^16 + index."""
OUTBOX_PACKETS_MAX: Final = 64
OUTBOX_BYTES_MAX: Final = 1024

INBOX_MESSAGES_MAX: Final = 65_536
CLIENT_INBOX_BYTES_MAX: Final = 8 * 1024 * 1024
"""What one client says between two closings of the vHub; what is beyond it is refused."""
CLIENT_INBOXES_BYTES_MAX: Final = 32 * 1024 * 1024
"""The same of all clients: half of what a record of the vHub's journal may be."""
PACKET_HEAD_BYTES_MAX: Final = 128
"""What a packet takes in a message beside its payload."""
ROBOTS_BYTES_PER_TICK_MAX: Final = 3 * 1024 * 1024
"""What reaches robots at one tick, which is one message; what is beyond it is dropped."""
CLIENT_BYTES_PER_TICK_MAX: Final = 768 * 1024
"""The same of one client."""
TRANSIT_BYTES_MAX: Final = 48 * 1024 * 1024
"""What is on its way in the whole run, which a record of the vHub's journal holds; what is beyond it is dropped."""
FLIGHT_HEAD_BYTES: Final = 200
"""What a packet on its way counts beside its payload."""
RECOVERIES_PER_COMMIT_MAX: Final = 1_024
"""How many losses and returns a commit tells of; what is beyond it is told by the next one."""
HELD_MESSAGES_MAX: Final = 1024
"""What a node holds of an epoch that it does not know yet: parts of some ticks of as many nodes as there may be."""
KEPT_TICKS: Final = 16
"""How many ticks of what it sent each process keeps for those that ask again."""
RELEASE_AHEAD: Final = 4
"""W: order k is released once tick k - W is committed."""
WANT_AFTER_NS: Final = 20_000_000
WANT_EVERY_NS_MAX: Final = 1_000_000_000
HEARTBEAT_NS: Final = 100_000_000
DOWNLINK_KEPT_NS: Final = 2_000_000_000
DOWNLINKS_KEPT_MAX: Final = 16_384
"""How many numbered downlinks are kept for one client."""
UPLINKS_KEPT_MAX: Final = 65_536
"""How many packets a client keeps that the vHub has not recorded yet."""
EVENT_BYTES_MAX: Final = 4_096
"""What one request may say that shall happen to the network."""
MODEL_MEMORY_BYTES_MAX: Final = 4_096
"""What a link model of one's own may remember of a link."""
CHECKPOINT_TICKS: Final = 500
"""How often the vHub's state goes to its journal: a fold begins at the last one."""
LAG_ANCHOR_NS: Final = 100_000_000
"""A lag above this moves the wall anchor; less is caught up."""
JOURNAL_BYTES_MAX: Final = 64 * 1024 * 1024
CAPTURE_QUEUE_ROWS_MAX: Final = 200_000
