"""Rovers on two wheels, moved by kinematics.

A wheel approaches the target speed with at most the drive's acceleration and rolls a little less far than it turns.
From the speeds l and r of the wheels on the ground, v = (l + r) / 2 and w = (r - l) / track, a rover goes along an arc:
in time t it turns by w t and moves by the arc's chord, v t sin(w t / 2) / (w t / 2), in the direction half-way between
(Siegwart, Nourbakhsh, Scaramuzza, *Introduction to Autonomous Mobile Robots*, section 3.2). It goes as far of that as
nothing is in the way, in halves, and turns on the spot where all is blocked, with its wheels slipping.

Rovers meet each other where they were at the tick's start: each stays on its own side of the line half-way between two
(a buffered Voronoi cell: Zhou, Wang, Bandyopadhyay, Schwager, IEEE RA-L 2(2), 2017), so that they never overlap and the
next state of each is a function of the frame alone, whoever computes which.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, floor, pi, sin, sqrt
from typing import Final

from foosim.common.keyed_random import draw_key, draw_words, unit_interval
from foosim.world.clearance.hall_obstacles import obstacles_of
from foosim.world.components.entities import MotionMounting, Motors
from foosim.world.components.view import Slot, SolvingView
from foosim.world.forms.registry import motion
from foosim.world.layout import Entity
from foosim.world.parameters.hall import hall_of
from foosim.world.rays.outlines import Outline
from foosim.world.spec import WorldSpec

HALVINGS: Final = 7
"""A way that is blocked is tried at 1, 1/2, 1/4, ... of its length, so often."""
SQUARE_REACH_M: Final = 0.71
"""From the middle of a square metre to its corners, and a little more."""
GAP_M: Final = 1e-6
"""Half of what stays between two rovers: far above rounding."""


STATE: Final = ("position", "orientation", "heading", "wheel_speeds", "wheel_travel", "blocked")
"""The fields that this motion writes."""
STANDING: Final[Motors] = ((0.0, 0.0), (0.0, 0.0))


class _Rover:
    """One rover that moves in this tick: its state, which each substep changes."""

    def __init__(self, slips: tuple[float, float]) -> None:
        self.slips: Final = slips
        self.x = self.y = self.heading = 0.0
        self.left = self.right = 0.0
        self.left_travel = self.right_travel = 0.0
        self.has_power = True
        self.blocked = False
        self.set_point: Motors = STANDING
        self.cell: list[tuple[float, float, float]] = []
        """Half-planes that it stays in: x and y of a unit vector, and the greatest x * position along it."""


@motion("two_wheels", needs=(*STATE, "charge"), writes=STATE, kit="hall")
class TwoWheels:
    """Along arcs, as far as nothing is in the way; without charge the wheels stop."""

    def __init__(self, at: MotionMounting) -> None:
        spec = at.spec
        hall = hall_of(spec)
        self._dt = spec.tick_ns / 1e9 / spec.substeps
        self._substeps = spec.substeps
        self._radius, self._track = hall.rover.radius, hall.rover.drive.track
        self._obstacles = obstacles_of(spec)
        self._places = [(entity.index, entity.offsets["position"]) for entity in at.entities]
        self._slots = {entity.index: [at.slot(entity, field) for field in STATE] for entity in at.entities}
        self._near_m = 2.0 * (hall.rover.radius + GAP_M + hall.rover.drive.speed * spec.tick_ns / 1e9)
        """Rovers that are farther apart cannot meet within the tick."""
        self._slips = {entity.index: wheel_slips(spec, entity.name) for entity in at.entities}
        self._squares: dict[tuple[int, int], tuple[Outline, ...]] = {}

    def move(self, entities: Sequence[Entity], motors: Sequence[Motors], view: SolvingView) -> None:
        """Advance these rovers by a tick; of each wheel the target speed (m/s) and greatest acceleration (m/s2)."""
        state = view.numbers
        places = [(index, state[at], state[at + 1]) for index, at in self._places]
        for entity, wheels in zip(entities, motors, strict=True):
            rover = self._loaded(entity, state, places)
            rover.set_point = wheels or STANDING
            for _ in range(self._substeps):
                self._advance(rover)
            _write(rover, self._slots[entity.index], view)

    def _loaded(self, entity: Entity, state: Sequence[float], places: Sequence[tuple[int, float, float]]) -> _Rover:
        """Return a rover's state at the start of the tick, and where it may go."""
        rover = _Rover(self._slips[entity.index])
        at, speeds, travel = (entity.offsets[name] for name in ("position", "wheel_speeds", "wheel_travel"))
        rover.x, rover.y, rover.heading = state[at], state[at + 1], state[entity.offsets["heading"]]
        rover.left, rover.right = state[speeds], state[speeds + 1]
        rover.left_travel, rover.right_travel = state[travel], state[travel + 1]
        rover.has_power = state[entity.offsets["charge"]] > 0.0
        rover.cell = self._cell(entity.index, rover.x, rover.y, places)
        return rover

    def _cell(
        self, own: int, x: float, y: float, places: Sequence[tuple[int, float, float]]
    ) -> list[tuple[float, float, float]]:
        """Return the half-planes that keep a rover on its side of the line half-way to each other one that is near."""
        near, room = self._near_m, self._radius + GAP_M
        cell = []
        for index, there_x, there_y in places:
            dx, dy = there_x - x, there_y - y
            if index == own or abs(dx) >= near or abs(dy) >= near:
                continue
            distance = sqrt(dx * dx + dy * dy)
            if 0.0 < distance < near:
                nx, ny = dx / distance, dy / distance
                cell.append((nx, ny, x * nx + y * ny + distance / 2.0 - room))
        return cell

    def _advance(self, rover: _Rover) -> None:
        """Go on by one substep."""
        dt = self._dt
        (left, left_rate), (right, right_rate) = rover.set_point
        if not rover.has_power:
            left = right = 0.0
        rover.left = _approach(rover.left, left, left_rate * dt)
        rover.right = _approach(rover.right, right, right_rate * dt)
        rover.left_travel += rover.left * dt
        rover.right_travel += rover.right * dt
        self._roll(rover, rover.left * (1.0 - rover.slips[0]), rover.right * (1.0 - rover.slips[1]))

    def _roll(self, rover: _Rover, left: float, right: float) -> None:
        """Move along the arc of these wheels' speeds on the ground, as far as nothing is in the way."""
        dt = self._dt
        half_turn = (right - left) / self._track * dt / 2.0
        chord = (left + right) / 2.0 * dt
        if half_turn != 0.0:
            chord *= sin(half_turn) / half_turn
        if chord != 0.0:
            direction = rover.heading + half_turn
            way_x, way_y = chord * cos(direction), chord * sin(direction)
            for _ in range(HALVINGS):
                x, y = rover.x + way_x, rover.y + way_y
                if self._is_free(rover, x, y):
                    rover.x, rover.y = x, y
                    break
                rover.blocked = True
                way_x, way_y = way_x / 2.0, way_y / 2.0
        heading = rover.heading + 2.0 * half_turn
        rover.heading = heading - 2.0 * pi if heading > pi else heading + 2.0 * pi if heading <= -pi else heading

    def _is_free(self, rover: _Rover, x: float, y: float) -> bool:
        """Whether a rover may be there; away from another one it may always go."""
        for nx, ny, most in rover.cell:
            if x * nx + y * ny > most and x * nx + y * ny > rover.x * nx + rover.y * ny:
                return False
        radius = self._radius
        return all(obstacle.is_clear(x, y, radius) for obstacle in self._around(x, y))

    def _around(self, x: float, y: float) -> tuple[Outline, ...]:
        """Return the obstacles that a rover in this square metre can touch: few of all, found once for each square."""
        square = floor(x), floor(y)
        found = self._squares.get(square)
        if found is None:
            reach = self._radius + SQUARE_REACH_M
            middle = square[0] + 0.5, square[1] + 0.5
            found = tuple(obstacle for obstacle in self._obstacles if not obstacle.is_clear(*middle, reach))
            self._squares[square] = found
        return found


def _write(rover: _Rover, slots: Sequence[Slot], view: SolvingView) -> None:
    position, orientation, heading, speeds, travel, blocked = slots
    view.write(position, rover.x, rover.y, 0.0)
    view.write(orientation, 0.0, 0.0, sin(0.5 * rover.heading), cos(0.5 * rover.heading))
    view.write(heading, rover.heading)
    view.write(speeds, rover.left, rover.right)
    view.write(travel, rover.left_travel, rover.right_travel)
    view.write(blocked, float(rover.blocked))


def wheel_slips(spec: WorldSpec, name: str) -> tuple[float, float]:
    """Return by which share the left and the right wheel of a rover roll less far than they turn: drawn by its name."""
    words = draw_words(draw_key(spec.seed, "slip", name), 0)
    slip = hall_of(spec).rover.drive.slip
    return slip * unit_interval(words[0]), slip * unit_interval(words[1])


def _approach(speed: float, set_point: float, step: float) -> float:
    """Return a speed that is nearer to the set-point, by at most `step`."""
    return min(max(set_point, speed - step), speed + step)
