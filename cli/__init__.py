"""The commands: one file each. Here is the entry of `foosim-supervisor`, which notes signals before it imports more."""

import sys

from foosim.runtime.early_signals import note_signals


def foosim_supervisor() -> None:
    """Entry of `foosim-supervisor`: from here on `up` leaves its result, whatever signal ends it."""
    if sys.argv[1:2] == ["up"]:
        note_signals()
    from foosim.cli.supervisor import main

    main()
