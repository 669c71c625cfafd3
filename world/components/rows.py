"""What several components of a class are together, of which some can be taken."""

from __future__ import annotations

from copy import copy
from typing import TYPE_CHECKING, Self

if TYPE_CHECKING:  # only processes that compute ticks need numpy
    import numpy as np
    from numpy.typing import NDArray


class Rows:
    """What several components became, whose arrays all have a row for each of them first."""

    def taken(self, rows: NDArray[np.intp]) -> Self:
        """Return those of some of them, by their rows."""
        import numpy as np

        found = copy(self)
        for name, its in vars(self).items():
            if isinstance(its, np.ndarray):
                setattr(found, name, its[rows])
            elif hasattr(its, "taken"):
                setattr(found, name, its.taken(rows))
        return found
