"""The foreman of a workshop: a porter carries crates to a crane, which hands them over to another one; then all back.

The foreman has a list of steps, each of one aim or several, and takes the next step when all are reached by the samples
that it hears. Grippers get jobs, joints and wheels get set-points at each turn: lost commands are repeated. A
crate that was put elsewhere it tries to take again and again.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import atan2, cos, hypot, sin
from typing import Any, Final

from foosim.client.errors import JobError
from foosim.client.jobs import Job, Jobs
from foosim.client.player import Player, Samples
from foosim.common.errors import BadValue, UnknownName
from foosim.deployment.schema import Deployment
from foosim.library.generic.pose_3d import Pose3d
from foosim.library.mobile.players.steering import wrapped
from foosim.library.rigid.box import BoxObject
from foosim.library.rigid.joint_state import JointState
from foosim.library.rigid.urdf import UrdfRobot

Aim = tuple[str, str, tuple[float, ...]]
"""A robot, its actuator, and what that is to reach: `wheels` a bearing (rad) and a distance (m) from the hub, which is
where the porter starts; `joints` and `lift` the positions of their joints (m); `gripper` 1 for closed, 0 for open."""
Step = tuple[Aim, ...]

FORK_M: Final = 0.32
"""From the middle of the porter to the front of its fork."""
HAND_M: Final = 0.23
"""From the column of a crane to the front of its hand, at a boom of 0."""
PUSH_M: Final = 0.01
"""It pushes a crate by this before it takes it: so the crate is at its front, and errors do not add up."""
LIFT_M: Final = 0.1
HIGH_M: Final = 0.4
"""How high the porter and the cranes carry."""
BACK_M: Final = 0.15
"""How far a hand goes back from a crate."""
FIRST_M: Final = 1.2
"""From the eastern crane to the first crate of its row,"""
ROW_M: Final = 0.27
"""from each to the next one, which is nearer."""
THERE_M: Final = 0.005
THERE_RAD: Final = 0.03
AGAIN_S: Final = 1.0
"""A job that has failed is given again after this time."""
SPEED: Final = 0.4
"""m/s, at most, of the porter; it reaches it by `GAIN_OF_SPEED` in each turn."""
GAIN_OF_SPEED: Final = 0.05
APPROACH: Final = 2.0
"""m/s for each m that is left."""
TURNING: Final = 0.4
"""m/s, at most, of the rims on the right more than the middle: its wheels are not steered, and slip when it turns."""
TURN_GAIN: Final = 0.8
"""m/s for each rad."""
TO_LINE: Final = 2.0
"""rad of heading for each m beside its line."""
AHEAD_RAD: Final = 0.2
"""It only turns while its line is not ahead by this."""
WHEEL_M: Final = 0.08


class Foreman(Player):
    """The player. Its parameters are its `name`, the `porter`, the two `cranes`, first the one that the porter serves,
    and the `crates`, each where the porter can take it from its hub."""

    def __init__(self, deployment: Deployment, parameters: Mapping[str, Any]) -> None:
        plan = Plan(deployment, parameters)
        self.steps: Final = tuple(plan.steps())
        self.at = 0
        """The number of the present step."""
        self._hub, self._porter = plan.hub, plan.porter
        self._tick_s = deployment.tick_ns / 1e9
        self._jobs = {name: Jobs(deployment, parameters["name"], name, "gripper") for name in plan.robots}
        self._running: dict[str, Job] = {}
        """The jobs of the present step, by robot."""
        self._again_s = 0.0
        self._set_points: dict[tuple[str, str], tuple[float, ...]] = {}
        """The set-points of joints and wheels, by the last step with one."""
        self._speed = 0.0

    def act(self, tick: int, samples: Samples) -> dict[str, dict[str, Any]]:
        """Return the commands of a turn."""
        now_s = tick * self._tick_s
        for jobs in self._jobs.values():
            jobs.hear(samples)
        if all(self._is_reached(*aim, samples, now_s) for aim in self.steps[self.at]):
            self.at = (self.at + 1) % len(self.steps)
            self._running = {}
        for robot, actuator, numbers in self.steps[self.at]:
            if actuator != "gripper":
                self._set_points[robot, actuator] = numbers
            elif robot not in self._running and now_s >= self._again_s:
                self._running[robot] = self._jobs[robot].call(*numbers)
        commands: dict[str, dict[str, Any]] = {}
        for robot, jobs in self._jobs.items():
            job = jobs.due(tick)
            commands[robot] = {} if job is None else {"gripper": job}
        for (robot, actuator), numbers in self._set_points.items():
            commands[robot][actuator] = self._wheels(numbers, samples) if actuator == "wheels" else numbers
        return {robot: its for robot, its in commands.items() if its}

    def _is_reached(
        self, robot: str, actuator: str, numbers: tuple[float, ...], samples: Samples, now_s: float
    ) -> bool:
        if actuator == "gripper":
            return robot in self._running and self._is_done(robot, now_s)
        if actuator == "wheels":
            place = self._place(numbers, samples)
            return place is not None and abs(place[0]) < THERE_M and abs(place[2]) < THERE_RAD
        sample = samples.get((robot, "state"))
        return (
            sample is not None
            and isinstance(sample.value, JointState)
            and all(abs(to - at) < THERE_M for to, at in zip(numbers, sample.value.positions, strict=True))
        )

    def _is_done(self, robot: str, now_s: float) -> bool:
        """Return whether the job of a gripper is done; one that ended otherwise is given again after a while."""
        try:
            return self._running[robot].check()
        except JobError as error:
            print(f"{now_s:.2f} s: {error}")
            del self._running[robot]
            self._again_s = now_s + AGAIN_S
            return False

    def _place(self, numbers: tuple[float, ...], samples: Samples) -> tuple[float, float, float] | None:
        """Return which way is left along the line of an aim, how far the porter is to the left of that (m), and how far
        its heading (rad); None as long as it was not heard."""
        sample = samples.get((self._porter, "pose"))
        if sample is None or not isinstance(sample.value, Pose3d):
            return None
        its, (bearing, distance) = sample.value, numbers
        x, y = its.x - self._hub[0], its.y - self._hub[1]
        heading = atan2(2.0 * (its.qw * its.qz + its.qx * its.qy), 1.0 - 2.0 * (its.qy * its.qy + its.qz * its.qz))
        left_m = distance - x * cos(bearing) - y * sin(bearing)
        return left_m, y * cos(bearing) - x * sin(bearing), wrapped(heading - bearing)

    def _wheels(self, numbers: tuple[float, ...], samples: Samples) -> tuple[float, ...]:
        """Return the speeds of the wheels (rad/s): forward or backward along a line, once it is ahead."""
        place = self._place(numbers, samples)
        if place is None:
            return (0.0,) * 4
        left_m, aside_m, turned = place
        wanted = max(-SPEED, min(SPEED, APPROACH * left_m)) if abs(turned) < AHEAD_RAD else 0.0
        self._speed += max(-GAIN_OF_SPEED, min(GAIN_OF_SPEED, wanted - self._speed))
        turned += TO_LINE * aside_m * (self._speed / SPEED)
        aside = max(-TURNING, min(TURNING, TURN_GAIN * -turned))
        return ((self._speed - aside) / WHEEL_M, (self._speed + aside) / WHEEL_M) * 2


class Plan:
    """The way of all crates from where they are at the start to the farther crane, and back."""

    def __init__(self, deployment: Deployment, parameters: Mapping[str, Any]) -> None:
        """Raises BadValue, UnknownName."""
        if set(parameters) != {"name", "porter", "cranes", "crates"} or len(parameters["cranes"]) != 2:
            raise BadValue("the parameters are name, porter, two cranes, and crates", sorted(parameters))
        arms = {name: its for name, its in deployment.robots.items() if isinstance(its, UrdfRobot)}
        boxes = {name: its for name, its in deployment.objects.items() if isinstance(its, BoxObject)}
        self.porter: Final[str] = parameters["porter"]
        self.cranes: Final[tuple[str, str]] = tuple(parameters["cranes"])
        self.robots: Final = (self.porter, *self.cranes)
        named: list[tuple[str, Mapping[str, Any]]] = [(name, arms) for name in self.robots]
        for name, known in (*named, *((name, boxes) for name in parameters["crates"])):
            if name not in known:
                raise UnknownName("a parameter names an unfit porter, crane or crate", name, known)
        porter, west, east = (arms[name].at for name in self.robots)
        self.hub: Final = porter.x, porter.y
        crates = [boxes[name] for name in parameters["crates"]]
        self._half_m = crates[0].size[0] / 2.0
        self._stock = [self._from_hub(one.at.x, one.at.y) for one in crates]
        self._served = self._from_hub(porter.x, west.y)
        """Where the porter brings crates."""
        self._near_m, self._middle_m = porter.x - west.x, (east.x - west.x) / 2.0
        """How far that is from the crane, and how far the middle between both cranes."""

    def _from_hub(self, x: float, y: float) -> tuple[float, float]:
        """Return bearing and distance of a place."""
        x, y = x - self.hub[0], y - self.hub[1]
        return atan2(y, x), hypot(x, y)

    def steps(self) -> Iterator[Step]:
        """Yield the steps of a whole round."""
        west, east = self.cranes
        yield tuple((name, "gripper", (0.0,)) for name in self.robots)
        yield tuple((name, "joints", (HIGH_M, 0.0)) for name in self.cranes)
        rows = [FIRST_M - ROW_M * number for number in range(len(self._stock))]
        for stock, row_m in zip(self._stock, rows, strict=True):
            yield from self._carried(stock, self._served)
            yield from self._handed(west, east, self._near_m, row_m)
        for stock, row_m in reversed([*zip(self._stock, rows, strict=True)]):
            yield from self._handed(east, west, row_m, self._near_m)
            yield from self._carried(self._served, stock)

    def _carried(self, start: tuple[float, float], end: tuple[float, float]) -> Iterator[Step]:
        """The porter takes a crate from one place, by bearing and distance from the hub, to another."""

        def wheels(*numbers: float) -> Step:
            return ((self.porter, "wheels", numbers),)

        def its(actuator: str, number: float) -> Step:
            return ((self.porter, actuator, (number,)),)

        front_m = FORK_M + self._half_m
        yield wheels(start[0], 0.0)
        yield wheels(start[0], start[1] - front_m + PUSH_M)
        yield from (its("gripper", 1.0), its("lift", LIFT_M))
        yield wheels(start[0], 0.0)
        yield wheels(end[0], 0.0)
        yield wheels(end[0], end[1] - front_m)
        yield from (its("lift", 0.0), its("gripper", 0.0))
        yield wheels(end[0], 0.0)

    def _handed(self, giver: str, taker: str, start_m: float, end_m: float) -> Iterator[Step]:
        """A crane takes a crate that is so far from its column; the other one takes it, and puts it down."""

        def joints(name: str, height_m: float, way_m: float) -> Aim:
            return name, "joints", (height_m, way_m - self._half_m - HAND_M)

        high = [joints(name, HIGH_M, self._middle_m) for name in (giver, taker)]
        yield (joints(giver, HIGH_M, start_m - BACK_M),)
        yield (joints(giver, 0.0, start_m - BACK_M),)
        yield (joints(giver, 0.0, start_m + PUSH_M),)
        yield ((giver, "gripper", (1.0,)),)
        yield (joints(giver, HIGH_M, start_m + PUSH_M),)
        yield (high[0], joints(taker, HIGH_M, self._middle_m - BACK_M))
        yield (high[1],)
        yield ((taker, "gripper", (1.0,)),)
        yield ((giver, "gripper", (0.0,)),)
        yield (joints(giver, HIGH_M, self._middle_m - BACK_M),)
        yield (joints(taker, HIGH_M, end_m), joints(giver, HIGH_M, self._near_m - BACK_M))
        yield (joints(taker, 0.0, end_m),)
        yield ((taker, "gripper", (0.0,)),)
        yield (joints(taker, 0.0, end_m - BACK_M),)
        yield (joints(taker, HIGH_M, end_m - BACK_M),)
