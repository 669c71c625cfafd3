"""Who plays a match: classes by their short names, and the two players of a deployment whose places they take."""

from __future__ import annotations

from typing import Any, Final, NamedTuple

from foosim.client.loading import class_faults
from foosim.common.errors import BadValue, UnknownName
from foosim.deployment.schema import Deployment
from foosim.players import OF_THE_TABLE
from foosim.world.assembly.initial_state import initial_frame
from foosim.world.assembly.world import world_status

IMPORT_S: Final = 60.0
"""How long the modules of the players may take to be imported."""
SCORE: Final = "score"
"""Where the status of a world has the points of each side."""
SIDE: Final = "team"
"""The parameter of a player that has its side."""


class Entrant(NamedTuple):
    """One of the two that play: as it was asked for, and its class."""

    label: str
    path: str


def entrant(place: str, name: str) -> Entrant:
    """Return the entrant of a short name, or of `module:Class`; `place` is the argument's name, for errors.

    Raises UnknownName, and BadValue for a class that cannot be loaded or is no player.
    """
    if name in OF_THE_TABLE:
        return Entrant(name, OF_THE_TABLE[name])
    if ":" not in name:
        raise UnknownName(f"{place}: no such player", name, OF_THE_TABLE, also="module:Class of your own")
    faults = class_faults([name], IMPORT_S)
    if name in faults:
        raise BadValue(f"{place}: {faults[name].problem}", name, faults[name].nearest)
    return Entrant(name, name)


def seats(deployment: Deployment, file: str) -> dict[str, str]:
    """Return the two sides of a world that keeps a score, and the deployment's player of each, in the score's order.

    Raises BadValue where there is no such score, a side has not one player, or one does not play in lockstep.
    """
    score: Any = world_status(deployment, initial_frame(deployment)).get(SCORE)
    if not isinstance(score, dict) or len(score) != 2:
        raise BadValue(f"{file}: a match needs a world with a rule that keeps the score of two sides")
    found: dict[str, str] = {}
    for side in score:
        names = [name for name, player in sorted(deployment.players.items()) if player.parameters.get(SIDE) == side]
        if len(names) != 1:
            told = ", ".join(names) or "none"
            raise BadValue(f"{file}: a match needs one player with the parameter `{SIDE}: {side}`; there are: {told}")
        if not deployment.players[names[0]].lockstep:
            raise BadValue(f"{file}: a match is played in lockstep, and players.{names[0]} is free-running")
        found[side] = names[0]
    return found
