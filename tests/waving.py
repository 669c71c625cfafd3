"""A player whose commands follow from the tick alone, and what a test does to send the same ones."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from foosim.client.player import Commands, Player, Samples
from foosim.deployment.schema import Deployment
from foosim.library.table.rod_position import Command

PERIOD: Final = 5
"""Ticks: 100 Hz of the table's."""
PLAYERS: Final = (
    "players={waver: {class: 'tests.waving:Waver', rate: 100 Hz, "
    "robots: {red.goal: [encoder], red.midfield: [encoder], blue.goal: [], camera: [ball]}}}"
)
"""The table with nobody but this player."""
PERFECT: Final = "network={links: []}"


def waved(tick: int) -> dict[str, Command]:
    """Return the commands of a tick."""
    step = tick // PERIOD
    slide, spin = (step % 7 - 3) * 0.02, (step % 11 - 5) * 0.4
    return {"blue.goal": Command(-slide, spin), "red.goal": Command(slide, -spin), "red.midfield": Command(slide, spin)}


class Waver(Player):
    """Commands three rods at each of its turns."""

    def __init__(self, deployment: Deployment, parameters: Mapping[str, Any]) -> None:
        """It takes no parameters."""

    def act(self, tick: int, samples: Samples) -> Commands:
        """Return the commands of the tick."""
        return waved(tick)
