"""Several components of a class computed together, of which some rows can be taken."""

from __future__ import annotations

from copy import copy
from typing import TYPE_CHECKING, Self

if TYPE_CHECKING:  # only processes that compute ticks import numpy
    import numpy as np
    from numpy.typing import NDArray


class Rows:
    """Several components computed together, whose arrays all have a row for each of them first."""

    def taken(self, rows: NDArray[np.intp]) -> Self:
        """Return that of some of the components, by their rows."""
        import numpy as np

        found = copy(self)
        for name, its in vars(self).items():
            if isinstance(its, np.ndarray):
                setattr(found, name, its[rows])
            elif hasattr(its, "taken"):
                setattr(found, name, its.taken(rows))
        return found
