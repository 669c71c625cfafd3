"""Sensors: one file each, which has its settings, its reading, and its registration (`world.forms.registry`)."""
