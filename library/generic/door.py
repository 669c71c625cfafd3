"""A door: a box that slides between a closed and an open place to the share `open`, and stops at obstacles."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Final, Self

from pydantic import Field, model_validator

from foosim.common import units
from foosim.common.errors import BadValue
from foosim.common.exact_math import cos, sin
from foosim.common.spec_base import default
from foosim.common.units import Quantity, custom_error
from foosim.library.mobile.vehicles import HULL, Height, KinematicModel, Speed, UprightAt
from foosim.world.component_types.descriptions import BODY
from foosim.world.component_types.registry import model
from foosim.world.component_types.settings import EntitySettings
from foosim.world.components.base import Motion
from foosim.world.components.entities import MotionMounting, Motors
from foosim.world.components.view import Slot, WritableView
from foosim.world.layout import Entity
from foosim.world.matter.materials import WOOD, Radio
from foosim.world.moving.leaf import InTheWay, Leaf
from foosim.world.placing import ORIGIN_OF_WORLD
from foosim.world.scene import ORIGIN, Body, Box, Colour, Link, Shape, Vector

BROWN: Final[Colour] = (0.55, 0.38, 0.22, 1.0)
OPEN: Final = Quantity(units.PROBABILITY, "0 %", "100 %")
Side = Annotated[float, Quantity(units.LENGTH, "1 cm", "20 m")]
Travel = Annotated[float, Quantity(units.LENGTH, "-20 m", "20 m")]
LEAST_M: Final = 0.01


class DoorObject(EntitySettings):
    """A box with the middle of its underside at `closed`, which slides by `travel` along its length when it is opened.

    Where `travel` is negative it slides backwards, and up where it `lifts`. `open` is how far it is to be open, at the
    start how far it is. It stops at robots and objects in its way, not at scenery.
    """

    closed: UprightAt = ORIGIN_OF_WORLD
    length: Side = default("1 m")
    width: Side = default("5 cm")
    height: Height = default("2 m")
    travel: Travel = default("1 m")
    lifts: bool = False
    speed: Speed = default("0.5 m/s")
    open: Annotated[float, OPEN] = default("0 %")
    radio: Radio = Field(default_factory=lambda: WOOD)

    @model_validator(mode="after")
    def _slides(self) -> Self:
        if abs(self.travel) < LEAST_M:
            raise custom_error(BadValue(f"a door slides by at least {LEAST_M:g} m, forwards or backwards: travel"))
        return self

    @property
    def way(self) -> Vector:
        """The way from closed to open (m)."""
        if self.lifts:
            return 0.0, 0.0, self.travel
        return self.travel * cos(self.closed.yaw), self.travel * sin(self.closed.yaw), 0.0

    def place_at(self, share: float) -> Vector:
        """Return where it is when it is open by a share (m)."""
        x, y, z = self.closed.position
        dx, dy, dz = self.way
        return x + share * dx, y + share * dy, z + share * dz


STATE: Final = ("position", "linear_velocity", "opened", "blocked")
"""The fields that this motion writes."""


class Sliding(Motion):
    """The share `opened` comes nearer to `open` by speed x tick / travel, unless something is in the way."""

    def __init__(self, at: MotionMounting) -> None:
        self._tick_s = at.spec.tick_ns / 1e9
        self._in_the_way = InTheWay(at)
        self._slots = {its.index: [at.slot(its, field) for field in (*STATE, "open")] for its in at.entities}
        self._settings = at.settings(DoorObject)

    def move(self, entities: Sequence[Entity], motors: Sequence[Motors], view: WritableView) -> None:
        """Advance these doors by a tick; they have no motors."""
        for entity in entities:
            self._move(self._settings[entity.index], self._slots[entity.index], view)

    def _move(self, its: DoorObject, slots: Sequence[Slot], view: WritableView) -> None:
        here, velocity, (opened,), (was_blocked,), (target,) = map(view.read, slots)
        if opened == target and not (any(velocity) or was_blocked):
            return
        step = its.speed * self._tick_s / abs(its.travel)
        share = min(max(target, opened - step), opened + step)
        there = its.place_at(share)
        is_blocked = share != opened and self._in_the_way.stops(_leaf(its, here), _leaf(its, there), view.start)
        if is_blocked:
            share, there = opened, its.place_at(opened)
        speeds = [(new - old) / self._tick_s for new, old in zip(there, here, strict=True)]
        for slot, numbers in zip(slots, (there, speeds, (share,), (float(is_blocked),)), strict=False):
            view.write(slot, *numbers)


def _leaf(its: DoorObject, place: Sequence[float]) -> Leaf:
    x, y, z = place
    yaw = its.closed.yaw
    return Leaf(x, y, cos(yaw), sin(yaw), its.length / 2, its.width / 2, z, z + its.height)


@model(
    "door",
    DoorObject,
    slots={**BODY, "heading": 1, "open": 1, "opened": 1, "blocked": 1},
    is_robot=False,
    motion=Sliding,
    tags=("door",),
    units={"heading": ("rad",)},
    settable={"open": OPEN},
)
class Door(KinematicModel):
    """A door that slides between shut and open, to the share `open`.

    `open` is the share of its way by which it is to be open, `opened` by which it is, `blocked` that something is in
    its way.
    """

    is_upright = False
    """Others meet its shape, not a cylinder."""

    def body(self) -> Body:
        """Return the leaf, above its place."""
        its, name = self.settings, self.at.robot.name
        half = its.length / 2, its.width / 2, its.height / 2
        shape = Shape(Box(half), HULL, BROWN, (0.0, 0.0, its.height / 2), radio=its.radio)
        return Body(name, "door", ORIGIN, (Link(name, "free", (shape,), 0.0, ORIGIN),), speed_limit=its.speed)

    def place(self, view: WritableView) -> None:
        """Set it to where it is at the start."""
        its = self.settings
        self.set_down(view, its.place_at(its.open), its.closed.yaw)
        view.write(self.at.slot("open"), its.open)
        view.write(self.at.slot("opened"), its.open)
