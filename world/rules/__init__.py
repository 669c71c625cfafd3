"""Rules of worlds: what a world does by itself before a tick is solved, one file each."""
