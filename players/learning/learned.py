"""A player that acts by a learned policy, in a run as in training: it sees packets, and commands robots by packets."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import msgspec

from foosim.client.player import Turn
from foosim.client.vectors import CommandVector, ReadingVector, chosen
from foosim.common.errors import BadValue, UnknownName
from foosim.deployment.schema import Deployment
from foosim.players.learning.policy import Policy, PolicyFile

if TYPE_CHECKING:
    from foosim.client.player import Samples

SHIPPED: Final = Path(__file__).with_name("defend_shot.json")
"""What `foosim-learn train` made: red's goalkeeper against one shot."""
WEIGHTS: Final = "weights"


def read_policy(path: Path) -> PolicyFile:
    """Return the policy in a file. Raises BadValue for one that cannot be read or is none."""
    try:
        return msgspec.json.decode(path.read_bytes(), type=PolicyFile)
    except OSError as error:
        raise BadValue(f"a policy that cannot be read: {error.strerror}", str(path)) from None
    except msgspec.DecodeError as error:
        raise BadValue(f"no policy: {error}", str(path)) from None


class Learned:
    """Acts by a policy. Parameter: `weights`, the policy's file, by default the one that comes with foosim.

    It commands the robots, and hears the sensors, that the policy names; the deployment lets it.
    """

    def __init__(self, deployment: Deployment, parameters: Mapping[str, Any]) -> None:
        """Raises UnknownName for a parameter that is none, BadValue for a policy that does not fit, with its file."""
        for key in parameters:
            if key != WEIGHTS:
                raise UnknownName("unknown parameter", key, [WEIGHTS])
        path = parameters.get(WEIGHTS, SHIPPED)
        if not isinstance(path, str | Path):
            raise BadValue(f"{WEIGHTS}: not the path of a file", path)
        file = read_policy(Path(path))
        self._tick_ns = deployment.tick_ns
        robots = sorted(deployment.robots)
        pairs = [(robot, channel) for robot in robots for channel in deployment.robots[robot].sensors]
        try:
            self._readings = ReadingVector(deployment, chosen(pairs, file.readings), ages=True)
            self._commands = CommandVector(deployment, robots, file.commands, file.bounds)
            self._policy = Policy(file, self._readings.columns, self._commands.columns)
        except BadValue as error:
            raise BadValue(f"{path}: {error.problem}", error.value, error.nearest) from None

    def act(self, tick: int, samples: Samples) -> Turn:
        """Return the commands of all its robots."""
        now_ns = tick * self._tick_ns
        vector = self._readings.of_samples(samples, now_ns)
        return Turn({}, self._commands.packets(self._policy.act(vector, now_ns * 1e-9)))
