"""The process of a MORSE script: `morse.builder` records here what the script makes, and judges nothing.

    python -I -m foosim.gateways.builder.record SCRIPT CLASSES.json RESULT.json SECONDS

Each call is kept with its place in the script, so that the writer can name all problems at once.
"""

from __future__ import annotations

import json
import os
import resource
import signal
import sys
import traceback
from pathlib import Path
from types import FrameType, ModuleType
from typing import Any, ClassVar, Final, NoReturn

MEMORY_BYTES_MAX: Final = 2 << 30
MODULES: Final = ("robots", "sensors", "actuators", "environment", "blenderobjects", "morsebuilder")
NAMED: Final = ("robots", "sensors", "actuators", "objects")
"""Categories of classes whose first argument that is a text is a name."""
VECTORS: Final = ("location", "rotation_euler", "scale", "size")
KEPT: Final = ("number", "place", "basename", "parent", "args", "kwargs", "given", "calls", *VECTORS)


class Thing:
    """What a script makes. `location` (m) and `rotation_euler` (rad) are in the frame of the parent."""

    made: ClassVar[list[Thing]] = []
    morse: ClassVar = ""
    category: ClassVar = ""
    location: list[float]
    rotation_euler: list[float]

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        its = self.__dict__
        its.update(number=len(Thing.made), place=place(), args=args, kwargs=kwargs, basename=None, parent=None)
        its.update(location=[0.0] * 3, rotation_euler=[0.0] * 3, scale=[1.0] * 3, size=[1.0] * 3)
        its.update(given={}, calls=[])
        Thing.made.append(self)
        if self.category in NAMED:
            self.name = kwargs.get("name") or next((arg for arg in args if isinstance(arg, str)), None)
        if self.category == "environment" and kwargs.get("component_renaming", True):
            name_all()

    def __setattr__(self, name: str, value: Any) -> None:
        if name == "name" and value and "." in value:
            raise SyntaxError(f"Invalid component name: <{value}>. Dots are not allowed.")
        named = {"basename": value or self.basename} if name == "name" else {name: value}
        self.__dict__.update({name: list(value)} if name in VECTORS else named)

    def __getattr__(self, name: str) -> Any:
        if name == "name":
            return self.basename or self.morse
        if name.startswith("__"):
            raise AttributeError(name)
        return lambda *args, **kwargs: self.calls.append((name, place(), args, kwargs))

    def append(self, thing: Thing, *_: Any) -> None:
        """Make a thing a child; without a name it gets that of its variable where this is called."""
        thing.parent = self
        name_all(thing)

    def translate(self, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> None:
        """Add to the place."""
        self.location = [old + new for old, new in zip(self.location, (x, y, z), strict=True)]

    def rotate(self, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> None:
        """Add to the angles."""
        self.rotation_euler = [old + new for old, new in zip(self.rotation_euler, (x, y, z), strict=True)]

    def properties(self, **values: Any) -> None:
        """Set properties, each with its place in the script."""
        self.given.update({name: (value, place()) for name, value in values.items()})

    def property_value(self, name: str) -> Any:
        """Return the last value of a property, None without one."""
        return self.given.get(name, (None,))[0]

    @staticmethod
    def close_context(*_: Any) -> None:
        """Name what the variables of the caller hold."""
        name_all()


def caller() -> FrameType:
    """Return the frame that has called the recorder."""
    frame: FrameType | None = sys._getframe(1)
    while frame is not None and frame.f_code.co_filename == __file__:
        frame = frame.f_back
    assert frame is not None, "called by a script"
    return frame


def place(frame: FrameType | None = None) -> str:
    """Return `file:line` of the innermost frame that is in the folder of the script."""
    found = frame = frame or caller()
    while found.f_back is not None and os.path.dirname(found.f_code.co_filename) != sys.path[0]:
        found = found.f_back
    found = found if found.f_back is not None else frame
    return f"{os.path.basename(found.f_code.co_filename)}:{found.f_lineno}"


def name_all(only: Thing | None = None) -> None:
    """Give things without a name those of the caller's variables, which are attributes of `self`, too."""
    frame = caller()
    attributes = getattr(frame.f_locals.get("self"), "__dict__", {})
    held = {name: value for name, value in attributes.items() if name != "parent"} | frame.f_locals
    for name, value in held.items():
        if isinstance(value, Thing) and value.basename is None and only in (None, value) and name != "self":
            value.name = name


def install(classes: dict[str, list[str]]) -> None:
    """Make `morse.builder` importable, with classes by category."""
    names: dict[str, Any] = {"AbstractComponent": Thing, "timer": float}
    for category, morses in classes.items():
        for morse in morses:
            names[morse] = type(morse, (Thing,), {"morse": morse, "category": category})
    names["bpymorse"] = names["bpymorse"]()
    names["TimeStrategies"] = type("TimeStrategies", (), {one: one for one in ("BestEffort", "FixedSimulationStep")})
    for module in ("", ".core", ".core.morse_time", ".builder", *(f".builder.{name}" for name in MODULES)):
        made = sys.modules[f"morse{module}"] = ModuleType(f"morse{module}")
        made.__path__ = []
        made.__dict__.update(names)


def main() -> None:
    """Run a script and write what it has made. A process that the script forks writes nothing."""
    script, classes, result = (Path(word).resolve() for word in sys.argv[1:4])
    limit_s, owner = int(sys.argv[4]), os.getpid()
    problems: list[tuple[str, str]] = []
    sys.path.insert(0, str(script.parent))
    os.chdir(script.parent)
    install(json.loads(classes.read_text()))
    sys.argv[:] = [str(script)]

    def write() -> None:
        things = [{name: getattr(one, name) for name in ("morse", "category", *KEPT)} for one in Thing.made]
        result.write_text(json.dumps({"things": things, "problems": problems}, default=_plain, skipkeys=True))

    def end(number: int, frame: FrameType | None) -> NoReturn:
        problems.append((place(frame), f"the script still runs after {limit_s} s, which is its limit"))
        write()
        os._exit(0)

    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES_MAX, MEMORY_BYTES_MAX))
    signal.signal(signal.SIGALRM, end)
    signal.alarm(limit_s)
    try:
        exec(compile(script.read_bytes(), str(script), "exec"), {"__name__": "__main__", "__file__": str(script)})
    except SystemExit as ended:
        if ended.code not in (None, 0):
            problems.append((script.name, f"the script has ended with exit code {ended.code}"))
    except BaseException as error:  # noqa: BLE001  # whatever a script raises is a problem of it
        frames = [one for one, _ in traceback.walk_tb(error.__traceback__) if one.f_code.co_filename != __file__]
        text = f"the script has raised {type(error).__name__}: {error}"
        problems.append((place(frames[-1]) if frames else script.name, text))
    signal.alarm(0)
    if os.getpid() == owner:
        write()


def _plain(value: Any) -> Any:
    return value.number if isinstance(value, Thing) else repr(value)


if __name__ == "__main__":
    main()
