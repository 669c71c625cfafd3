"""The frames of a rehearsal, for tests that compare them."""

from __future__ import annotations

from dataclasses import dataclass, field

from foosim.world.frame import Frame


@dataclass
class Frames:
    """The frames of a rehearsal, in their order: `on_commit` of its settings."""

    frames: list[Frame] = field(default_factory=list)

    def __call__(self, frame: Frame) -> None:
        self.frames.append(frame)
