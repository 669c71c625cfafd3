"""Bugs planted in the cores, one rule switched off each: the swarm must find every one of them.

A thousand seeds without a finding prove something only if they find these. To add one: a function in `node`,
`supervisor` or `vhub` that swaps what has to be swapped, with the rule that it breaks and the seed that finds it. Bugs
that no early seed finds are in `direct`, each with the test that does.
"""

from __future__ import annotations

from typing import Final

from tests.gate import node, supervisor, vhub
from tests.gate.planting import Mutant

MUTANTS: Final[tuple[Mutant, ...]] = (*node.MUTANTS, *supervisor.MUTANTS, *vhub.MUTANTS)
