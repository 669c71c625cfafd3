"""Shared by tests of laws: the frames and rows of a rehearsal, and the check of components."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from foosim.deployment.schema import Deployment
from foosim.simulation.check.component_check import ComponentCheck
from foosim.vhub.recording.rows_of_closing import packet_entry, world_rows
from foosim.vhub.state.records import Closing
from foosim.world.frame import Frame


@dataclass
class Frames:
    """The frames of a rehearsal, in their order: `on_commit` of its settings."""

    frames: list[Frame] = field(default_factory=list)

    def __call__(self, frame: Frame) -> None:
        self.frames.append(frame)


def rows_of(closings: Sequence[Closing], deployment: Deployment, *without: str) -> list[Any]:
    """Return topic, time, number and fields of the rows of closings, without the wall's time and some topics."""
    rows: list[Any] = []
    known = None
    for closing in closings:
        for topic, at_ns, _, number, row in (
            *world_rows(closing, deployment, known),
            *map(packet_entry, closing.fates),
        ):
            fields = {name: getattr(row, name) for name in row.__struct_fields__ if not name.startswith("wall_")}
            if topic not in without:
                rows.append((topic, at_ns, number, fields))
        known = closing.frame
    return rows


def broken_laws(text: str, name: str, ticks: int, seed: int = 1) -> Iterator[str]:
    """Yield which laws a deployment's components break, in words, as each is found."""
    yield from ComponentCheck(text, name, ticks, seed).broken()
