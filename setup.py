"""Compiles the hot path: modules of the tick and of the packet become C extensions by mypyc, from the source as it is.

The source stays in the wheel beside them and is what runs where they were not compiled: the same bits, more slowly.
What is compiled is `COMPILED`. FOOSIM_COMPILE says what is wanted: `auto` (the default: whoever has no C compiler gets
the source alone), `always` (fail without one), `quick` (as that, not optimised: for tests) or `never`. In an editable
install no Python is compiled, so that what is edited is what runs. The kernels, which are written in C, are compiled in
each install. All else about the package is in pyproject.toml.
"""

from __future__ import annotations

import os
import re
import shutil
import sys
import time
import tomllib
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Final

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext
from setuptools.errors import BaseError, CCompilerError

PROJECT: Final = tomllib.loads(Path("pyproject.toml").read_text())["tool"]
COMPILED: Final = PROJECT["foosim"]["compiled"]
"""What `[tool.foosim.compiled]` of pyproject.toml lists: modules by path, each with what it does so often."""
PACKAGES: Final = PROJECT["setuptools"]["package-dir"]
TYPED: Final = Path("build", "typed")
"""Where the folders stand under the name that they are imported by, for mypyc."""
MADE: Final = Path("build", "c")
LIBRARY: Final = "foosim"
CHOICES: Final = ("auto", "always", "quick", "never")
MYPY: Final = (
    "--config-file=",
    "--no-site-packages",  # types of numpy say nothing to the compiler, and reading them takes as long as all of ours
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
LEVEL: Final = "-O1"
SILENT: Final = ("-w", "-Wno-all", "-Wno-sign-compare")
"""By the first alone gcc still looks for what it does not say: a seventh of its time where it optimises nothing."""
LIGHT: Final = ("-fno-tree-dominator-opts", "-fno-tree-pta", "-fno-asynchronous-unwind-tables")
"""Takes passes from gcc that cost it a sixth of its time at this level."""
ONCE: Final = '__attribute__((cold, optimize("O0")))'
"""What runs only when a module is imported is a fifth of all C: it is not optimised."""
IMPORTED: Final = re.compile(r"^char CPyDef_\w+___top_level__\(void\)", re.MULTILINE)
DOOR: Final = f"""
#include <Python.h>

static PyObject *create(PyObject *spec, PyModuleDef *Py_UNUSED(def)) {{
    PyObject *library = NULL, *start = NULL, *module = NULL;
    PyObject *name = PyObject_GetAttrString(spec, "name");
    PyObject *flat = name ? PyObject_CallMethod(name, "replace", "ss", ".", "___") : NULL;
    PyObject *wanted = flat ? PyUnicode_FromFormat("init_%U", flat) : NULL;
    if (wanted && (library = PyImport_ImportModule("{LIBRARY}__mypyc"))
        && (start = PyObject_GetAttr(library, wanted))) {{
        PyObject *(*init)(void) = (PyObject *(*)(void))PyCapsule_GetPointer(start, PyCapsule_GetName(start));
        module = init ? init() : NULL;
    }}
    Py_XDECREF(name), Py_XDECREF(flat), Py_XDECREF(wanted), Py_XDECREF(library), Py_XDECREF(start);
    return module;
}}

static PyModuleDef_Slot slots[] = {{{{Py_mod_create, create}}, {{0, NULL}}}};
static PyModuleDef door = {{PyModuleDef_HEAD_INIT, .m_name = "door", .m_slots = slots}};
"""
"""What Python loads for any compiled module: it asks the one library for the module of the name that is imported.

mypyc writes such a file for each module, and to compile and link one takes a tenth of a second. This one has the entry
of each, so it is compiled once and copied.
"""
UNITS: Final = 8
"""So many files go to the compiler, of about the same size: each reads the headers once, and cores share them."""


class CompileOrLeave(build_ext):
    """Compiles all, or where that fails and nobody insists, nothing: half of it would not import."""

    def initialize_options(self) -> None:
        """Begin with nothing linked."""
        super().initialize_options()
        self.linked: dict[tuple[str, ...], Path] = {}

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

    def build_extension(self, ext: Extension) -> None:
        """Compile an extension's sources side by side, then link them; what is linked already is copied."""
        path = Path(self.get_ext_fullpath(ext.name))
        made = self.linked.setdefault(tuple(ext.sources), path)
        if made != path:
            path.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(made, path)
            return
        if len(ext.sources) > 1 and choice() != "quick" and self.takes(LIGHT):
            ext.extra_compile_args += LIGHT
        with ThreadPoolExecutor(cores()) as pool:
            ext.extra_objects = [*pool.map(lambda source: self.object_of(ext, source), ext.sources)]
        ext.sources = []
        super().build_extension(ext)

    def takes(self, options: Sequence[str]) -> bool:
        """Return whether the compiler knows some options."""
        MADE.mkdir(parents=True, exist_ok=True)
        empty = MADE / "empty.c"
        empty.write_text("")
        try:
            self.compiler.compile([str(empty)], self.build_temp, extra_postargs=["-Werror", *options])
        except CCompilerError:
            return False
        return True

    def object_of(self, ext: Extension, source: str) -> str:
        """Compile one source; return the path of the object."""
        begun_s = time.monotonic()
        (made,) = self.compiler.compile(
            [source], self.build_temp, include_dirs=ext.include_dirs, extra_postargs=ext.extra_compile_args
        )
        if len(ext.sources) > 1:
            say(f"{Path(source).name} is compiled, in {time.monotonic() - begun_s:.0f} s")
        return str(made)


def cores() -> int:
    """Return how many cores there are for this process."""
    return len(os.sched_getaffinity(0))


def say(text: str) -> None:
    """Say what goes on: pip shows it with -v, other builds at once."""
    print(f"foosim: {text}", flush=True)


def choice() -> str:
    """Return what is wanted of FOOSIM_COMPILE; exits where that is no choice."""
    wanted = os.environ.get("FOOSIM_COMPILE", "auto")
    if wanted not in CHOICES:
        sys.exit(f"FOOSIM_COMPILE is {wanted!r}; it can be {', '.join(CHOICES)}")
    return wanted


def kernels() -> Extension:
    """Return the extension of the kernels: C for Python 3.11 and any later one, by its stable interface."""
    files = sorted(map(str, Path("kernels").glob("*.c")))
    options = ["-O3", "-fno-math-errno", "-fno-trapping-math", *EXACT]  # neither errno nor flags of exceptions are read
    sources = ["kernels/kernels.c"]  # it includes the others
    name = f"{LIBRARY}.kernels._kernels"
    return Extension(name, sources, depends=files, extra_compile_args=options, py_limited_api=True)


def extensions() -> list[Extension]:
    """Return the extensions of a build that makes some."""
    if choice() == "never":
        return []
    if not {"bdist_wheel", "build", "build_ext", "install"} & set(sys.argv) or "--inplace" in sys.argv:
        return [kernels()]
    from mypyc.build import mypycify

    say(f"mypyc makes C of {len(COMPILED)} modules; FOOSIM_COMPILE=never leaves that out")
    begun_s = time.monotonic()
    shutil.rmtree(TYPED, ignore_errors=True)
    for package, folder in PACKAGES.items():
        ignored = shutil.ignore_patterns("__pycache__")
        shutil.copytree(folder, TYPED / package.replace(".", "/"), ignore=ignored, dirs_exist_ok=True)
    os.environ["MYPYPATH"] = str(TYPED)
    files = [str(TYPED / "foosim" / f"{name}.py") for name in COMPILED]
    library, *shims = mypycify([*MYPY, *files], multi_file=True, target_dir=str(MADE), group_name=LIBRARY)
    library.sources = units(library.sources)
    level = "-O0" if choice() == "quick" else LEVEL
    library.extra_compile_args = [*library.extra_compile_args, level, *SILENT, *EXACT]
    door = door_of([shim.name for shim in shims])
    for shim in shims:
        shim.sources, shim.extra_compile_args = [door], ["-O0", "-g0"]
    say(f"that took {time.monotonic() - begun_s:.0f} s; the C compiler runs on {cores()} cores")
    return [kernels(), library, *shims]


def door_of(names: Sequence[str]) -> str:
    """Write the source of the file that stands beside each compiled module; return its path."""
    source = MADE / "door.c"
    last = sorted({name.removesuffix(".__init__").rpartition(".")[2] for name in names})
    entries = (f"PyMODINIT_FUNC PyInit_{name}(void) {{ return PyModuleDef_Init(&door); }}\n" for name in last)
    source.write_text(DOOR + "".join(entries))
    return str(source)


def units(sources: Sequence[str]) -> list[str]:
    """Return a few files that include all sources but mypyc's own, about as much each."""
    whole, *rest = sorted(sources, key=lambda source: "___" in Path(source).name)
    shares: list[list[Path]] = [[] for _ in range(UNITS)]
    for source in sorted(map(Path, rest), key=lambda path: -path.stat().st_size):
        min(shares, key=lambda share: sum(path.stat().st_size for path in share)).append(source)
    made = [whole]
    for number, share in enumerate(shares, 1):
        unit = MADE / f"part_{number}_of_{UNITS}.c"
        once = (name for path in share for name in IMPORTED.findall(path.read_text()))
        unit.write_text(
            "".join([*(f"{name} {ONCE};\n" for name in once), *(f'#include "{path.name}"\n' for path in share)])
        )
        made.append(str(unit))
    return made


setup(ext_modules=extensions(), cmdclass={"build_ext": CompileOrLeave})
