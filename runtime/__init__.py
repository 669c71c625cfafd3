"""What every process has: loop, journal, signals, run folder, health; and its transport."""
