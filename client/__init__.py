"""Client library: the public API for controllers.

`connect` (in `client`) is for programs and people; `player` and `players` for controllers that `up` starts.
"""

from foosim.client.client import Client, connect

__all__ = ["Client", "connect"]
