"""Modifiers of readings and commands: one file each, with its settings and its registration (`world.registry`)."""
