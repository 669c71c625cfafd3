"""What comes with foosim to be learned: environments by their ids, and the exercise that a player is trained at."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final, NamedTuple

from foosim.players.learning.policy import PolicyFile
from foosim.players.learning.table_rewards import DefendShot, Goals

TABLE: Final = Path(__file__).with_name("table.yaml")
"""The football table, as in `deploy/table.yaml`."""
MATCH_S: Final = 60.0


class Exercise(NamedTuple):
    """What a policy is trained at: the file of a deployment and changes of it, who acts, how often, and for what.

    In the deployment as it is changed, the agent is a player of the class `Learned`, so that it can act by itself, too.
    `untrained` is the policy without weights.
    """

    file: Path
    sets: tuple[str, ...]
    agent: str
    robots: tuple[str, ...]
    rate_hz: float
    reward: type[DefendShot]
    untrained: PolicyFile


DEFEND: Final = Exercise(
    TABLE,
    (
        "players={player-red: {class: 'foosim.players.learning.learned:Learned', rate: 100 Hz, "
        "robots: {camera: [ball], red.goal: []}}}",
    ),
    "player-red",
    ("red.goal",),
    100.0,
    DefendShot,
    PolicyFile(
        readings=["camera/ball"],
        commands=["red.goal/position"],
        bounds={},
        columns={"camera/ball.x": (0.5, 5.0), "camera/ball.y": (0.1, 1.0)},
        moves=["red.goal/position.slide"],
        hidden=6,
    ),
)
"""One shot at red's goal: the goalkeeper sees the ball, and slides. There is nobody else."""

ENVIRONMENTS: Final[Mapping[str, Mapping[str, Any]]] = {
    "foosim/Table-v0": {"deployment": str(TABLE), "agent": "player-red", "reward": Goals, "seconds": MATCH_S},
    "foosim/DefendShot-v0": {
        "deployment": str(TABLE),
        "agent": DEFEND.agent,
        "reward": DefendShot,
        "sets": DEFEND.sets,
        "bounds": {"*.spin": (-1.0, 1.0)},
    },
}
"""Arguments of environments with one agent, by the ids that Gymnasium knows them by."""
