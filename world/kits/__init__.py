"""Sections of a deployment that make a world from few numbers: table and hall."""
