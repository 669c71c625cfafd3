"""What learns, and what it learns: rewards, exercises, and the player that acts by a learned policy."""
