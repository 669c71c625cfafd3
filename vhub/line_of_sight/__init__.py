"""Obstacles between two antennas."""
