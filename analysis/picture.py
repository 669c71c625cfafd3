"""Pictures that commands draw, by matplotlib, which is imported for a picture only."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Final

from foosim.capture.new_file import check_name, new_file
from foosim.common.errors import Failed

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ENDINGS: Final = (".svg", ".png", ".pdf")
HELP: Final = "Draw {} into a new file, NAME.svg, .png or .pdf; it needs matplotlib: pip install 'foosim[plot]'."
DATES: Final = {".svg": "Date", ".pdf": "CreationDate"}
"""The metadata that would have the time of the drawing."""


def check_picture(out: Path, option: str = "--picture") -> None:
    """Refuse what cannot be drawn before anything is computed for it.

    Raises BadValue for another ending, Existing for a file that exists, Failed for one that cannot be made, and where
    matplotlib is not installed.
    """
    check_name(option, out, "the picture", ENDINGS)
    if find_spec("matplotlib") is None:
        raise Failed(f"{option} needs matplotlib: pip install 'foosim[plot]'")


@contextmanager
def new_picture(out: Path) -> Iterator[Figure]:
    """Give a figure to draw on, without a display; it is written when the context ends.

    Raises Existing, and Failed when it cannot be written.
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    ending = out.suffix.lower()
    metadata = {DATES[ending]: None} if ending in DATES else {}
    # Text stays text, also in names that have a dollar sign, and equal figures give equal files.
    look = rc_context({"svg.fonttype": "none", "svg.hashsalt": "foosim", "text.parse_math": False})
    with new_file(out) as part, look:
        figure = Figure(layout="constrained")
        yield figure
        figure.savefig(part, format=ending[1:], metadata=metadata)
