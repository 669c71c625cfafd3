"""A gripper: it takes an object that is near a place on a link, and holds it in its pose.

A grasp is a weld of the engine between the link and the object. The frame has the held object and its pose in the
frame of the link at the grasp; so each node that solves the two next has the same weld.
"""

from __future__ import annotations

from enum import IntEnum
from typing import ClassVar, Final

from msgspec import Struct

from foosim.world.component_types import registry
from foosim.world.component_types.descriptions import ENGINES, ENTITY, NO_ENTITY
from foosim.world.component_types.jobs import JobState
from foosim.world.component_types.quantities import JobNumber, Share
from foosim.world.component_types.registry import actuator
from foosim.world.components.base import Actuator, need, slot
from foosim.world.components.entities import Motors
from foosim.world.components.grasping import GripperSettings, Portable, distance_from, grasp_of, portables_of
from foosim.world.components.mounted import body_at, link_index
from foosim.world.components.view import IncompatibleComponent, Mounting, View, WritableView
from foosim.world.kinematics import forward_kinematics
from foosim.world.scene import moved, rotate

VALID: Final = "valid on robots that the engine solves, as urdf, quadrotor, differential_drive with dynamics: rigid"
HALF: Final = 0.5
"""A command from here on means closed."""


class GraspFailure(IntEnum):
    """Why a gripper took nothing at the last command to close."""

    NONE = 0
    OUT_OF_REACH = 1
    NO_TAG = 2
    TOO_WIDE = 3
    TOO_HEAVY = 4
    QUARANTINED = 5


class Grip(Struct, frozen=True):
    """Whether a gripper is to close: 1, or to open: 0."""

    closed: Share
    job: JobNumber = 0.0


@actuator("gripper", GripperSettings, Grip, moves=False, jobs=True)
class Gripper(Actuator):
    """Takes the nearest object in its reach at a command to close, and releases it at a command to open.

    A job to close is done when it holds something, and fails where it can take nothing; one to open is done at once.
    """

    held, grasp, closed, failure = slot(ENTITY), slot(7), slot(), slot()
    quarantined = need()
    FAILURES: ClassVar = {
        GraspFailure.OUT_OF_REACH: "there is no object within reach",
        GraspFailure.NO_TAG: "the nearest object does not have the tag of the gripper",
        GraspFailure.TOO_WIDE: "the nearest object is wider than the gripper opens",
        GraspFailure.TOO_HEAVY: "the nearest object is heavier than the gripper holds",
        GraspFailure.QUARANTINED: "the nearest object, or the robot, is in quarantine",
    }

    def __init__(self, settings: GripperSettings, at: Mounting) -> None:
        self._settings = settings
        self._body, self._robot = body_at(at), at.robot
        self._link = link_index(self._body, settings.at.link)
        self._objects = [(one, self._mismatch(one)) for one in portables_of(at.spec, at.layout)]
        """Each with the reason why it can never be taken."""

    def _mismatch(self, one: Portable) -> GraspFailure:
        settings = self._settings
        if settings.tag is not None and settings.tag not in one.tags:
            return GraspFailure.NO_TAG
        if one.across_m > settings.opening:
            return GraspFailure.TOO_WIDE
        return GraspFailure.TOO_HEAVY if one.mass_kg > settings.mass else GraspFailure.NONE

    @staticmethod
    def check(settings: GripperSettings, at: Mounting) -> None:
        """Raise IncompatibleComponent for an engine without grasps, and a robot that it does not solve."""
        having = [name for name in registry.engines() if ENGINES[name].grasps]
        if not at.spec.engine_type.grasps:
            what = f"the engine {at.spec.engine} has no grasps: valid is {' or '.join(having)}"
            raise IncompatibleComponent(("kind",), what, settings.kind)
        if not (at.robot.is_rigid and at.robot.kind.couples):
            what = f"{at.robot.name} is no rigid body, so that no load would move it: {VALID}"
            raise IncompatibleComponent(("kind",), what, settings.kind)

    def limits(self) -> dict[str, tuple[float, float]]:
        """Return the least and the greatest command."""
        return {"closed": (0.0, 1.0)}

    def accept(self, command: Grip, view: WritableView) -> bool:
        """Close or open. A robot in quarantine, which no node solves, does neither."""
        if view.read(self.quarantined)[0] > 0.0:
            view.write(self.failure, GraspFailure.QUARANTINED)
            return False
        is_closed = command.closed >= HALF
        failure = GraspFailure.NONE
        if not is_closed:
            view.write(self.held, NO_ENTITY)
        elif view.read(self.held)[0] == NO_ENTITY:
            failure = self._take(view)
        view.write(self.closed, float(is_closed))
        view.write(self.failure, failure)
        return True

    def progress(self, view: WritableView) -> JobState:
        """Return DONE if it holds something after a command to close, nothing after one to open; else FAILED."""
        is_holding = view.read(self.held)[0] != NO_ENTITY
        return JobState.DONE if is_holding == (view.read(self.closed)[0] == 1.0) else JobState.FAILED

    def _take(self, view: WritableView) -> GraspFailure:
        """Take the nearest object, ties by name, as it is at the start of the tick; else return why the nearest is not
        taken."""
        start, settings = view.start, self._settings
        _, position, orientation = forward_kinematics(self._body, self._robot, start)[self._link]
        point = moved(position, rotate(orientation, settings.at.position), 1.0)
        near = []
        for one, mismatch in self._objects:
            if one.entity.is_absent(start):
                continue
            way = distance_from(one, start, point, settings.reach)
            if way is not None:
                is_quarantined = start[one.entity.offsets["quarantined"]] > 0.0
                failure = mismatch or (GraspFailure.QUARANTINED if is_quarantined else GraspFailure.NONE)
                near.append((failure != GraspFailure.NONE, way, one.entity.name, failure, one.entity))
        if not near:
            return GraspFailure.OUT_OF_REACH
        _, _, _, failure, entity = min(near)
        if failure == GraspFailure.NONE:
            place, turned = grasp_of(entity, start, position, orientation)
            view.write(self.held, float(entity.index))
            view.write(self.grasp, *place, *turned)
        return failure

    def hold(self, view: WritableView) -> None:
        """Leave all as it is: a gripper holds without power, too."""

    def excite(self, view: WritableView) -> None:
        """Close, for the run that compares engines."""
        self.accept(Grip(1.0), view)

    def command(self, view: View) -> Motors:
        """Return nothing: it commands no motor."""
        return ()
