"""Bugs planted in the cores, one rule switched off each: the swarm must find every one of them.

That a thousand seeds find nothing proves something only if they find these. To add one: a function in `node`,
`supervisor`, `vhub` or `branch` that swaps what has to be swapped, with the rule that it breaks and the seed that finds
it.
"""

from __future__ import annotations

from typing import Final

from tests.gate import node, supervisor, vhub
from tests.gate.planting import Mutant

MUTANTS: Final[tuple[Mutant, ...]] = (*node.MUTANTS, *supervisor.MUTANTS, *vhub.MUTANTS)
