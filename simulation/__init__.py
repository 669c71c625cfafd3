"""Everything in one process: worlds stepped, rehearsed, learned from; captures simulated again and played."""
