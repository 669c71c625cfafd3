"""The command `foosim`: its verbs, one file each. Here is its entry, which notes signals before it imports more."""

import sys

from foosim.runtime.early_signals import note_signals


def main() -> None:
    """Entry of `foosim` and `foosim-supervisor`, one command: from here on a signal lets `up` leave its result."""
    if sys.argv[1:2] == ["up"]:
        note_signals()
    from foosim.cli import verbs

    verbs.main()
