"""The wheel that pip builds from the sdist: it holds every module; what is compiled in it computes the same bits."""

import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
import venv
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

import pytest

from foosim.capture.diff import diff_captures
from foosim.simulation.run import rehearse
from tests.world.test_guide import PACKAGE, USES, examples

ROOT = Path(__file__).parent.parent
PACKAGES = tuple(tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["package-dir"].values())
COMPILERS = ("cc", "gcc", "clang")
HAS_COMPILER = any(map(shutil.which, COMPILERS))
AIR = "radios: {air: {preset: wifi_5_indoor}}, robots: {'*': [air]}, places: {'*': [0 m, 0 m, 1 m]}"
RUNS = {
    "table": ("table.yaml", 250, []),
    "table, shared air": ("table.yaml", 250, ["engine=pure", f"network={{{AIR}}}"]),
    "warehouse": ("warehouse.yaml", 50, []),
    "yard": ("yard.yaml", 100, []),
    "workshop": ("workshop.yaml", 100, []),
    "eyes": ("eyes.yaml", 10, []),
    "cat and mouse": ("cat_and_mouse.yaml", 10, []),
}
"""Deployment, ticks and settings."""
REHEARSALS = """
import json, sys
from pathlib import Path
from foosim.simulation.run import rehearse
for name, (file, ticks, sets) in json.loads(sys.argv[2]).items():
    path = Path(sys.argv[1], file)
    rehearse(path.read_text(), file, ticks, None, sets, capture=Path(f"{name}.mcap"), folder=path.parent)
"""
pytestmark = pytest.mark.timeout(900)  # the compiler alone takes a minute of a core that others use as well


def run(*arguments: str | Path, cwd: Path, **environment: str) -> str:
    """Standard output of a command, which must succeed."""
    done = subprocess.run(
        [*map(str, arguments)], cwd=cwd, capture_output=True, text=True, check=False, env={**os.environ, **environment}
    )
    assert done.returncode == 0, f"{arguments}:\n{done.stdout}\n{done.stderr}"
    return done.stdout


def copy_source(to: Path) -> None:
    """Builds are made in a copy: a stale build/ would ship deleted modules."""
    to.mkdir()
    for package in PACKAGES:
        shutil.copytree(ROOT / package, to / package, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("pyproject.toml", "setup.py", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, to)


@dataclass
class Installed:
    """A clean environment with the wheel; our dependencies are seen from there."""

    environment: Path
    packages: Path

    @property
    def commands(self) -> Path:
        return self.environment / "bin"


def test_what_make_compiled_copies_has_nothing_of_npm(tmp_path: Path) -> None:
    """An editor wants the packages of npm beside the page's sources; what else git ignores is not shipped either."""
    for package in PACKAGES:
        (tmp_path / package).mkdir()
    page = tmp_path / "console" / "page"
    for file in (page / "src" / "main.js", page / "node_modules" / "three" / "three.js"):
        file.parent.mkdir(parents=True)
        file.write_text("")
    for name in ("pyproject.toml", "setup.py", "README.md", "LICENSE"):
        (tmp_path / name).write_text("")
    (tmp_path / "tools").mkdir()
    script = shutil.copy(ROOT / "tools" / "compiled.sh", tmp_path / "tools")
    python = tmp_path / ".venv" / "bin" / "python"
    python.parent.mkdir(parents=True)
    python.write_text('#!/bin/sh\n[ "$2" = venv ] && mkdir .venv-compiled\n')  # it fails to build
    python.chmod(0o755)
    assert subprocess.run(["sh", script, *PACKAGES], cwd=tmp_path, capture_output=True, check=False).returncode == 1
    copied = tmp_path / ".venv-compiled" / "source" / "console" / "page"
    assert (copied / "src" / "main.js").is_file() and not (copied / "node_modules").exists()


def build_key(source: Path) -> str:
    """Return what a wheel depends on: the files that it is built from, and what builds it."""
    tools = [sys.version, *(f"{name} {version(name)}" for name in ("build", "mypy", "setuptools"))]
    tools += [run(tool, "--version", cwd=source) for tool in map(shutil.which, COMPILERS) if tool]
    digest = hashlib.sha256(repr(tools).encode())
    for path in sorted(path for path in source.rglob("*") if path.is_file()):
        digest.update(f"\0{path.relative_to(source)}\0".encode() + path.read_bytes())
    return digest.hexdigest()


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory, pytestconfig: pytest.Config) -> Path:
    """The wheel, which pytest's cache keeps: mypyc and the compiler take a minute, for the same wheel as before."""
    folder, cache = tmp_path_factory.mktemp("wheel"), pytestconfig.cache
    assert cache is not None
    source, kept = folder / "source", cache.mkdir("wheel")
    copy_source(source)
    key = build_key(source)
    if not list(kept.glob(f"{key}/*.whl")):
        # Without --wheel or --sdist, build makes the sdist, and the wheel from what is in the sdist.
        build = sys.executable, "-m", "build", "--no-isolation", "--outdir", folder
        run(*build, cwd=source, FOOSIM_COMPILE="quick" if HAS_COMPILER else "never")
        for earlier in kept.iterdir():
            shutil.rmtree(earlier)
        (made,) = folder.glob("*.whl")
        (kept / key).mkdir()
        shutil.copy(made, kept / key)
    (found,) = kept.glob(f"{key}/*.whl")
    return found


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Installed:
    folder = tmp_path_factory.mktemp("installed")
    environment = folder / "environment"
    venv.create(environment, symlinks=True)
    python = environment / "bin" / "python"
    run(sys.executable, "-m", "pip", "--python", python, "install", "--no-deps", "--no-index", wheel, cwd=folder)
    # Our dependencies, by a path file: it adds a folder without running what the folder's own path files ask for, so
    # the editable install beside them stays out of sight.
    (packages,) = environment.glob("lib/python*/site-packages")
    (packages / "dependencies.pth").write_text("\n".join(path for path in sys.path if path.endswith("-packages")))
    return Installed(environment, packages)


def test_it_holds_every_module(installed: Installed, tmp_path: Path) -> None:
    files = [path.relative_to(ROOT) for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))]
    modules = [".".join(("foosim", *file.with_suffix("").parts)) for file in files]
    modules = [name.replace("foosim.door", "foosim").removesuffix(".__init__") for name in modules]
    program = "from importlib import import_module as get; import sys\n"
    program += "for name in sys.argv[1:]: assert get(name).__file__.startswith(sys.prefix), get(name)"
    run(installed.commands / "python", "-I", "-W", "error", "-c", program, *modules, cwd=tmp_path)
    assert len(list(installed.packages.glob("foosim/**/py.typed"))) == len(PACKAGES)
    learning = installed.packages / "foosim" / "library" / "table" / "learning"
    assert (learning / "table.yaml").read_text() == (ROOT / "deploy" / "table.yaml").read_text()
    scripts = re.findall(r"^(foosim[\w-]*) = ", (ROOT / "pyproject.toml").read_text(), re.MULTILINE)
    assert "foosim" in scripts
    assert not [script for script in scripts if not (installed.commands / script).is_file()]
    assert "Usage" in run(installed.commands / "foosim", "--help", cwd=tmp_path)


@pytest.mark.parametrize(
    ("names", "shows"),
    [
        (("powers.py", "low_pass.py"), "score"),
        (("laps.py", "service.py"), "laps"),
        (("omni.py",), "world"),
        (("yards.py",), "world"),
    ],
)
def test_the_guides_examples_run_from_an_empty_folder(
    installed: Installed, tmp_path: Path, names: tuple[str, ...], shows: str
) -> None:
    """Each file as the guide has it, those of one deployment together, the package as pip installs it."""
    use, files = USES[names[0]], examples()
    needed = {*names, *use.files}
    for name in needed:
        (tmp_path / name).write_text(files[name])
    if use.is_package:
        (tmp_path / PACKAGE).write_text(files[PACKAGE])
        pip = sys.executable, "-m", "pip", "--python", installed.commands / "python", "install"
        run(*pip, "--no-deps", "--no-index", "--no-build-isolation", "--target", "packages", ".", cwd=tmp_path)
        for name in needed - {use.deployment}:
            (tmp_path / name).unlink()
    if use.deployment not in needed:
        shutil.copy(ROOT / use.deployment, tmp_path)
    folder = tmp_path / "packages" if use.is_package else tmp_path
    sets = [word for name in names for word in USES[name].arguments]
    deployment, command = Path(use.deployment).name, installed.commands / "foosim"
    options = [deployment, "--set", "engine=pure", *sets, "--for", "400ms", "--json"]
    result = json.loads(run(command, "rehearse", *options, cwd=tmp_path, PYTHONPATH=str(folder)))
    assert result["ticks"] > 0 and not result["failed"] and shows in result


@pytest.fixture(scope="module")
def compiled_runs(installed: Installed, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Captures of the runs, by one process of the wheel."""
    folder = tmp_path_factory.mktemp("compiled")
    run(installed.commands / "python", "-c", REHEARSALS, ROOT / "deploy", json.dumps(RUNS), cwd=folder)
    return folder


@pytest.mark.skipif(not HAS_COMPILER, reason="no C compiler here")
@pytest.mark.parametrize("name", RUNS)
def test_compiled_and_interpreted_are_one_world(
    installed: Installed, compiled_runs: Path, tmp_path: Path, name: str
) -> None:
    """Equal frames, fates and rows, to the last bit."""
    for compiled in ("world/rays/spans", "kernels/_kernels"):
        assert list(installed.packages.glob(f"foosim/{compiled}.*.so"))
    (file, ticks, sets), capture = RUNS[name], tmp_path / "interpreted.mcap"
    deployment = ROOT / "deploy" / file
    rehearse(deployment.read_text(), file, ticks, None, sets, capture=capture, folder=deployment.parent)
    found = diff_captures(compiled_runs / f"{name}.mcap", capture)
    assert found.equal, found


@pytest.mark.skipif(not HAS_COMPILER, reason="no C compiler here")
def test_benches_measure_what_is_compiled(installed: Installed) -> None:
    """Methods of a compiled class cannot be replaced, and not every one may be derived from."""
    program = "from bench import fleet, table_one_process as table, verdict;"
    program += "rows = table.table_one_process(0.1, 1); print(*table.lines(rows), is_compiled());"
    program = f"from foosim.protocol.fingerprint import is_compiled; {program}"
    shown = run(installed.commands / "python", "-c", program, cwd=ROOT)
    assert "players" in shown and "supervisor" in shown and shown.endswith("True\n")


def test_without_a_c_compiler_the_source_is_installed_alone(tmp_path: Path) -> None:
    """Half of the compiled modules would not import. One is tried here, whose package imports nothing: mypyc has little
    to read."""
    source = tmp_path / "source"
    copy_source(source)
    (source / "door" / "__init__.py").write_text("")
    project = source / "pyproject.toml"
    before, table, _ = project.read_text().partition("[tool.foosim.compiled]\n")
    assert table
    project.write_text(f'{before}{table}"common/keyed_random" = ""\n')
    build = sys.executable, "-m", "build", "--no-isolation", "--wheel", "--outdir", tmp_path
    assert "foosim gets no compiled modules" in run(*build, cwd=source, CC="/nowhere/cc", FOOSIM_COMPILE="auto")
    (wheel,) = tmp_path.glob("*.whl")
    names = run(sys.executable, "-m", "zipfile", "--list", wheel, cwd=tmp_path)
    assert "foosim/common/keyed_random.py" in names and ".so" not in names
    for choice, says in {"always": "/nowhere/cc", "perhaps": "it can be auto, always, quick, never"}.items():
        environment = {**os.environ, "CC": "/nowhere/cc", "FOOSIM_COMPILE": choice}
        done = subprocess.run(build, cwd=source, capture_output=True, text=True, check=False, env=environment)
        assert done.returncode and says in done.stdout + done.stderr
