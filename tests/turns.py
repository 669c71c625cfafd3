"""The table's players with ticks of their own, for tests that count them: each 10 ms from tick 0 on, as the sensors.

Those of deploy/table.yaml act when the camera's picture comes, at ticks that the network's draws decide.
"""

from typing import Final

from tests.swarm.campaign import BY_PERIOD as KEYS

BY_PERIOD: Final = tuple(f"players.{name}.{key}" for name in ("player-red", "player-blue") for key in KEYS)
