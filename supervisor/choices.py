"""A name that somebody asks for, among those that there are."""

from __future__ import annotations

from collections.abc import Sequence

from foosim.common.errors import Refused, show
from foosim.common.names import nearest_name


def chosen(what: str, name: str, choices: Sequence[str]) -> str:
    """Return the name; raises Refused, with the choices, when it is none of them."""
    if name in choices:
        return name
    nearest = nearest_name(name, choices)
    hint = f", nearest is {nearest}" if nearest else ""
    raise Refused(f"no {what} {show(name)}; there are {', '.join(choices) or 'none'}{hint}")
