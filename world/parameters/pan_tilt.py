"""Two joints that turn a camera or a head: one to the sides, and one that hangs on it up and down."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated

from foosim.common import units
from foosim.common.spec_base import default
from foosim.common.units import Quantity
from foosim.world.components.mounted import body_at
from foosim.world.components.view import IncompatibleComponent, Mounting
from foosim.world.forms.forms import Carrier
from foosim.world.moving.progress import SLOTS, Patience
from foosim.world.parameters.joints import JointGroup, JointLoopSettings, loop_points
from foosim.world.scene import Body

Tolerance = Annotated[float, Quantity(units.ANGLE, "0.001 deg", "90 deg")]


class PanTiltSettings(JointLoopSettings):
    """Turns two of `joints`, pan and tilt, which hangs on it, to angles.

    A job is done when each is within `tolerance` of its angle. It has failed when they come no nearer for `patience`.
    """

    tolerance: Tolerance = default("1 deg")
    patience_ns: Patience = default("2 s", "patience")


def pan_tilt_slots(settings: PanTiltSettings, carrier: Carrier) -> Mapping[str, int]:
    """Return the slots of their drives. Raises BadValue."""
    return {**loop_points(settings, carrier), **SLOTS}


def pan_tilt_of(settings: PanTiltSettings, at: Mounting) -> JointGroup:
    """Return the two joints. Raises IncompatibleComponent for others."""
    group, body = JointGroup(settings, at), body_at(at)
    path = "kind" if settings.joints is None else "joints"
    names = [link.name.removeprefix(f"{body.name}/") for link in group.links]
    if [link.joint in ("revolute", "continuous") for link in group.links] != [True, True]:
        raise IncompatibleComponent((path,), "two joints that turn are valid, pan and tilt", names)
    pan, tilt = (body.links.index(link) for link in group.links)
    if not hangs_on(body, tilt, pan):
        raise IncompatibleComponent((path,), "the second joint must be on the first: pan, then tilt", names)
    return group


def hangs_on(body: Body, link: int, other: int) -> bool:
    """Whether a link is another one, or hangs on it."""
    while link > other:  # a parent's index is below its child's
        link = body.links[link].parent
    return link == other
