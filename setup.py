"""Compiles the hot path: modules of the tick and of the packet become C extensions by mypyc, from the source as it is.

The source stays in the wheel beside them and is what runs where they were not compiled: the same bits, more slowly.
What is compiled is `COMPILED`. FOOSIM_COMPILE says what is wanted: `auto` (the default: whoever has no C compiler gets
the source alone), `always` (fail without one), `quick` (as that, not optimised: for tests) or `never`. An editable
install is never compiled, so that what is edited is what runs. All else about the package is in pyproject.toml.
"""

from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path
from typing import Final

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext
from setuptools.errors import BaseError, CCompilerError

COMPILED: Final = {
    "client": (
        *("beacons", "core", "crew", "dispatch", "packets", "patrol", "payloads", "player", "players", "roadmap"),
        *("steering", "tracking"),
    ),
    "node": ("core", "edits", "hall_world", "held", "inputs", "rules", "solver", "step", "table_world", "world"),
    "node/actuators": ("__init__", "drive", "position"),
    "node/engines": ("pure", "pure_bodies", "pure_shapes", "rovers"),
    "node/sensors": ("__init__", "ball", "battery", "encoder", "fitting", "odometry", "pose", "proximity"),
    "protocol": (
        *("actions", "assign", "barrier", "channels", "codec", "draws", "frame", "layout", "limits", "member"),
        *("obstacles", "patience", "refusals", "sampling", "scene", "standstill", "start"),
    ),
    "rehearsal": (
        *("bounds", "bus", "clock", "hub_journal", "laws", "machines", "packet_laws", "people", "replica", "settings"),
        *("system", "whatif", "whatif_reading", "world_bounds"),
    ),
    "supervisor": (
        *("absence", "arrivals", "balance", "branches", "closing", "core", "handshake", "head", "issued", "pacing"),
        *("recovery", "requests", "roster", "take_over", "watch"),
    ),
    "vhub": (
        *("ages", "air", "budget", "fabric", "geometry", "jitter", "links", "mcap_writer", "members", "numbers"),
        *("packet", "propagation", "rays", "room", "sendings", "setup", "solids", "state", "to_rows", "transit"),
        *("turns", "world"),
    ),
    "vhub/radio": (
        *("airtime", "contention", "errors", "fading", "frames", "materials", "noise", "path_loss", "shadowing"),
        *("timings",),
    ),
    "vhub/stages": (
        *("__init__", "admit", "capacity", "channel", "delay", "duty", "mangle", "medium", "own", "policy", "queue"),
        *("receiver", "residual", "stage"),
    ),
}
"""Modules by folder. Types of messages and rows stay as they are: those of msgspec are compiled already."""
PACKAGES: Final = ("client", "node", "protocol", "rehearsal", "supervisor", "vhub")
TYPED: Final = Path("build", "typed")
"""Where the folders stand under the name that they are imported by, for mypyc."""
CHOICES: Final = ("auto", "always", "quick", "never")
MYPY: Final = (
    "--config-file=",
    "--explicit-package-bases",
    "--namespace-packages",
    "--follow-imports=silent",
    "--ignore-missing-imports",
)
EXACT: Final = (
    *("-g0", "-ffp-contract=off"),
    *(f"-fno-builtin-{name}" for name in ("exp", "log", "sin", "cos", "tan", "pow", "fmod")),
)
"""One rounding for each operation, and no function of the mathematical library worked out by the compiler."""


class CompileOrLeave(build_ext):
    """Compiles all, or where that fails and nobody insists, nothing: half of it would not import."""

    def run(self) -> None:
        """Build the extensions; raises what setuptools raises where they must be and cannot."""
        try:
            super().run()
        except (BaseError, CCompilerError) as error:
            if choice() != "auto":
                raise
            why = str(error)[:200]
            print(f"foosim gets no compiled modules, so it is slower; a C compiler is missing or fails: {why}")
            for path in self.get_outputs():
                Path(path).unlink(missing_ok=True)
            self.extensions = []


def choice() -> str:
    """Return what is wanted of FOOSIM_COMPILE; exits where that is no choice."""
    wanted = os.environ.get("FOOSIM_COMPILE", "auto")
    if wanted not in CHOICES:
        sys.exit(f"FOOSIM_COMPILE is {wanted!r}; it can be {', '.join(CHOICES)}")
    return wanted


def extensions() -> list[Extension]:
    """Return the extensions of a build that makes some."""
    if choice() == "never" or not {"bdist_wheel", "build", "build_ext", "install"} & set(sys.argv):
        return []
    from mypyc.build import mypycify

    shutil.rmtree(TYPED, ignore_errors=True)
    for package in PACKAGES:
        shutil.copytree(package, TYPED / "foosim" / package, ignore=shutil.ignore_patterns("__pycache__"))
    os.environ["MYPYPATH"] = str(TYPED)
    files = [str(TYPED / "foosim" / folder / f"{name}.py") for folder, names in COMPILED.items() for name in names]
    level = "0" if choice() == "quick" else "3"
    made = mypycify([*MYPY, *files], opt_level=level, multi_file=True, target_dir="build/c", group_name="foosim")
    for extension in made:
        extension.extra_compile_args = [*extension.extra_compile_args, *EXACT]
    return made


setup(ext_modules=extensions(), cmdclass={"build_ext": CompileOrLeave})
