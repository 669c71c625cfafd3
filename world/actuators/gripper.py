"""A gripper: it takes an object that is near a place on a link, and holds it as it is.

A grasp is a weld between the link and the object, of the engine. The frame has what is held and its pose in the frame
of the link at the grasp; so whoever solves the two next holds them by the same.
"""

from __future__ import annotations

from typing import Annotated, Final

from msgspec import Struct

from foosim.common import units
from foosim.common.spec_base import default
from foosim.common.units import Quantity
from foosim.world.components.entities import Motors
from foosim.world.components.grasping import distance_from, grasp_of, portables_of
from foosim.world.components.mounted import body_at, link_index
from foosim.world.components.view import Misfit, Mounting, View, WritableView
from foosim.world.forms import registry
from foosim.world.forms.forms import ENTITY, NO_ENTITY, Engine
from foosim.world.forms.quantities import Share
from foosim.world.forms.registry import actuator
from foosim.world.forms.settings import ActuatorSettings, Tag
from foosim.world.kinematics import forward_kinematics
from foosim.world.placing import FIRST_LINK, MountedAt
from foosim.world.scene import moved, rotate

Reach = Annotated[float, Quantity(units.LENGTH, "1 mm", "2 m")]
Opening = Annotated[float, Quantity(units.LENGTH, "1 mm", "10 m")]
Load = Annotated[float, Quantity(units.MASS, "1 g", "100000 kg")]
VALID: Final = "valid on robots that the engine solves, as urdf, quadrotor, differential_drive with dynamics: rigid"
HALF: Final = 0.5
"""A command from here on means closed."""


class GripperSettings(ActuatorSettings):
    """Holds an object. `at` is the grip: a place on a link of the robot.

    It takes an object whose surface is at most `reach` from the grip, whose least side is at most `opening`, and whose
    mass is at most `mass`; with a `tag`, one that has it.
    """

    at: MountedAt = FIRST_LINK
    reach: Reach = default("5 cm")
    opening: Opening = default("50 cm")
    mass: Load = default("10 kg")
    tag: Tag | None = None


class Grip(Struct, frozen=True):
    """Whether a gripper is to close: 1, or to open: 0."""

    closed: Share


@actuator("gripper", GripperSettings, Grip, slots={"held": ENTITY, "grasp": 7, "wanted": 1}, moves=False)
class Gripper:
    """Takes the nearest object in its reach when it is told to close, and lets it go when it is told to open."""

    def __init__(self, settings: GripperSettings, at: Mounting) -> None:
        self._settings = settings
        self._body, self._robot = body_at(at), at.robot
        self._link = link_index(self._body, settings.at.link)
        self._held, self._grasp, self._wanted = at.slot("held"), at.slot("grasp"), at.slot("wanted")
        self._quarantined = at.slot("quarantined")
        self._fitting = [
            one
            for one in portables_of(at.spec, at.layout)
            if one.across_m <= settings.opening
            and one.mass_kg <= settings.mass
            and (settings.tag is None or settings.tag in one.tags)
        ]

    @staticmethod
    def check(settings: GripperSettings, at: Mounting) -> None:
        """Raise Misfit for a link that is not there, an engine without grasps, a robot that it does not solve."""
        engines = [registry.find("engine", name) for name in registry.names("engine")]
        having = [one.name for one in engines if isinstance(one, Engine) and one.grasps]
        engine = registry.find("engine", at.spec.engine)
        if not (isinstance(engine, Engine) and engine.grasps):
            what = f"the engine {at.spec.engine} has no grasps: valid is {' or '.join(having)}"
            raise Misfit(("kind",), what, settings.kind)
        if not (at.robot.is_rigid and at.robot.kind.couples):
            what = f"{at.robot.name} is no rigid body, so that no load would move it: {VALID}"
            raise Misfit(("kind",), what, settings.kind)
        link_index(body_at(at), settings.at.link)

    def limits(self) -> dict[str, tuple[float, float]]:
        """Return the least and the greatest command."""
        return {"closed": (0.0, 1.0)}

    def accept(self, command: Grip, view: WritableView) -> bool:
        """Close or open. A robot in quarantine, which nobody solves, does neither."""
        if view.read(self._quarantined)[0] > 0.0:
            return False
        is_closed = command.closed >= HALF
        view.write(self._wanted, float(is_closed))
        if not is_closed:
            view.write(self._held, NO_ENTITY)
        elif view.read(self._held)[0] == NO_ENTITY:
            self._take(view)
        return True

    def _take(self, view: WritableView) -> None:
        """Take the nearest object, ties by name, as it is at the start of the tick."""
        start, settings = view.start, self._settings
        _, position, orientation = forward_kinematics(self._body, self._robot, start)[self._link]
        point = moved(position, rotate(orientation, settings.at.position), 1.0)
        found = []
        for one in self._fitting:
            if one.entity.is_absent(start) or start[one.entity.offsets["quarantined"]] > 0.0:
                continue
            way = distance_from(one, start, point, settings.reach)
            if way is not None:
                found.append((way, one.entity.name, one.entity))
        if found:
            _, _, entity = min(found)
            place, turned = grasp_of(entity, start, position, orientation)
            view.write(self._held, float(entity.index))
            view.write(self._grasp, *place, *turned)

    def hold(self, view: WritableView) -> None:
        """Leave all as it is: what is held is held without power, too."""

    def stir(self, view: WritableView) -> None:
        """Close, for the small run that tells engines apart."""
        self.accept(Grip(1.0), view)

    def command(self, view: View) -> Motors:
        """Return nothing: it commands no motor."""
        return ()
