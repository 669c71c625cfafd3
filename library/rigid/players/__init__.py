"""Players of arms and cranes."""
