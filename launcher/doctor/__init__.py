"""Examines whether a deployment can run, here and on its hosts."""
