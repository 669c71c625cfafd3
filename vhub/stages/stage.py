"""What a stage is: one step of the pipeline on one link, with two hooks of which it may leave out either."""

from __future__ import annotations

from collections.abc import Iterable

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


def at_sending(stages: Iterable[Stage]) -> list[Stage]:
    """Return the stages that have a hook of their own at sending, in their order."""
    return [stage for stage in stages if type(stage).at_sending is not Stage.at_sending]


def at_arrival(stages: Iterable[Stage]) -> list[Stage]:
    """Return the stages that have a hook of their own at arrival, in their order."""
    return [stage for stage in stages if type(stage).at_arrival is not Stage.at_arrival]
