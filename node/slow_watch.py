"""Says where a tick is that takes long, from a thread beside the node's own: also where it hangs.

Looks are counted, not times, so a process that stands still blames no line. Compiled code has no lines, and code that
holds the interpreter lock stops this thread, too.
"""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Final

from foosim.world.forms.failures import OURS, in_library

LOOK_S: Final = 0.05
LOOKS: Final = 4
"""A tick takes long when so many looks after another find it at the same one."""
_WORLD: Final = f"{OURS}.world."


def place_in(frame: FrameType | None) -> str:
    """Return file, line and function of the innermost call of a user's module on a stack, or else of foosim.world.

    `frame` is the innermost of the stack. Empty where neither is on it: no component computes.
    """
    in_world = ""
    while frame is not None:
        code, module = frame.f_code, str(frame.f_globals.get("__name__", ""))
        place = f"{Path(code.co_filename).name}:{frame.f_lineno} in {code.co_name}"
        if module.startswith(_WORLD):
            in_world = in_world or place
        elif module.partition(".")[0] not in (OURS, "__main__") and not (
            code.co_filename.startswith("<") or in_library(code.co_filename)
        ):
            return place
        frame = frame.f_back
    return in_world


class SlowTicks:
    """What was seen of the present tick, look by look. Each file is named once."""

    def __init__(self) -> None:
        self._tick, self._looks = -1, 0
        self._named: set[str] = set()

    def look(self, tick: int, find: Callable[[], str]) -> str:
        """Return what is to be told at a look, mostly nothing.

        `tick` is the present tick, -1 without one; `find` returns the place where a component computes, or nothing.
        """
        if tick < 0 or tick != self._tick:
            self._tick, self._looks = tick, 0
            return ""
        place = find()
        self._looks = self._looks + 1 if place else 0
        file = place.partition(":")[0]
        if self._looks < LOOKS or file in self._named:
            return ""
        self._named.add(file)
        return f"{place} has taken more than {LOOKS * LOOK_S:.1f} s at tick {tick}"


class SlowWatch:
    """The thread that looks at the thread that made it, until `stop`."""

    def __init__(self, present_tick: Callable[[], int], name: Callable[[str], None]) -> None:
        """`present_tick` returns -1 without one; `name` is called in the thread with what is to be told."""
        self._present_tick, self._name = present_tick, name
        self._watched = threading.get_ident()
        self._is_over = threading.Event()
        self._thread = threading.Thread(target=self._run, name="slow ticks", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End the thread; calling it again does nothing."""
        self._is_over.set()
        self._thread.join()

    def _run(self) -> None:
        ticks = SlowTicks()
        while not self._is_over.wait(LOOK_S):
            text = ticks.look(self._present_tick(), lambda: place_in(sys._current_frames().get(self._watched)))
            if text:
                self._name(text)
