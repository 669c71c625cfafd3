"""Rays and places against the shapes of a world: one geometry for sensors, motions and lines of sight."""
