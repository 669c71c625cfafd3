"""The on-board software of a scout in a yard: it pushes crates along x, one after the other.

Of two scouts the first one has the places of crates at the start, and pushes each as far as the border; the second
one receives their new places by radio, and pushes them further. A scout goes behind a crate, looks at it with its laser
scanner, puts its bumper against it, and pushes it along a line. Pushed by a plate, a crate stays where it is on that
while the way bends little (stable pushing: Lynch, Mason, *Stable Pushing*, Int. J. Robotics Research 15(6), 1996).

It knows where it is from its wheels and noisy poses, and where the other one is by radio alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from math import atan2, cos, hypot, sin
from typing import Any, Final

from foosim.client.player import Packet, Player, Samples, Turn
from foosim.common.errors import BadValue, UnknownName
from foosim.deployment.schema import Deployment
from foosim.library.generic.laser_scanner import LaserScannerSettings, Scan, step_of
from foosim.library.generic.pose import Pose
from foosim.library.mobile.differential import BUMPER_HALF_M, DifferentialDriveRobot
from foosim.library.mobile.odometry import WheelTravel
from foosim.library.mobile.players.steering import Estimate, wrapped
from foosim.library.mobile.players.yard_reports import REPORT, Heard, Report, encode_report
from foosim.library.mobile.v_w import Motion
from foosim.library.rigid.box import BoxObject

STANDING: Final = Motion(0.0, 0.0)
BEHIND_M: Final = 0.85
"""From the middle of a crate back to where a scout looks at it."""
NEAR_M: Final = 0.06
"""So near to the place behind a crate it is reached, and so far from its middle a scout may push it."""
PASSED_M: Final = 0.15
"""So near to a waypoint before that it has been passed."""
AIM_RAD: Final = 0.03
"""So well a scout is turned before it looks or pushes."""
TURN_GAIN: Final = 2.5
"""rad/s of turning per rad of error."""
TURN_MAX: Final = 1.6
STEER_MAX: Final = 0.35
"""rad/s, of a scout that pushes: its crate would slip off the bumper in a narrower bend."""
TO_LINE: Final = 1.2
"""rad of heading per m beside the line,"""
TO_LINE_MAX: Final = 0.25
"""rad, at most."""
APPROACH: Final = 1.5
"""Greatest speed per way that is left, in 1/s."""
SPEED_MIN: Final = 0.05
GUARD_M: Final = 0.28
"""On its way to a crate it waits while something is nearer ahead of its scanner."""
GUARD_RAD: Final = 0.4
SEEN_M: Final = 0.45
"""Echoes within this of where a crate should be are of it."""
ECHOES_MIN: Final = 3
LOST_M: Final = 0.2
"""A crate that is pushed is no farther from the scanner; one that is has been lost,"""
LOST_TURNS: Final = 5
"""if that lasts for this count of turns."""
BACK_SPEED: Final = 0.35
REPORT_S: Final = 0.2


@dataclass(frozen=True, slots=True)
class Settings:
    """The parameters of a scout in the deployment. Lengths are in m, in the world frame."""

    scout: str
    partner: str
    goals: tuple[float, ...]
    """x of the middle of each crate at the end of its way, in the order of the crates."""
    crates: tuple[str, ...] = ()
    """The crates, by their names in the deployment, whose first places it has; empty: it receives them by radio."""
    detour: float = 0.0
    """It goes along the line at this y, on the side of the crate, to get behind it; 0: along the middle."""
    back: float = 0.5
    """How far it goes back from a crate that it has brought."""
    clear: float = -2.0
    """A crate of the other one's is taken when that is west of this x."""
    speed: float = 0.8
    push_speed: float = 0.5


def read_settings(parameters: Mapping[str, Any], deployment: Deployment) -> Settings:
    """Return a scout's parameters, checked; raises BadValue."""
    known = {field.name: field.type for field in fields(Settings)}
    for name, value in parameters.items():
        if name not in known:
            raise UnknownName("no parameter of a scout", name, known)
        if name in ("scout", "partner"):
            is_right, what = isinstance(value, str), "a text"
        elif name == "crates":
            is_right, what = _are(value, str), "a list of names"
        elif name == "goals":
            is_right, what = _are(value, int | float), "a list of numbers"
        else:
            is_right, what = isinstance(value, int | float) and not isinstance(value, bool), "a number"
        if not is_right:
            raise BadValue(f"parameter {name} is not {what}", value)
    given: dict[str, Any] = {"scout": "", "partner": "", "goals": (), "crates": (), **parameters}
    lists: dict[str, Any] = {name: tuple(given.pop(name)) for name in ("goals", "crates")}
    settings = Settings(**given, **lists)
    scouts = sorted(name for name, its in deployment.robots.items() if isinstance(its, DifferentialDriveRobot))
    for name in (settings.scout, settings.partner):
        if name not in scouts:
            raise UnknownName("parameter scout or partner is not a differential drive", name, scouts)
    boxes = sorted(name for name, its in deployment.objects.items() if isinstance(its, BoxObject))
    for name in settings.crates:
        if name not in boxes:
            raise UnknownName("parameter crates names other than a box", name, boxes)
    if settings.crates and len(settings.crates) != len(settings.goals):
        raise BadValue("parameter goals has a number for each crate", len(settings.goals))
    return settings


def _are(values: object, kind: Any) -> bool:
    return isinstance(values, list) and all(isinstance(one, kind) and not isinstance(one, bool) for one in values)


class Scout(Player):
    """The player: one scout's controller."""

    def __init__(self, deployment: Deployment, parameters: Mapping[str, Any]) -> None:
        self.settings = settings = read_settings(parameters, deployment)
        robots = sorted(deployment.robots)
        self.number, self._partner = robots.index(settings.scout), robots.index(settings.partner)
        self.heard = Heard()
        self.done: list[tuple[float, float]] = []
        """Where it has put crates (m), in its order."""
        self.phase = "wait"
        robot = deployment.robots[settings.scout]
        assert isinstance(robot, DifferentialDriveRobot)
        self._estimate = Estimate(robot.track)
        self._tick_s = deployment.tick_ns / 1e9
        scanner = robot.sensors.get("scan")
        if not isinstance(scanner, LaserScannerSettings):
            raise BadValue("a scout needs a laser scanner named scan", settings.scout)
        first, _ = scanner.bearings
        step = step_of(scanner.rays, scanner.angle)
        self._bearings = [first + ray * step for ray in range(scanner.rays)]
        self._range, self._scanner_ahead = scanner.range, scanner.at.x
        boxes = [its for _, its in sorted(deployment.objects.items()) if isinstance(its, BoxObject)]
        self._crate_half = boxes[0].size[0] / 2.0 if boxes else 0.2
        bumper = 0.0 if robot.bumper is None else 2.0 * BUMPER_HALF_M
        self._reach = robot.radius + bumper + self._crate_half
        """From its middle to that of a crate at its bumper (m)."""
        self._first_places = [deployment.objects[name].at for name in settings.crates]  # type: ignore[attr-defined]
        self._crate = (0.0, 0.0)
        self._way: list[tuple[float, float]] = []
        self._line = 0.0
        self._lost_turns = 0
        self._is_lost = False
        self._released_x = 0.0
        self._report_s = 0.0

    def act(self, tick: int, samples: Samples) -> Turn:
        """Drive, and report its place five times a second."""
        now_s, robot = tick * self._tick_s, self.settings.scout
        travel, pose = samples.get((robot, "odometry")), samples.get((robot, "pose"))
        if travel is not None and isinstance(travel.value, WheelTravel):
            self._estimate.roll(travel.value)
        if pose is not None and isinstance(pose.value, Pose):
            self._estimate.fix(pose.sequence, pose.value)
        self.heard.take(samples)
        if not self._estimate.is_known:
            return Turn({robot: STANDING})
        scan = samples.get((robot, "scan"))
        distances = scan.value.distances if scan is not None and isinstance(scan.value, Scan) else ()
        motion = self._next(distances)
        if now_s < self._report_s:
            return Turn({robot: motion})
        self._report_s = now_s + REPORT_S
        at = self._estimate
        report = Report(self.number, now_s, at.x, at.y, len(self.done), tuple(self.done))
        return Turn({robot: motion}, [Packet("", REPORT, encode_report(report))])

    def _next(self, distances: tuple[float, ...]) -> Motion:
        match self.phase:
            case "wait":
                return self._wait()
            case "go":
                return self._go(distances)
            case "look":
                return self._look(distances)
            case "push":
                return self._push(distances)
            case "back":
                return self._back()
        return STANDING

    # --- decisions ---------------------------------------------------------------------------------------------------

    def _wait(self) -> Motion:
        """Begin with the next crate, when it may."""
        number = len(self.done)
        if number == len(self.settings.goals):
            return STANDING
        partner = self.heard.reports.get(self._partner)
        if self._first_places:
            # One crate stands at the border at most while another comes.
            if number >= 2 and (partner is None or partner.done < number - 1):
                return STANDING
            self._crate = self._first_places[number].x, self._first_places[number].y
        else:
            if partner is None or len(partner.crates) <= number or partner.x > self.settings.clear:
                return STANDING
            self._crate = partner.crates[number]
        self._set_out()
        return STANDING

    def _set_out(self) -> None:
        """Go behind the crate: first aside, along the side of the yard, then to its line."""
        x, y = self._crate
        aside = self.settings.detour if y > 0.0 else -self.settings.detour
        at, behind = self._estimate, x - BEHIND_M
        if hypot(behind - at.x, y - at.y) < BEHIND_M:
            self._way = [(behind, y)]
        elif aside != 0.0:
            self._way = [(at.x, aside), (behind, aside), (behind, y)]
        else:
            self._way = [(behind, aside), (behind, y)]
        self.phase = "go"

    def _go(self, distances: tuple[float, ...]) -> Motion:
        at, goal = self._estimate, self._way[0]
        dx, dy = goal[0] - at.x, goal[1] - at.y
        way = hypot(dx, dy)
        if way < (NEAR_M if len(self._way) == 1 else PASSED_M):
            self._way.pop(0)
            if not self._way:
                self.phase = "look"
            return STANDING
        error = wrapped(atan2(dy, dx) - at.heading)
        turning = _within(TURN_GAIN * error, TURN_MAX)
        if abs(error) > 0.5:
            return Motion(0.0, turning)
        if self._ahead(distances) < min(GUARD_M, way):
            return Motion(0.0, 0.0)
        return Motion(min(self.settings.speed, max(APPROACH * way, SPEED_MIN)) * cos(error), turning)

    def _look(self, distances: tuple[float, ...]) -> Motion:
        """Turn along x, and look where the crate is."""
        error = wrapped(-self._estimate.heading)
        if abs(error) > AIM_RAD:
            return Motion(0.0, _within(TURN_GAIN * error, TURN_MAX))
        seen = self._seen(distances)
        if seen is None:
            return STANDING
        self._crate = seen
        if abs(seen[1] - self._estimate.y) > NEAR_M:
            self._way = [(seen[0] - BEHIND_M, seen[1])]
            self.phase = "go"
            return STANDING
        self._line, self._lost_turns = seen[1], 0
        self.phase = "push"
        return STANDING

    def _push(self, distances: tuple[float, ...]) -> Motion:
        """Follow the line until the crate is at its goal."""
        at, settings = self._estimate, self.settings
        left = settings.goals[len(self.done)] - (at.x + self._reach)
        is_there = at.x + self._reach > self._crate[0] + 0.1
        self._lost_turns = self._lost_turns + 1 if is_there and self._ahead(distances) > LOST_M else 0
        if left < 0.01 or self._lost_turns > LOST_TURNS:
            self._is_lost = left >= 0.01
            self._crate = at.x + self._reach, at.y
            if not self._is_lost:
                self.done.append(self._crate)
            self._released_x = at.x
            self.phase = "back"
            return STANDING
        heading = _within(TO_LINE * (self._line - at.y), TO_LINE_MAX)
        turning = _within(TURN_GAIN * wrapped(heading - at.heading), STEER_MAX)
        return Motion(min(settings.push_speed, max(APPROACH * left, SPEED_MIN)), turning)

    def _back(self) -> Motion:
        """Leave the crate, backwards."""
        way = BEHIND_M - self._reach + 0.3 if self._is_lost else self.settings.back
        if self._released_x - self._estimate.x < way:
            return Motion(-BACK_SPEED, _within(-TURN_GAIN * wrapped(self._estimate.heading), STEER_MAX))
        self.phase = "look" if self._is_lost else "wait"
        return STANDING

    # --- perception --------------------------------------------------------------------------------------------------

    def _ahead(self, distances: tuple[float, ...]) -> float:
        """Return the distance ahead of the scanner to the next thing (m)."""
        near = [way for way, bearing in zip(distances, self._bearings, strict=False) if abs(bearing) < GUARD_RAD]
        return min(near, default=self._range)

    def _seen(self, distances: tuple[float, ...]) -> tuple[float, float] | None:
        """Return where the middle of the crate is (m), by the echoes of its near face; None where none are of it."""
        at = self._estimate
        c, s = cos(at.heading), sin(at.heading)
        echoes = []
        for way, bearing in zip(distances, self._bearings, strict=False):
            ahead, left = self._scanner_ahead + way * cos(bearing), way * sin(bearing)
            x, y = at.x + ahead * c - left * s, at.y + ahead * s + left * c
            if way < self._range and hypot(x - self._crate[0], y - self._crate[1]) < SEEN_M:
                echoes.append((x, y))
        if len(echoes) < ECHOES_MIN:
            return None
        sides = [y for _, y in echoes]
        return min(x for x, _ in echoes) + self._crate_half, (min(sides) + max(sides)) / 2.0


def _within(value: float, most: float) -> float:
    return min(max(value, -most), most)
