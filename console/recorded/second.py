"""What follows a first source: another capture or a table of poses, on its clock, with the distance to it."""

from __future__ import annotations

from collections.abc import Callable, Collection
from pathlib import Path
from typing import Annotated, Final

import typer

from foosim.common.errors import BadValue, read_at, show
from foosim.common.units import parse_offset_ns
from foosim.console.clock.leading import Leader
from foosim.console.recorded.capture_source import FileSource, Recompute
from foosim.console.recorded.poses_source import PosesSource
from foosim.deployment.schema import Deployment
from foosim.world.assembly.world import build_scene
from foosim.world.layout import build_layout

SecondOption = Annotated[
    Path | None,
    typer.Option(metavar="CAPTURE|CSV", help="Another one on the same clock, beside it or as a ghost in it."),
]
OffsetOption = Annotated[
    str | None,
    typer.Option(help="The time of --second at which the first one has time 0, e.g. 2.5s or -1s."),
]
TABLE: Final = ".csv"
"""How the name of a table of poses ends; all else is a capture."""
NAMES_SHOWN: Final = 8
Recomputing = Callable[[Path], Recompute]
"""Makes a function that computes the frames between the captured ones."""


def read_offset(second: Path | None, offset: str | None) -> int:
    """Return the offset of an option in ns, 0 without one. Raises BadValue."""
    if offset is not None and second is None:
        raise BadValue("--offset needs --second")
    return 0 if offset is None else read_at("--offset", parse_offset_ns, offset)


def is_table(file: Path) -> bool:
    """Whether a file is a table of poses."""
    return file.suffix.lower() == TABLE


def open_follower(
    path: Path,
    leader: Leader,
    deployment: Deployment,
    offset_ns: int = 0,
    recomputing: Recomputing | None = None,
) -> tuple[FileSource | PosesSource, list[str]]:
    """Return the source of a file that follows one with a clock of its own, and the names that both have.

    `deployment` is the first source's. Raises CaptureError, BadPoses, and BadValue for a file that has nothing of the
    first source.
    """
    bodies = build_scene(deployment, build_layout(deployment)).bodies
    ours = {*bodies}
    second: FileSource | PosesSource
    if is_table(path):
        second = table = PosesSource(path, leader.clock, offset_ns, deployment, leader)
        theirs = {*table.tracks}
        ours |= {link.name for body in bodies.values() for link in body.links}
    else:
        recompute = None if recomputing is None else recomputing(path)
        second = capture = FileSource(path, leader.clock, offset_ns, recompute, leader)
        theirs = {*capture.recording.drawing.entities}
    both = sorted(ours & theirs)
    if not both:
        raise BadValue(
            f"--second has nothing that the {deployment.world} has, {_some(bodies)}; it has {_some(theirs)}",
            str(path),
        )
    return second, both


def compared_text(path: Path, both: Collection[str]) -> str:
    """Return the line that names the compared captures."""
    return f"second: {path.name}, compared by {_some(both)}"


def _some(names: Collection[str]) -> str:
    """Return names, the first of them where there are many."""
    shown = [show(name)[1:-1] for name in sorted(names)[:NAMES_SHOWN]]
    return f"{', '.join(shown)} and {len(names) - NAMES_SHOWN} more" if len(names) > NAMES_SHOWN else ", ".join(shown)
