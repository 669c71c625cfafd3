"""A team that writes down what it is given at each of its turns: for comparing a rehearsal with real processes."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from foosim.client.player import Commands, Samples
from foosim.deployment.schema import Deployment
from foosim.library.table.players.football import Team


class Scribe(Team):
    """Plays as `Team` does, and appends a line for each tick to the file `path`."""

    def __init__(self, deployment: Deployment, parameters: Mapping[str, Any]) -> None:
        super().__init__(deployment, {"team": parameters["team"]})
        self._path = Path(parameters["path"])

    def act(self, tick: int, samples: Samples) -> Commands:
        with self._path.open("a") as file:
            file.write(f"{tick} {sorted(samples.items())}\n")
        return super().act(tick, samples)
