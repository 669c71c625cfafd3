"""The error of a rehearsal that is a fault of foosim.

It has a module of its own, since a compiled module cannot define subclasses of AssertionError.
"""

from __future__ import annotations


class Stuck(AssertionError):
    """No commit for too long on the virtual clock."""
