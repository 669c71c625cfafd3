"""What tests of laws have in common: the frames of a rehearsal, and the check of components."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from foosim.simulation.check.component_check import ComponentCheck
from foosim.world.frame import Frame


@dataclass
class Frames:
    """The frames of a rehearsal, in their order: `on_commit` of its settings."""

    frames: list[Frame] = field(default_factory=list)

    def __call__(self, frame: Frame) -> None:
        self.frames.append(frame)


def broken_laws(text: str, name: str, ticks: int, seed: int = 1) -> Iterator[str]:
    """Yield which laws a deployment's forms break, in words, as each is found."""
    yield from ComponentCheck(text, name, ticks, seed).broken()
