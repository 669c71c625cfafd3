"""The frames between those that a capture has, computed again from its orders and deliveries: a step to the tick.

Each is compared with the digest that the capture has of its tick, so what is given is what was, to the last bit, or
nothing.
"""

from __future__ import annotations

from collections.abc import Iterable

from foosim.capture.reader import About, CapturedTick
from foosim.rehearsal.resimulation import Replica
from foosim.replay.verify import replica_of
from foosim.world.assembly.initial_state import added_to, start_with
from foosim.world.frame import CHAIN_START, Frame


class Between:
    """Computes frames of one capture on one node, which is made when it is first needed. It belongs to one thread."""

    def __init__(self, about: About) -> None:
        self._about = about
        self._replica: Replica | None = None

    def __call__(self, frame: Frame, inputs: Iterable[CapturedTick]) -> Frame | None:
        """Return the frame that inputs lead to from a captured one; None where it is not what the capture had.

        Raises Refused where the capture cannot be computed again: its files do not fit.
        """
        replica = self._at(frame)
        for captured in inputs:
            found = replica.step(captured.edits, captured.delivered)
            if found.digest != captured.digest:
                self.close()
                return None
        return replica.frame

    def _at(self, frame: Frame) -> Replica:
        """Return the node, standing at a frame."""
        if self._replica is not None:
            if self._replica.frame.digest != frame.digest or self._replica.frame.tick != frame.tick:
                self._replica.set_back(frame)
            return self._replica
        about = self._about
        start = start_with(frame, about.path.name, CHAIN_START, added_to(frame.layout))
        self._replica = replica_of(about.deployment_text, about.deployment_name, about.files, start)
        return self._replica

    def close(self) -> None:
        """Give the node up; it is made again when it is needed."""
        if self._replica is not None:
            self._replica.close()
            self._replica = None
