"""The joints that a setting of a component selects, by their names or by patterns of these."""

from __future__ import annotations

from collections.abc import Sequence
from fnmatch import fnmatchcase
from functools import partial
from typing import Annotated, Final

from pydantic import BeforeValidator

from foosim.common.names import nearest_quoted
from foosim.common.spec_base import PartName
from foosim.world.component_types.descriptions import JOINTS_MAX, JOINTS_READ_MAX
from foosim.world.components.view import IncompatibleComponent
from foosim.world.scene import Body

WILDCARDS: Final = frozenset("*?[")


def _listed(written: object) -> object:
    return [written] if isinstance(written, str) else written


JointNames = Annotated[list[PartName], BeforeValidator(_listed, json_schema_input_type=PartName | list[PartName])]
"""Names of joints, or patterns of these with *, ? and [...], in a list, or one of them."""


def joint_indices(
    body: Body, named: Sequence[str] | None, setting: str = "joints", *, has_motors: bool
) -> tuple[int, ...]:
    """Return the numbers of the joints of a body that the setting of a component selects, in the order of the setting.

    A name selects its joint, a pattern all further joints that it matches, in their order; a name that is a pattern,
    too, is a name. None and nothing select all. With `has_motors` only joints with a motor of their own are selected: a
    pattern passes over joints that follow others. Raises IncompatibleComponent.
    """
    names = body.joint_names
    own = [number for number, link in enumerate(body.joints) if not (has_motors and link.mimic)]
    found: dict[int, None] = {} if named else dict.fromkeys(own)
    for place, text in enumerate(named or ()):
        is_name = text in names or WILDCARDS.isdisjoint(text)
        matches = text.__eq__ if is_name else partial(fnmatchcase, pat=text)
        selected = [number for number, name in enumerate(names) if matches(name)]
        if not selected:
            what = (
                f"{body.name} has no {'such joint' if is_name else 'joint that matches'}; there are {', '.join(names)}"
            )
            raise IncompatibleComponent((setting, place), what, text, nearest_quoted(text, names))
        if is_name and selected[0] in found:
            raise IncompatibleComponent((setting, place), "named twice", text)
        driven = [number for number in selected if number in own]
        if not driven:
            raise IncompatibleComponent((setting, place), _following(body, selected[0]), text)
        found |= dict.fromkeys(driven)
    most = JOINTS_MAX if has_motors else JOINTS_READ_MAX
    if len(found) > most:
        raise IncompatibleComponent((setting,), f"more than {most} joints of {body.name}", len(found))
    return tuple(found)


def _following(body: Body, joint: int) -> str:
    """Return in words why a joint has no motor of its own."""
    mimic = body.joints[joint].mimic
    assert mimic is not None, body.name
    leader = body.links[mimic.leader].joint_name or body.link_names[mimic.leader]
    return f"joint {body.joint_names[joint]} of {body.name} follows joint {leader}: it has no motor of its own"
