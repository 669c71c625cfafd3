"""Messages that are repeated until they are answered: the client's half of requests by id."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable
from typing import Final, TypeVar

from foosim.common.errors import Malformed
from foosim.protocol.channels import Channel
from foosim.protocol.codec import decode
from foosim.protocol.messages import Answer
from foosim.runtime.roles.wire import Wire
from foosim.runtime.transport.inbox import Inbox

AGAIN_S: Final = 0.1
Taken = TypeVar("Taken")
Take = Callable[[str, str, bytes], Taken | None]
"""Makes a result of a message (a channel's key, a name, the payload); None for any other message."""


def exchange(
    wire: Wire,
    inbox: Inbox,
    channel: Channel,
    name: str,
    payload: bytes,
    take: Take[Taken],
    timeout_s: float,
    give_up: Callable[[], bool] = lambda: False,
) -> Taken | None:
    """Put a message on the channel's key of `name`, repeatedly, until `take` gives a result; None at the end.

    `take` gets every message of the inbox; one that raises Malformed is dropped.
    """
    deadline_s = time.monotonic() + timeout_s
    while (left_s := deadline_s - time.monotonic()) > 0 and not give_up():
        wire.put(channel, name, payload)
        again_s = time.monotonic() + min(left_s, AGAIN_S)
        result: Taken | None = None
        while result is None and (left_s := again_s - time.monotonic()) > 0:
            for message in inbox.take(left_s):
                with contextlib.suppress(Malformed):
                    result = take(*message) or result
        if result is not None:
            return result
    return None


def answer_to(channel: Channel, identity: str) -> Take[Answer]:
    """Return the function that takes the answer to a request from the messages of a channel."""

    def take(key: str, name: str, payload: bytes) -> Answer | None:
        answer = decode(Answer, payload, channel.bytes_max) if key == channel.key else None
        return answer if answer is not None and answer.id == identity else None

    return take
