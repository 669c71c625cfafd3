"""Poses of a capture's entities at any time, interpolated between captured ones: for comparisons of sources.

What was captured at the time itself is taken as it is; between two captured moments that are close a position is
interpolated, but not over a jump.
"""

from __future__ import annotations

from math import isnan
from typing import Final

from foosim.console.recorded.recording import Look, Recording
from foosim.console.shown.tracks import GAP_NS, Pose, between, is_jump


class Whereabouts:
    """Gives the poses of a recording's entities at times of a deck, in the thread that the recording belongs to."""

    def __init__(self, recording: Recording, offset_ns: int = 0, *, links: bool = False) -> None:
        """`offset_ns`: the capture's time at time 0 of the deck. `links`: report each link under its name, too."""
        self._recording: Final = recording
        self._offset_ns = offset_ns
        self._links = links

    def __call__(self, time_ns: int) -> dict[str, Pose]:
        """Return the pose of each entity (that of its last link) that has a position. Raises CaptureError."""
        recording = self._recording
        own_ns = time_ns + self._offset_ns
        tick, rest_ns = divmod(own_ns, recording.tick_ns)
        first, last = recording.span
        if not first <= tick <= last:
            return {}
        look = recording.look(tick)
        if look is None:
            return {}
        if look.tick == tick and not rest_ns:
            return self._poses(look)
        later = recording.neighbour(tick, later=True)
        after = None if later is None else recording.look(later)
        passed_ns = (after.tick - look.tick) * recording.tick_ns if after is not None else 0
        if after is None or not 0 < passed_ns <= GAP_NS:
            return {}
        share = (own_ns - look.tick * recording.tick_ns) / passed_ns
        ends = self._poses(after)
        return {
            name: between(pose, ends[name], share)
            for name, pose in self._poses(look).items()
            if name in ends and not is_jump(pose[0], ends[name][0], passed_ns)
        }

    def _poses(self, look: Look) -> dict[str, Pose]:
        drawing = self._recording.drawing
        rows = look.poses.tolist()
        places = {**drawing.links, **drawing.entities} if self._links else drawing.entities
        return {
            name: (tuple(rows[place][:3]), tuple(rows[place][3:]))
            for name, place in places.items()
            if not isnan(rows[place][0])
        }
