"""The processes that a launcher starts: their start and end, their restarts, and signs that one hangs."""
