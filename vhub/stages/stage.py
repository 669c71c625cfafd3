"""What a stage is: one step of the pipeline on one link, with two hooks of which it may leave out either."""

from __future__ import annotations

from mypy_extensions import mypyc_attr

from foosim.vhub.network.packet import Flight
from foosim.vhub.stages.explanation import Explanation, Seen


@mypyc_attr(allow_interpreted_subclasses=True)
class Stage:
    """One step of the pipeline on one link."""

    def at_sending(self, flight: Flight) -> str:
        """Judge a packet that is sent; return the cause of its drop, or an empty string."""
        return ""

    def at_arrival(self, flight: Flight, hindered: str) -> str:
        """Judge a packet that arrives; return the cause of its drop, or an empty string.

        `hindered` is why its receiver does not take it; empty when it does.
        """
        return ""

    def explain(self, seen: Seen, note: Explanation) -> None:
        """Tell what the stage looked at in a captured packet; what its row does not have is computed again."""
