"""Every limit of the project, in one file.

A limit bounds the cost of a wrong or hostile peer, file or request. A refusal names the limit that was exceeded.
"""

from typing import Final

PROTOCOL_VERSION: Final = 7
"""Version of the messages; a peer with another one is refused at the handshake, both versions named."""

NAME_LENGTH_MAX: Final = 32
PART_NAME_LENGTH_MAX: Final = 256
"""Characters of the name of a link or joint of a robot."""
ENTITIES_MAX: Final = 4096
COMPONENTS_MAX: Final = 256
"""Forms of a world from other packages."""
COMPONENT_NAME_MAX: Final = 400
"""Characters of a component with its module and class, and of its version."""
NODES_MAX: Final = 256
CLIENTS_MAX: Final = 1024
METRICS_MAX: Final = 64
"""Metrics that one client may report, by name."""
METRICS_OF_RUN_MAX: Final = 2_048
"""The same of all clients of a run: they fit a report of the vHub."""
METRIC_CHANNELS_MAX: Final = 256
"""Channels with figures of their own in the metrics of the network; further ones share theirs."""
OPERATORS_MAX: Final = 64
WATCHED_MAX: Final = 64
"""Links and readings that viewers watch at once."""
OPERATOR_LENGTH_MAX: Final = 24
"""Of an operator's or viewer's name: each of his sessions adds a dot and seven characters."""

COUNTER_MAX: Final = 2**63 - 1
"""Ticks, epochs, nanoseconds and sequence numbers: they fit a signed 64-bit integer of any MessagePack reader."""

PAYLOAD_BYTES_MAX: Final = 32 * 1024
"""Opaque bytes of one packet."""
MESSAGE_BYTES_MAX: Final = 4 * 1024 * 1024
"""One message of the simulation plane (a commit of a large world, a build with models)."""
RADIO_MESSAGE_BYTES_MAX: Final = 1024 * 1024
"""One message from or to a client."""
SMALL_MESSAGE_BYTES_MAX: Final = 64 * 1024
"""One message without a list of packets, numbers or entities: the kinds that a new peer may send first."""
PACKETS_PER_MESSAGE_MAX: Final = 65_536
DEPLOYMENT_BYTES_MAX: Final = 64 * 1024
"""A deployment's text, and each file that one includes."""
EXPANDED_NODES_MAX: Final = 400_000
"""Values and keys of a deployment whose templates and counts are expanded."""
TEMPLATES_MAX: Final = 256
LIKE_DEPTH_MAX: Final = 16
"""Templates that are like one another, in a row."""
INCLUDES_MAX: Final = 32
"""Files that a deployment includes, also through others."""
INCLUDE_DEPTH_MAX: Final = 8
INCLUDED_BYTES_MAX: Final = 256 * 1024
"""All included files of a deployment."""
COMPARISONS_MAX: Final = 10_000_000
"""Names that are compared with the selectors of one deployment."""
TEXT_LENGTH_MAX: Final = 8 * 1024

ASSET_BYTES_MAX: Final = 10 * 1024 * 1024
"""One file that a deployment refers to."""
ASSETS_BYTES_MAX: Final = 64 * 1024 * 1024
"""All files that a deployment refers to."""
ASSET_PIECE_BYTES: Final = 1024 * 1024
"""The piece of such a file in one message."""
RADIO_PIECE_BYTES: Final = 256 * 1024
"""That in a message to a client."""
FETCHED_BYTES_PER_S: Final = 4 * 1024 * 1024
"""What a client may fetch steadily, beside twice ASSETS_BYTES_MAX at once."""
MESH_TRIANGLES_MAX: Final = 200_000
VISUAL_BYTES_MAX: Final = 64 * 1024 * 1024
"""A file of a mesh that is only drawn: it becomes a small one before it is part of a deployment."""
VISUAL_TRIANGLES_MAX: Final = 2_000_000
"""A mesh that is only drawn, before it is made small."""
LOOKS_TRIANGLES_MAX: Final = 1_000_000
"""All visuals of a world's bodies: beyond it links are drawn by their collision shapes."""
SCENERY_TRIANGLES_MAX: Final = 400_000
"""All meshes of a world: they go to a viewer in one message, which fits one chunk of a capture."""

FRAMES_MAX: Final = 4_096
"""Frames of one packet on a link with an mtu."""
ROBOT_PACKETS_PER_TICK_MAX: Final = 1 << 16
"""A robot's sequence number is tick x 2^16 + index."""
OUTBOX_PACKETS_MAX: Final = 64
OUTBOX_BYTES_MAX: Final = 1024

INBOX_MESSAGES_MAX: Final = 65_536
CLIENT_INBOX_BYTES_MAX: Final = 8 * 1024 * 1024
"""Messages of one client between two closings of the vHub; more are refused."""
CLIENT_INBOXES_BYTES_MAX: Final = 32 * 1024 * 1024
"""The same of all clients: half of the limit of a vHub's journal record."""
PACKET_HEAD_BYTES_MAX: Final = 128
"""Overhead of a packet in a message beside its payload."""
ROBOTS_BYTES_PER_TICK_MAX: Final = 3 * 1024 * 1024
"""Bytes delivered to robots at one tick, in one message; more are dropped."""
CLIENT_BYTES_PER_TICK_MAX: Final = 768 * 1024
"""The same for one client."""
TRANSIT_BYTES_MAX: Final = 48 * 1024 * 1024
"""Bytes in flight in the whole run, which fit a record of the vHub's journal; more are dropped."""
FLIGHT_HEAD_BYTES: Final = 200
"""Overhead of a packet in flight beside its payload."""
RECOVERIES_PER_COMMIT_MAX: Final = 1_024
"""Losses and returns that a commit reports; the next one reports the rest."""
HELD_MESSAGES_MAX: Final = 1024
"""Messages that a node holds for a coming epoch: parts of some ticks of all nodes."""
KEPT_TICKS: Final = 16
"""Ticks of sent messages that each process keeps for repetition."""
RELEASE_AHEAD: Final = 4
"""W: order k is released once tick k - W is committed."""
RESTART_PAUSE_NS_MAX: Final = 8_000_000_000
"""The longest pause before a process that ended is started again."""
WANT_AFTER_NS: Final = 20_000_000
WANT_EVERY_NS_MAX: Final = 1_000_000_000
HEARTBEAT_NS: Final = 100_000_000
DOWNLINK_KEPT_NS: Final = 2_000_000_000
DOWNLINKS_KEPT_MAX: Final = 16_384
"""Numbered downlinks that are kept for one client."""
UPLINKS_KEPT_MAX: Final = 65_536
"""Packets that a client keeps until the vHub has recorded them."""
EVENT_BYTES_MAX: Final = 4_096
"""The text of one request for a network event."""
MODEL_MEMORY_BYTES_MAX: Final = 4_096
"""The state of a user-defined link model, per link."""
CHECKPOINT_TICKS: Final = 500
"""Period of the vHub's journal checkpoints: a fold begins at the last one."""
LAG_ANCHOR_NS: Final = 100_000_000
"""A lag above this moves the wall anchor; less is caught up."""
JOURNAL_BYTES_MAX: Final = 64 * 1024 * 1024
CAPTURE_QUEUE_ROWS_MAX: Final = 200_000
YARP_MESSAGE_BYTES_MAX: Final = 256 * 1024
"""One message to a port of YARP; what a port sends, such as a picture, has no limit of its own."""
YARP_LINE_BYTES_MAX: Final = 64 * 1024
"""One line to a port or name server of YARP."""
YARP_DEPTH_MAX: Final = 32
"""Lists in lists of a bottle."""
YARP_BEHIND_BYTES_MAX: Final = 64 * 1024
"""Bytes that wait for a reader of a port before messages to it are dropped."""
YARP_BEHIND_MESSAGES_MAX: Final = 256
"""Messages that a reader of a port has not acknowledged before further ones are dropped."""
YARP_NAMES_MAX: Final = 65_536
"""Ports at the name server that a gateway starts."""
