"""How a rehearsal fails, for a fault of ours.

They are apart from who raises them, since a compiled module has no classes of assertions.
"""

from __future__ import annotations


class Broken(AssertionError):
    """A law does not hold."""


class Stuck(AssertionError):
    """No commit for too long on the virtual clock."""
