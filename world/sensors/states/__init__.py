"""Sensors of what a robot knows of itself."""
