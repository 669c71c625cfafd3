"""Plays a capture to its listeners, at its pace or another one."""
