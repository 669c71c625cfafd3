"""Names the form that a node's tick waits for, from a thread beside the node's own: also one that hangs.

A tick that advances costs one comparison a look. Of one that stands still, the stack of the node's thread is searched
for a method of a form's object.
"""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Container
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import Final

from foosim.node.tick import Stepper

LOOK_NS: Final = 50_000_000
"""How often the thread looks."""
SLOW_NS: Final = 100_000_000
"""A form is slow when one tick has been seen in it for this long."""
LATE_NS: Final = 100_000_000
"""A look that is late by more than this does not count: this process, or its machine, stood still."""


@dataclass(frozen=True)
class SlowForm:
    """A form that takes long: `what` is its name and entity, `place` the file, line and function where it was seen."""

    what: str
    place: str
    tick: int
    seen_ns: int
    """For how long it has been seen at this tick: it has taken longer."""

    def __str__(self) -> str:
        return f"{self.what} has taken {self.seen_ns / 1e9:.1f} s at tick {self.tick} so far: {self.place}"


class SlowForms:
    """What was seen of the present tick, look by look. Each form is named once."""

    def __init__(self, now_ns: int) -> None:
        self._looked_ns = self._since_ns = now_ns
        self._tick = -1
        self._what = ""
        self._named: set[str] = set()

    def look(self, tick: int, find: Callable[[], tuple[str, str]], now_ns: int) -> SlowForm | None:
        """Return the form that is found to be slow at a look.

        `tick` is the present tick, -1 without one; `find` returns name and place of the form that computes, or two
        empty strings.
        """
        is_late = now_ns - self._looked_ns > LOOK_NS + LATE_NS
        self._looked_ns = now_ns
        if is_late or tick < 0 or tick != self._tick:
            self._tick, self._what = tick, ""
            return None
        what, place = find()
        if what != self._what:
            self._what, self._since_ns = what, now_ns
            return None
        seen_ns = now_ns - self._since_ns
        if not what or seen_ns < SLOW_NS or what in self._named:
            return None
        self._named.add(what)
        return SlowForm(what, place, tick, seen_ns)


def form_in(frame: FrameType | None, name_of: Callable[[object], str], files: Container[str]) -> tuple[str, str]:
    """Return the name of the innermost form whose method is on a stack, and where it is; two empty strings without.

    `frame` is the innermost of the stack, `name_of` returns the name of a form by its object, empty for other objects.
    `files` are those of the forms' modules: the variables of other frames, which run meanwhile, are not touched.
    Compiled modules have no frames, so a form of theirs is not found.
    """
    while frame is not None:
        code = frame.f_code
        if code.co_argcount and code.co_filename in files:
            what = name_of(frame.f_locals.get(code.co_varnames[0]))
            if what:
                return what, f"{Path(code.co_filename).name}:{frame.f_lineno} in {code.co_name}"
        frame = frame.f_back
    return "", ""


def modules_of(kind: type) -> set[str]:
    """Return the modules of a class and of those that it derives from."""
    return {base.__module__ for base in kind.__mro__}


class Names:
    """The names of a stepper's forms by their objects."""

    def __init__(self, stepper: Stepper) -> None:
        self.stepper: Final = stepper
        self._by_id: dict[int, tuple[object, str]] = {}
        for made, what in stepper.forms():
            self._by_id.setdefault(id(made), (made, what))

    @property
    def files(self) -> frozenset[str]:
        """The files of the modules of all forms, and of what computes several of them together."""
        made = [*(one for one, _ in self._by_id.values()), *(group for group, _ in self.stepper.forms_together())]
        modules = {module for one in made for module in modules_of(type(one))}
        return frozenset(getattr(sys.modules.get(module), "__file__", None) or "" for module in modules)

    def name_of(self, made: object) -> str:
        """Return the name of a form, empty for another object; sensors computed together have one for several."""
        known = self._by_id.get(id(made))
        if known is not None:
            return known[1]
        return next((what for group, what in self.stepper.forms_together() if group is made), "")


class SlowWatch:
    """The thread that looks at the thread that made it, until `stop`."""

    def __init__(self, present: Callable[[], tuple[int, Stepper | None]], name: Callable[[SlowForm], None]) -> None:
        """`present` returns tick and stepper, -1 and None without; `name` is called in the thread with a slow form."""
        self._present, self._name = present, name
        self._watched = threading.get_ident()
        self._names: Names | None = None
        self._is_over = threading.Event()
        self._thread = threading.Thread(target=self._run, name="slow forms", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End the thread; calling it again does nothing."""
        self._is_over.set()
        self._thread.join()

    def _run(self) -> None:
        forms = SlowForms(time.monotonic_ns())
        while not self._is_over.wait(LOOK_NS / 1e9):
            tick, stepper = self._present()
            slow = forms.look(tick, lambda at=stepper: self._find(at), time.monotonic_ns())  # type: ignore[misc]
            if slow is not None:
                self._name(slow)

    def _find(self, stepper: Stepper | None) -> tuple[str, str]:
        if stepper is None:
            return "", ""
        if self._names is None or self._names.stepper is not stepper:
            self._names = Names(stepper)
        return form_in(sys._current_frames().get(self._watched), self._names.name_of, self._names.files)
