"""Sensors of a football table, each in a file of its own."""
