"""Plays a capture again, verifies it, and judges it under another network."""
