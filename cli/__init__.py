"""The command `foosim`: its verbs, one file each. Here is its entry, which notes signals before it imports more."""

import gc
import sys

from foosim.runtime import GC_THRESHOLDS
from foosim.runtime.early_signals import note_signals


def main() -> None:
    """Entry of `foosim` and `foosim-supervisor`, one command: from here on a signal lets `up` leave its result."""
    if sys.argv[1:2] == ["up"]:
        note_signals()
    gc.set_threshold(*GC_THRESHOLDS)  # at Python's own, a tenth of a start is collections
    from foosim.cli import verbs

    verbs.main()
