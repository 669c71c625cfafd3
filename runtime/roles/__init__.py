"""The roles of a process: each a core with its shell, on one loop, joined by an in-memory bus."""
