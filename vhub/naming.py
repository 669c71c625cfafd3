"""What the vHub had said before a branch, as it is said in it: the same, with the number of the branch."""

from __future__ import annotations

from typing import TypeVar

import msgspec

from foosim.protocol.codec import decode, encode
from foosim.protocol.messages import Deliveries, Down

Said = TypeVar("Said", Deliveries, Down)


def in_branch(kind: type[Said], payload: bytes, branch: int) -> bytes:
    """Return what was said before a branch as it is said in it."""
    said = decode(kind, payload)
    return payload if said.branch == branch else encode(msgspec.structs.replace(said, branch=branch))
