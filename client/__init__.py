"""Client library: the public API for controllers.

`connect` (in `client`) is for programs and people; `player` and `players` for controllers that `up` starts. What is
not used is not imported.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from foosim.client.client import Client, connect

__all__ = ["Client", "connect"]


def __getattr__(name: str) -> Any:
    """Import what a program asks for."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from foosim.client import client

    return getattr(client, name)
