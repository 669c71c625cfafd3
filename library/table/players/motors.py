"""A rod's motors as its player foresees them: a reading is old, and later commands move the rod meanwhile.

The loop is that of the actuator `rod_position`: once a tick, target speed = gain x error, within +-speed; the motor
reaches it with at most its acceleration without a load. What else moves a rod, the next reading shows.
"""

from __future__ import annotations

from collections import deque
from math import copysign
from typing import NamedTuple

from foosim.library.table.rod_drives import SLIDE, SPIN, RodLimits
from foosim.library.table.settings import Drive


class Motion(NamedTuple):
    """Where a motor is (m or rad), and its speed (m/s or rad/s)."""

    at: float
    speed: float


class Motor:
    """One motor: its loop and its limits, in SI units."""

    def __init__(self, gain: float, speed: float, acceleration: float, tick_s: float) -> None:
        self._gain, self._speed, self._acceleration, self._tick_s = gain, speed, acceleration, tick_s

    def after(self, motion: Motion, set_point: float) -> Motion:
        """Return its motion a tick later."""
        at, speed = motion
        tick_s = self._tick_s
        target = min(max(self._gain * (set_point - at), -self._speed), self._speed)
        change = target - speed
        change_s = abs(change) / self._acceleration
        if change_s >= tick_s:
            change = copysign(self._acceleration * tick_s, change)
            return Motion(at + (speed + 0.5 * change) * tick_s, speed + change)
        return Motion(at + target * tick_s - 0.5 * change * change_s, target)

    def reaches_s(self, start: Motion, place: float, set_point: float, most_s: float) -> float:
        """Return how long it takes from `start` up to a place; `most_s` for one that it reaches later or never."""
        motion, time_s = start, 0.0
        while time_s < most_s:
            following = self.after(motion, set_point)
            if following.at >= place:
                share = (place - motion.at) / (following.at - motion.at) if following.at > motion.at else 1.0
                return time_s + min(max(share, 0.0), 1.0) * self._tick_s
            motion, time_s = following, time_s + self._tick_s
        return most_s


class Motors:
    """Both motors of a rod, after the newest reading and by the commands that were sent."""

    def __init__(self, drive: Drive, limits: RodLimits, tick_ns: int) -> None:
        tick_s = tick_ns * 1e-9
        accelerations = [force / load for force, load in zip(limits.forces, limits.loads, strict=True)]
        self.slide = Motor(drive.slide.gain, drive.slide.speed, accelerations[SLIDE], tick_s)
        self.spin = Motor(drive.spin.gain, drive.spin.speed, accelerations[SPIN], tick_s)
        self._read_tick = -1
        self._read = Motion(0.0, 0.0), Motion(0.0, 0.0)
        self._commands: deque[tuple[int, float, float]] = deque()
        """Set-points in the order of the ticks from which they hold; the first one holds at the reading's tick."""

    def note(self, tick: int, slide: float, spin: float) -> None:
        """Note set-points (m, rad) that hold from a tick on."""
        self._commands.append((tick, slide, spin))

    def see(self, tick: int, slide: float, spin: float) -> None:
        """Take a reading (m, rad) of a tick; one older than the last, or equally old, changes nothing.

        Its speeds are those foreseen: the loop corrects them within some ticks.
        """
        if tick <= self._read_tick:
            return
        before_slide, before_spin = self.at(tick) if self._read_tick >= 0 else self._read
        self._read = Motion(slide, before_slide.speed), Motion(spin, before_spin.speed)
        self._read_tick = tick
        while len(self._commands) > 1 and self._commands[1][0] <= tick:
            self._commands.popleft()

    def at(self, tick: int) -> tuple[Motion, Motion]:
        """Return how slide and spin move at a tick, after that of the reading."""
        slide, spin = self._read
        commands, coming = self._commands, 0
        for passing in range(self._read_tick, tick):
            while coming < len(commands) and commands[coming][0] <= passing:
                coming += 1
            if coming:
                _, slide_to, spin_to = commands[coming - 1]
                slide, spin = self.slide.after(slide, slide_to), self.spin.after(spin, spin_to)
        return slide, spin
