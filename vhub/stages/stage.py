"""What a stage is: one step of the pipeline on one link, with two hooks of which it may leave out either.

Neighbours: the table of all stages (`stages`), `links` (calls the hooks that there are).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

from foosim.vhub.packet import Flight


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


def sending_hooks(stages: Iterable[Stage]) -> list[Callable[[Flight], str]]:
    """Return the hooks at sending of stages that have one of their own, in their order."""
    return [stage.at_sending for stage in stages if type(stage).at_sending is not Stage.at_sending]


def arrival_hooks(stages: Iterable[Stage]) -> list[Callable[[Flight, str], str]]:
    """Return the hooks at arrival of stages that have one of their own, in their order."""
    return [stage.at_arrival for stage in stages if type(stage).at_arrival is not Stage.at_arrival]
