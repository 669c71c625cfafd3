"""The start of a run, as a value that messages and files carry: frame 0, or the frame of another run."""

from __future__ import annotations

import msgspec

from foosim.common.struct_types import Counter, Digest, Item, Numbers, Text
from foosim.world.robot_packets import Outboxes


class Origin(Item, frozen=True):
    """The start of a run from another one: at frame `tick` of `source`, with that frame's digest and the chain over all
    frames up to it."""

    tick: Counter
    source: Text
    digest: Digest
    chain: Digest


class Start(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True):
    """A frame that a run begins with instead of frame 0, and its source.

    The frame has all state: positions and speeds, score, the slots of rules, actuators and sensors, outboxes.
    """

    origin: Origin
    values: Numbers
    outboxes: Outboxes
