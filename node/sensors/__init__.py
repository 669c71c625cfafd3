"""Sensors of robots, one file each: pure functions of frame, seed and names."""
