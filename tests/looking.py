"""A player that looks at each picture that it receives."""

from __future__ import annotations

from hashlib import sha256
from typing import Final

from foosim.client.player import Commands, Samples
from tests.waving import PLAYERS, Waver

LOOKERS: Final = PLAYERS.replace("tests.waving:Waver", "tests.looking:Looker").replace(
    "camera: [ball]", "camera: [eye]"
)
LOOKED: Final[dict[int, str]] = {}
"""The hash of the picture of each tick, as it was seen last."""


class Looker(Waver):
    """Waves, and looks."""

    def act(self, tick: int, samples: Samples) -> Commands:
        """Return the commands of the tick."""
        if ("camera", "eye") in samples:
            sight = samples["camera", "eye"].value
            LOOKED[int(sight.tick)] = sha256(sight.image().tobytes()).hexdigest()  # type: ignore[union-attr]
        return super().act(tick, samples)
