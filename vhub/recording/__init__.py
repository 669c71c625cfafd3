"""How closings become a capture."""
