"""Errors of a rehearsal that are faults of foosim.

They have a module of their own, since a compiled module cannot define subclasses of AssertionError.
"""

from __future__ import annotations


class Broken(AssertionError):
    """A law does not hold."""


class Stuck(AssertionError):
    """No commit for too long on the virtual clock."""
