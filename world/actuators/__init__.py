"""Actuators: one file each, which has its settings, its command, and its registration (`world.forms.registry`)."""
