"""What comes with foosim to be learned: environments by their ids, and the exercise that a player is trained at."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from foosim.client.vectors import Vector
from foosim.players.learning.policy import PolicyFile
from foosim.players.learning.table_rewards import DefendShot, Goals

TABLE: Final = Path(__file__).with_name("table.yaml")
"""The football table, as in `deploy/table.yaml`."""
MATCH_S: Final = 60.0


class Exercise(NamedTuple):
    """What a policy is trained at: the file of a deployment and changes of it, who acts, how often, and for what.

    In the deployment as it is changed, the agent is a player of the class `Learned`, so that it can act by itself, too.
    `untrained` is the policy without weights. `by_hand` is what the learned one is compared with: a simple controller,
    from an observation to an action, and in words what it does.
    """

    file: Path
    sets: tuple[str, ...]
    agent: str
    robots: tuple[str, ...]
    rate_hz: float
    reward: type[DefendShot]
    untrained: PolicyFile
    by_hand: Callable[[Vector], Vector]
    by_hand_does: str


def follow_ball(ball: Vector) -> Vector:
    """Return the slide (m) of a keeper that is where the ball is seen, and its spin (rad)."""
    return np.array([ball[1], 0.0])


PLAYER: Final = (
    "players={player-red: {class: 'foosim.players.learning.learned:Learned', rate: 100 Hz, "
    "robots: {camera: [ball], red.goal: []}}}"
)
"""Nobody plays but red's goalkeeper."""
ALONE: Final = (
    "robots={red.goal: {model: rod, team: red, line: goal}, camera: {model: camera, sensors: {ball: {kind: ball, "
    "rate: 100 Hz, modifiers: [{kind: delay, time: 10 ms}, {kind: gaussian_noise, std: {x: 1.5 mm, y: 1.5 mm}}]}}}}",
    "nodes={red: {launch: local, robots: [red.goal, camera]}}",
    PLAYER,
)
"""There is no rod but his, and the table's camera: a tick costs less than half of that with eight rods."""

DEFEND: Final = Exercise(
    TABLE,
    ALONE,
    "player-red",
    ("red.goal",),
    100.0,
    DefendShot,
    PolicyFile(
        readings=["camera/ball"],
        commands=["red.goal/position"],
        bounds={},
        columns={"camera/ball.x": (1.0, 10.0), "camera/ball.y": (0.05, 1.0)},
        moves=["red.goal/position.slide"],
        hidden=4,
    ),
    follow_ball,
    "follows the ball",
)
"""One shot at red's goal: the goalkeeper sees the ball (x, y, z in m), and slides."""

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
