"""Rules of worlds: events before a tick is solved, one file each."""
