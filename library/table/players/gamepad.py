"""A team that a person plays with a gamepad, by the joystick interface of Linux (Documentation/input/joystick-api.rst).

Left stick, sideways: slide of the held rod. Right stick, up and down: its feet. Shoulder buttons: the next and the
previous rod. A: shoot. B: feet lifted while it is held down.
"""

from __future__ import annotations

import errno
import glob
import os
import struct
import sys
from collections.abc import Iterator, Mapping
from typing import Any, Final

from foosim.client.player import Commands, Player, Samples
from foosim.common.errors import BadValue
from foosim.deployment.schema import Deployment
from foosim.library.table.players.by_hand import SWING_RAD_MAX, ByHand
from foosim.library.table.players.senses import team_of

DEVICE: Final = "/dev/input/js0"
_EVENT: Final = struct.Struct("=IhBB")
"""struct js_event: time (ms), value, type, number."""
BUTTON, AXIS, INITIAL = 0x01, 0x02, 0x80
FULL: Final = 32767.0
DEAD: Final = 0.08
"""Share of an axis around its middle that counts as the middle: sticks do not come back exactly."""
SLIDE_AXIS: Final = 0
SWING_AXES: Final = (4, 3)
"""The right stick up and down: the fifth axis where the triggers are axes, too, as the `xpad` driver has it."""
SHOOT, LIFT, PREVIOUS, NEXT = 0, 1, 4, 5
"""Buttons of the `xpad` driver: A, B, left and right shoulder."""
AGAIN_TICKS: Final = 500
"""Interval in ticks between looks for a gamepad that was unplugged."""
EVENTS_READ: Final = 64


class Gamepad(Player):
    """A person with a gamepad. Parameters: `team`, red or blue; `device`, /dev/input/js0 unless it is given.

    Raises BadValue where there is no such device, or it cannot be read. Rods stay where they are while it is unplugged.
    """

    def __init__(self, deployment: Deployment, parameters: Mapping[str, Any]) -> None:
        team = team_of(parameters, ("device",))
        device = parameters.get("device", DEVICE)
        if not isinstance(device, str):
            raise BadValue("parameter device is not the path of a device", device)
        self._device = device
        self._hands = ByHand(deployment, team)
        self._tick_ns = deployment.tick_ns
        self._strokes = {rod.line: rod.half_stroke for rod in self._hands.rods}
        self._axes: dict[int, float] = {}
        self._rest = b""
        self._again = 0
        self._file: int | None = _opened(device)

    def act(self, tick: int, samples: Samples) -> Commands:
        """Return the command of each rod after the events of the gamepad since the last turn."""
        now_s = tick * self._tick_ns * 1e-9
        for value, kind, number in self._events(tick):
            if kind & BUTTON and not kind & INITIAL:
                self._press(number, value != 0, now_s)
            elif kind & AXIS:
                self._axes[number] = value / FULL if abs(value) > DEAD * FULL else 0.0
                self._move(number)
        return self._hands.commands(now_s)

    def _press(self, number: int, is_down: bool, now_s: float) -> None:
        hands = self._hands
        if number == LIFT:
            if is_down:
                hands.lift()
            else:
                hands.swing_to(0.0)
        elif is_down and number == SHOOT:
            hands.shoot(now_s)
        elif is_down and number in (PREVIOUS, NEXT):
            hands.next(1 if number == NEXT else -1)

    def _move(self, number: int) -> None:
        """Follow a stick with the held rod."""
        hands, value = self._hands, self._axes[number]
        if number == SLIDE_AXIS and hands.held is not None:
            hands.slide_to(value * self._strokes[hands.held])
        elif number == next((axis for axis in SWING_AXES if axis in self._axes), None):
            hands.swing_to(-value * SWING_RAD_MAX)  # up is negative

    def _events(self, tick: int) -> Iterator[tuple[int, int, int]]:
        """Yield value, type and number of each event that waits."""
        if self._file is None and tick >= self._again:
            self._again = tick + AGAIN_TICKS
            try:
                self._file = _opened(self._device)
            except BadValue:
                return
        while self._file is not None:
            try:
                data = os.read(self._file, EVENTS_READ * _EVENT.size)
            except BlockingIOError:
                return
            except OSError as error:
                self._lose(tick, error)
                return
            if not data:
                return
            self._rest += data
            whole = len(self._rest) // _EVENT.size * _EVENT.size
            for _, value, kind, number in _EVENT.iter_unpack(self._rest[:whole]):
                yield value, kind, number
            self._rest = self._rest[whole:]

    def _lose(self, tick: int, error: OSError) -> None:
        assert self._file is not None
        os.close(self._file)
        self._file, self._rest, self._again = None, b"", tick + AGAIN_TICKS
        print(f"{self._device}: {error.strerror}; rods stay until it is back", file=sys.stderr, flush=True)


def _opened(device: str) -> int:
    """Return the file of a device; raises BadValue."""
    try:
        return os.open(device, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    except FileNotFoundError:
        there = ", ".join(sorted(glob.glob("/dev/input/js*"))) or "none"
        raise BadValue(f"unknown gamepad (there are: {there})", device) from None
    except OSError as error:
        advice = "; its group is usually `input`" if error.errno == errno.EACCES else ""
        raise BadValue(f"the gamepad cannot be read, {error.strerror}{advice}", device) from None
