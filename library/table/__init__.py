"""The football table."""
