"""Modifiers of readings and commands: one file each, with settings and registration (`world.forms.registry`)."""
