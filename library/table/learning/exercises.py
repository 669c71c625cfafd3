"""Environments that come with foosim, by the ids that Gymnasium knows them by."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from foosim.library.table.learning.table_rewards import DefendShot, Goals

TABLE: Final = Path(__file__).with_name("table.yaml")
"""The football table, as in `deploy/table.yaml`."""
MATCH_S: Final = 60.0

PLAYER: Final = (
    "players={player-red: {class: 'foosim.library.table.players.football:Passive', parameters: {team: red}, "
    "rate: 100 Hz, robots: {camera: [ball], red.goal: []}}}"
)
"""Only red's goalkeeper plays."""
ALONE: Final = (
    "robots={red.goal: {model: rod, team: red, line: goal}, camera: {model: camera, sensors: {ball: {kind: ball, "
    "rate: 100 Hz, modifiers: [{kind: delay, time: 10 ms}, {kind: gaussian_noise, std: {x: 1.5 mm, y: 1.5 mm}}]}}}}",
    "nodes={red: {launch: local, robots: [red.goal, camera]}}",
    PLAYER,
)
"""There is no rod but his, and the table's camera: a tick costs less than half of that with eight rods."""

ENVIRONMENTS: Final[Mapping[str, Mapping[str, Any]]] = {
    "foosim/Table-v0": {"deployment": str(TABLE), "agent": "player-red", "reward": Goals, "seconds": MATCH_S},
    "foosim/DefendShot-v0": {
        "deployment": str(TABLE),
        "agent": "player-red",
        "reward": DefendShot,
        "sets": ALONE,
        "bounds": {"*.spin": (-1.0, 1.0)},
    },
}
"""Arguments of environments with one agent, by their ids."""
