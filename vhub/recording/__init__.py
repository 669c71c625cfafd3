"""Records closings in a capture."""
