"""Several components of a class computed together, of which some rows can be taken."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from typing import TYPE_CHECKING, Any, ClassVar, Self

from foosim.world.components.base import Sensor
from foosim.world.components.view import Mounting, View

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


class SlotSensor(Sensor):
    """A sensor whose readings are numbers of the frame as they are: those of the fields that it needs, in order."""

    reading: ClassVar[Any]
    """What its readings are made by, from their numbers."""

    def __init__(self, settings: Any, at: Mounting) -> None:
        self.places: Sequence[int] = [place for name in self.declared for place in getattr(self, name).places]

    def sample(self, view: View) -> Any:
        return self.reading(*[view.numbers[place] for place in self.places])

    @staticmethod
    def together(sensors: Sequence[SlotSensor]) -> SlotReadings:
        """Return these as one; all have as many numbers."""
        return SlotReadings(sensors)


class SlotReadings(Rows):
    """The readings of several sensors that are numbers of the frame as they are: read as one array."""

    def __init__(self, sensors: Sequence[SlotSensor]) -> None:
        import numpy as np

        self._places = np.array([one.places for one in sensors])

    def sample(self, view: View) -> NDArray[np.float64]:
        """Return the numbers, of shape (sensors, numbers)."""
        numbers: NDArray[np.float64] = view.values[self._places]
        return numbers
