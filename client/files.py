"""The files of the world, which a client that hears a camera fetches from the vHub before it joins.

One piece is in flight at a time; a lost one is requested again. A client that gets none joins without the files: only
its pictures cannot be drawn.
"""

from __future__ import annotations

from collections.abc import Iterable, MutableMapping
from typing import Final

from foosim.common.errors import Malformed
from foosim.deployment.schema import Deployment
from foosim.protocol import channels
from foosim.protocol.actions import Action, Log, Publish
from foosim.protocol.asset_transfer import Fetching
from foosim.protocol.codec import encode
from foosim.protocol.messages import Fetch, Piece

REQUESTS_MAX: Final = 12
"""Requests without a new piece: 10 s with the back-off of a Join."""
BAD_MAX: Final = 3
"""Refused pieces: the source has other files, or none."""


def are_drawn(deployment: Deployment, pairs: Iterable[tuple[str, str]]) -> bool:
    """Whether readings of one of these (endpoint, channel) are drawn where they are looked at."""
    robots = deployment.robots
    heard = (robots[source].sensors.get(channel) for source, channel in pairs if source in robots)
    return any(sensor is not None and sensor.component_type.drawn_by for sensor in heard)


class ClientFiles:
    """The transfer to one client. `cache` has contents by digest and keeps received ones."""

    def __init__(
        self, name: str, boot: str, deployment: Deployment, cache: MutableMapping[str, bytes], actions: list[Action]
    ) -> None:
        self._name, self._boot, self._deployment = name, boot, deployment
        self._cache, self._actions = cache, actions
        named = deployment.world_files()
        cached = {digest: cache.get(digest) for digest in named.values()}
        known = {digest: content for digest, content in cached.items() if content is not None}
        self._fetching = Fetching(named, known)
        self._requests = self._bad = 0
        self.is_over = False
        """Whether the client may join."""
        self._check()

    def request(self) -> None:
        """Request the next piece, or give up."""
        assert self._fetching.lacking is not None
        if self._requests == REQUESTS_MAX:
            self._give_up(f"{self._requests} requests were not answered")
            return
        self._requests += 1
        digest, offset = self._fetching.lacking
        fetch = Fetch(self._name, self._boot, bytes.fromhex(digest), offset)
        self._actions.append(Publish(channels.CLIENT_FETCH, self._name, encode(fetch)))

    def take(self, piece: Piece) -> bool:
        """Take a piece; return whether it is the requested one. Raises Malformed for one that cannot be."""
        if self.is_over:
            return False
        try:
            if not self._fetching.take(piece):
                return False
        except Malformed:
            self._bad += 1
            if self._bad == BAD_MAX:
                self._give_up("the vHub has other ones")
            raise
        self._requests = 0
        digest = piece.digest.hex()
        if digest in self._fetching.files:
            self._cache[digest] = self._fetching.files[digest]
        self._check()
        return True

    def _check(self) -> None:
        if self._fetching.lacking is None:
            self._deployment.fetched.update(self._fetching.contents())
            self.is_over = True

    def _give_up(self, why: str) -> None:
        self.is_over = True
        self._actions.append(Log("warning", f"no files of the world, so cameras draw no pictures here: {why}"))
