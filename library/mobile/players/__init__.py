"""Players of rovers and other mobile robots."""
