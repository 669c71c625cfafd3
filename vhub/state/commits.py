"""The commits that the vHub has received: frames in order, and early ones until their turn.

A supervisor that takes over may lack the last one, and gets it from here.
"""

from __future__ import annotations

from foosim.common import limits
from foosim.protocol.barrier import committed_frame
from foosim.protocol.messages import Commit
from foosim.world.frame import Frame, chain_next
from foosim.world.layout import Layout

Committed = tuple[bytes, Commit, Frame]
"""A commit as received, decoded, and its frame."""


class Commits:
    """Committed frames by tick. `layout` is that of the world, None before it is known."""

    def __init__(self) -> None:
        self.layout: Layout | None = None
        self.next_tick = 0
        self._chains: dict[int, bytes] = {}
        self._frames: dict[int, Committed] = {}
        self._early: dict[int, tuple[bytes, Commit]] = {}

    def start(self, layout: Layout | None, tick: int, chain: bytes, last: Committed | None = None) -> None:
        """Begin with the frame of a tick, given the layout, the chain, and the frame before it if any."""
        self.layout, self.next_tick = layout, tick
        self._chains[tick - 1] = chain
        if last is not None:
            self._frames[tick - 1] = last

    def chain_at(self, tick: int) -> bytes:
        """Return the chain over the digests of the frames up to a tick's, without the one that a run begins with."""
        return self._chains[tick]

    def take(self, commit: Commit, payload: bytes) -> list[int]:
        """Add a commit; return the ticks whose frames it completes: none for a repeat or an early one.

        Raises `Malformed` for a frame with another digest than the commit says.
        """
        ahead = commit.tick - self.next_tick
        if self.layout is None or not 0 <= ahead <= limits.KEPT_TICKS:
            return []
        if ahead > 0:
            self._early[commit.tick] = payload, commit
            return []
        taken = [self._read(commit, payload)]
        while self.next_tick in self._early:
            early_payload, early = self._early.pop(self.next_tick)
            taken.append(self._read(early, early_payload))
        return taken

    def get(self, tick: int) -> Committed | None:
        """Return the commit of a tick; None before it has arrived and after `forget`."""
        return self._frames.get(tick)

    def __contains__(self, tick: int) -> bool:
        return tick in self._frames

    def last(self) -> tuple[bytes, bytes]:
        """Return the newest commit (empty before the first), and the chain up to it."""
        last = self._frames.get(self.next_tick - 1)
        return b"" if last is None else last[0], self._chains[self.next_tick - 1]

    def forget(self, tick: int) -> None:
        """Drop the commit of a tick, once nothing needs it any longer."""
        self._frames.pop(tick, None)
        self._chains.pop(tick, None)

    def _read(self, commit: Commit, payload: bytes) -> int:
        assert self.layout is not None
        frame = committed_frame(commit, self.layout)
        chain, begins = self._chains[commit.tick - 1], commit.tick - 1 not in self._frames
        self._chains[commit.tick] = chain if begins else chain_next(chain, commit.digest)
        self.next_tick += 1
        self._frames[commit.tick] = payload, commit, frame
        return commit.tick
