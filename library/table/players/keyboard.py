"""A team that a person plays from the keys of a terminal.

`KEYS` lists the keys; the player prints it when it starts. The terminal gets its own mode back when the
process ends.
"""

from __future__ import annotations

import atexit
import os
import select
import sys
import termios
import tty
from collections.abc import Mapping
from typing import Any, Final

from foosim.client.player import Commands, Player, Samples
from foosim.common.errors import BadValue
from foosim.deployment.schema import Deployment
from foosim.library.table.players.by_hand import ByHand
from foosim.library.table.players.senses import team_of
from foosim.library.table.settings import LINE_NAMES
from foosim.runtime.keys import is_foreground, split_keys

SLIDE_M: Final = 0.015
SWING_RAD: Final = 0.2
"""What one press of a key moves."""
READ_BYTES: Final = 1024
KEYS: Final = (
    "1 2 3 4: hold goal, defence, midfield, attack; tab: the next rod; left, right (a, d): slide; "
    "up, down (w, s): feet forward, back; space: shoot; l: lift the feet; r: feet down"
)


class Keyboard(Player):
    """A person at the terminal that this process was started in. Parameter: `team`, red or blue.

    Raises BadValue where there is no such terminal.
    """

    def __init__(self, deployment: Deployment, parameters: Mapping[str, Any]) -> None:
        team = team_of(parameters)
        self._hands = ByHand(deployment, team)
        self._tick_ns = deployment.tick_ns
        self._rest = ""
        self._file = _terminal()
        before = termios.tcgetattr(self._file)
        atexit.register(_restore, self._file, before)
        tty.setcbreak(self._file, termios.TCSADRAIN)
        print(f"you play {team}. {KEYS}", flush=True)

    def act(self, tick: int, samples: Samples) -> Commands:
        """Return the command of each rod after the keys that were pressed since the last turn."""
        now_s = tick * self._tick_ns * 1e-9
        for key in self._pressed():
            self._press(key, now_s)
        return self._hands.commands(now_s)

    def _pressed(self) -> list[str]:
        text = self._rest
        while is_foreground(self._file) and select.select([self._file], [], [], 0.0)[0]:
            try:
                data = os.read(self._file, READ_BYTES)
            except OSError:
                break
            if not data:
                break
            text += data.decode(errors="ignore")
        keys, self._rest = split_keys(text)
        return keys

    def _press(self, key: str, now_s: float) -> None:
        hands = self._hands
        match key:
            case "1" | "2" | "3" | "4":
                hands.hold(LINE_NAMES[int(key) - 1])
            case "\t":
                hands.next()
            case "right" | "d":
                hands.slide(SLIDE_M)
            case "left" | "a":
                hands.slide(-SLIDE_M)
            case "up" | "w":
                hands.swing(SWING_RAD)
            case "down" | "s":
                hands.swing(-SWING_RAD)
            case " ":
                hands.shoot(now_s)
            case "l":
                hands.lift()
            case "r":
                hands.swing_to(0.0)
            case _:
                pass


def _terminal() -> int:
    """Return the file of the terminal that this process may read; raises BadValue."""
    stream = sys.stdin
    if stream is None or stream.closed or not stream.isatty():
        raise BadValue(
            "the keyboard needs a terminal: declare the player with `launch: manual`, and start it in one with the "
            "command that `up` prints"
        )
    if not is_foreground(stream.fileno()):
        raise BadValue("the keyboard needs its terminal: this process is in the background")
    return stream.fileno()


def _restore(file: int, before: list[Any]) -> None:
    if is_foreground(file):
        termios.tcsetattr(file, termios.TCSADRAIN, before)
