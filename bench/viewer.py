"""One who looks at a run and looks away again, by turns, and prints how far the run came in each turn.

`python -m bench.viewer ADDRESS HZ TURN_S`: JSON of [whether it looked, ticks a second, frames a second] of each turn,
when the run has ended.
"""

from __future__ import annotations

import json
import sys
import time
from typing import Final

from foosim.client.control import Control, NoAnswer
from foosim.runtime.transport.inbox import Inbox
from foosim.runtime.transport.session import ConnectError

ORDER: Final = (False, True, True, False)
"""Who looks now and not then, so that a load that grows weighs on both."""
START_S: Final = 60.0
END_S: Final = 2.0
"""A run that answers nothing for so long has ended."""
SETTLE_S: Final = 0.1


def connected(address: str) -> Control:
    """Connect to a run that is being started."""
    deadline_s = time.monotonic() + START_S
    while True:
        try:
            return Control(address, role="viewer")
        except ConnectError:
            if time.monotonic() > deadline_s:
                raise


def turns(control: Control, hz: float, turn_s: float) -> list[tuple[bool, float, float]]:
    """Look and look away until the run has ended."""
    inbox, found = Inbox(10_000), list[tuple[bool, float, float]]()
    control.view(inbox)
    while control.status(START_S)["ticks"] < 1:
        time.sleep(SETTLE_S)
    while True:
        looks = ORDER[len(found) % len(ORDER)]
        try:
            control.ask("watch", END_S, hz=hz if looks else 0.0)
            time.sleep(SETTLE_S)
            begun, begun_s = control.ask("describe", END_S).tick, time.monotonic()
            inbox.take(0.0)
            frames = 0
            while (left_s := begun_s + turn_s - time.monotonic()) > 0.0:
                frames += len(inbox.take(left_s))
            ended = control.status(END_S)
        except NoAnswer:
            return found
        if ended["state"] != "running":
            return found
        passed_s = time.monotonic() - begun_s
        found.append((looks, (ended["ticks"] - begun) / passed_s, frames / passed_s))


def main() -> None:
    """Print the turns."""
    with connected(sys.argv[1]) as control:
        print(json.dumps(turns(control, float(sys.argv[2]), float(sys.argv[3]))))


if __name__ == "__main__":
    main()
