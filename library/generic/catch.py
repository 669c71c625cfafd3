"""A catch: when a hunter first comes up to its prey."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from foosim.common.spec_base import Length
from foosim.world.component_types.registry import rule
from foosim.world.component_types.settings import RuleSettings, Tag
from foosim.world.components.base import Rule, slot
from foosim.world.components.entities import RuleMounting
from foosim.world.components.surroundings import Surroundings
from foosim.world.components.view import View, WritableView


class CatchSettings(RuleSettings):
    """An entity with the tag `prey` is caught within `distance` of one with the tag `hunter`, by their first links."""

    prey: Tag
    hunter: Tag
    distance: Length


@rule("catch", CatchSettings)
class Catch(Rule):
    """Whether there was a catch (`caught`), and at the start of which tick (`caught_tick`); the first one counts."""

    caught, caught_tick = slot(), slot()

    def __init__(self, settings: CatchSettings, at: RuleMounting) -> None:
        self._name, self._tick_s, self._settings = at.name, at.spec.tick_ns / 1e9, settings
        self._around = Surroundings(at.spec, at.layout)
        self._prey = self._around.tagged(settings.prey)

    def apply(self, view: WritableView) -> None:
        """Look for a catch until there is one."""
        if view.numbers[self.caught.at] == 0.0 and any(self._is_caught(view)):
            view.write(self.caught, 1.0)
            view.write(self.caught_tick, float(view.tick))

    def _is_caught(self, view: View) -> Iterator[bool]:
        for prey in self._prey:
            place = None if prey.is_absent(view.numbers) else self._around.position(view, prey)
            if place is not None:
                near = self._around.near(view, place, self._settings.distance, self._settings.hunter)
                yield any(one is not prey and not one.is_absent(view.numbers) for one in near)

    def status(self, view: View) -> dict[str, Any]:
        """Return the time of the catch (s), None before it."""
        (caught,), (tick,) = view.read(self.caught), view.read(self.caught_tick)
        return {f"catch {self._name}": {"caught_s": round(tick * self._tick_s, 9) if caught else None}}

    @staticmethod
    def text(status: dict[str, Any]) -> str:
        """Return `mouse caught at 9.3 s` for each catch of a world that there was."""
        found = {key.partition(" ")[2]: its["caught_s"] for key, its in status.items() if key.startswith("catch ")}
        return ", ".join(f"{name} caught at {at_s:g} s" for name, at_s in found.items() if at_s is not None)
