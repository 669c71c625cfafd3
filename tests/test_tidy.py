"""The rules of the house, as tests: who may import whom, what stays pure, how long things get.

They read the source as text and syntax trees, and import nothing of it, apart from the last one.
A rule that is in the way is changed here, in one place, with its reason.
"""

import ast
import importlib
import re
import tomllib
from collections import Counter
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parent.parent
PYPROJECT: dict[str, Any] = tomllib.loads((ROOT / "pyproject.toml").read_text())
LINES_OF_A_FUNCTION_MAX = 70


# The packages from the top to the bottom: each may import what stands below it. Those in one line do not import each
# other.
ORDER: list[set[str]] = [
    {"cli", "door"},
    {"console"},
    {"launcher", "simulation"},
    {"analysis", "fitting"},
    {"vhub", "library", "gateways"},
    {"supervisor", "node", "client"},
    {"capture"},
    {"runtime"},
    {"protocol"},
    {"deployment", "rendering"},
    {"world"},
    {"common", "kernels"},
]
LEVELS = {package: level for level, packages in enumerate(ORDER) for package in packages}
PACKAGES = sorted(LEVELS)

# The files, mostly one, that know a library which would otherwise spread.
ONLY_IN = {
    "zenoh": {"runtime/transport/session.py"},
    "pybullet": {"node/physics/bullet_client.py"},
    "mujoco": {"node/physics/mujoco_model.py", "world/bodies/mjcf.py"},  # and reads its own format
    "websockets": {"console/server/server.py"},
}

# The files that touch the world. Every other module is a core: it gets messages and the time and returns what to do,
# which is why rehearsal can run all of them in one process on virtual time.
SHELLS = {
    "client/requests.py",
    "client/loading.py",
    "client/client.py",
    "client/main.py",
    "client/replay_listener.py",
    "fitting/main.py",
    "cli/morse.py",
    "gateways/builder/record.py",
    "gateways/builder/script.py",
    "gateways/lines.py",
    "gateways/main.py",
    "gateways/socket.py",
    "gateways/supervision.py",
    "gateways/text.py",
    "gateways/yarp/__init__.py",
    "gateways/yarp/name_server.py",
    "gateways/yarp/ports.py",
    "capture/index.py",
    "console/clock/comparing.py",
    "console/clock/deck.py",
    "console/recorded/capture_source.py",
    "console/live/live_source.py",
    "console/live/sending.py",
    "console/recorded/replay_source.py",
    "console/recorded/poses_source.py",
    "console/recorded/recording.py",
    "console/recorded/second.py",
    "console/server/server.py",
    "console/server/serving.py",
    "node/physics/mesh_trial.py",
    "node/main.py",
    "deployment/assets.py",
    "deployment/packages.py",
    "door/_capture.py",
    "door/_rehearse.py",
    "door/_sweep.py",
    "deployment/text/files.py",
    "runtime/transport/certificate_files.py",
    "runtime/transport/certificate_folder.py",
    "runtime/transport/certificates.py",
    "runtime/command.py",
    "runtime/disk.py",
    "runtime/file_cache.py",
    "runtime/transport/inbox.py",
    "runtime/journal.py",
    "runtime/roles/loop.py",
    "runtime/health.py",
    "runtime/systemd.py",
    "runtime/process.py",
    "runtime/roles/shell.py",
    "library/table/players/gamepad.py",
    "library/table/players/keyboard.py",
    "runtime/keys.py",
    "node/physics/quiet.py",
    "runtime/transport/session.py",
    "runtime/transport/tls_probe.py",
    "common/wall_clock.py",
    "simulation/attendant.py",
    "cli/capture/options.py",
    "cli/capture/export.py",
    "capture/diff.py",
    "capture/export.py",
    "capture/new_file.py",
    "capture/pictures.py",
    "analysis/picture.py",
    "simulation/play/main.py",
    "cli/capture/play.py",
    "simulation/play/address_file.py",
    "simulation/play/terminal.py",
    "simulation/run.py",
    "simulation/match/game.py",
    "simulation/study/run.py",
    "simulation/study/study.py",
    "simulation/study/sweep.py",
    "simulation/study/table.py",
    "simulation/workers.py",
    "cli/executor.py",
    "cli/sweep.py",
    "cli/sweep_results.py",
    "cli/match/command.py",
    "simulation/env/__init__.py",
    "simulation/env/episodes.py",
    "simulation/simulation.py",
    "library/table/learning/exercises.py",
    "cli/rehearse.py",
    "cli/capture/command.py",
    "cli/capture/report.py",
    "cli/view.py",
    "cli/capture/what_if.py",
    "simulation/verify.py",
    "runtime/early_signals.py",
    "cli/up.py",
    "cli/check.py",
    "cli/verbs.py",
    "launcher/console_child.py",
    "client/control.py",
    "launcher/display.py",
    "cli/guard.py",
    "launcher/hosts.py",
    "launcher/begin.py",
    "launcher/doctor.py",
    "cli/doctor.py",
    "launcher/processes.py",
    "launcher/resume.py",
    "supervisor/main.py",
    "launcher/liveness.py",
    "cli/net.py",
    "launcher/plan.py",
    "launcher/outcome.py",
    "launcher/pki.py",
    "cli/pki.py",
    "runtime/run_folder.py",
    "launcher/run_options.py",
    "cli/roles.py",
    "cli/run.py",
    "launcher/commands.py",
    "launcher/up.py",
    "capture/start_frame.py",
    "capture/contents.py",
    "capture/cut.py",
    "capture/file.py",
    "capture/info.py",
    "capture/left.py",
    "capture/parts.py",
    "capture/reader.py",
    "vhub/recording/recovery.py",
    "capture/split.py",
    "capture/writer.py",
    "vhub/recording/recorder.py",
    "vhub/main.py",
    "vhub/recording/disk_watch.py",
}
# What a core does not import: clocks, sockets, files, threads, dice.
IMPURE = {
    *("asyncio", "concurrent", "datetime", "fcntl", "mmap", "multiprocessing", "os", "pathlib", "queue", "random"),
    *("secrets", "select", "selectors", "shutil", "signal", "socket", "subprocess", "tempfile", "threading", "time"),
    *("uuid", "zenoh"),
}
# What is made once for all threads of a process is made under a lock.
MAY_LOCK = {"protocol/codec.py"}


@cache
def tree_of(path: Path) -> ast.Module:
    """The syntax tree of a file."""
    return ast.parse(path.read_text(), str(path))


@cache
def nodes_of(path: Path) -> tuple[ast.AST, ...]:
    """All nodes of that tree: most rules look at each."""
    return tuple(ast.walk(tree_of(path)))


def python_files(*folders: str) -> list[Path]:
    """All Python files in the folders, without caches."""
    return sorted(path for folder in folders for path in (ROOT / folder).rglob("*.py"))


def name_of(path: Path) -> str:
    """The file's name as seen from the top of the repository."""
    return path.relative_to(ROOT).as_posix()


@cache
def imports_of(path: Path) -> tuple[tuple[int, str], ...]:
    """Line and full dotted name of every import in a file, at any depth of nesting."""
    return tuple(_imports_of(path))


def _imports_of(path: Path) -> Iterator[tuple[int, str]]:
    for node in nodes_of(path):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{name_of(path)}:{node.lineno}: a relative import; write foosim.… in full"
            yield from ((node.lineno, f"{node.module}.{alias.name}") for alias in node.names)


def modules() -> list[str]:
    """The dotted names of all modules and packages under foosim."""
    dotted = (".".join(("foosim", *path.relative_to(ROOT).with_suffix("").parts)) for path in python_files(*PACKAGES))
    return [name.replace("foosim.door", "foosim").removesuffix(".__init__") for name in dotted]


SOURCES = python_files(*PACKAGES)
ALL_FILES = python_files(*PACKAGES, "tests", "bench", "examples")


def edges() -> dict[str, set[str]]:
    """The files that each file imports, at any depth of nesting and for types alone, too."""
    known = {module: name_of(path) for module, path in zip(modules(), SOURCES, strict=True)}
    found: dict[str, set[str]] = {}
    for path in SOURCES:
        imported = found[name_of(path)] = set()
        for _, name in imports_of(path):
            module = name if name in known else name.rpartition(".")[0]
            if module in known and known[module] != name_of(path):
                imported.add(known[module])
    return found


def circles(graph: dict[str, set[str]]) -> list[list[str]]:
    """The strongly connected components of a graph that have more than one member (Tarjan 1972)."""
    index: dict[str, int] = {}
    lowest: dict[str, int] = {}
    stack: list[str] = []
    found: list[list[str]] = []

    def visit(node: str) -> None:
        index[node] = lowest[node] = len(index)
        stack.append(node)
        for other in sorted(graph.get(node, ())):
            if other not in index:
                visit(other)
            if other in stack:
                lowest[node] = min(lowest[node], lowest[other])
        if lowest[node] == index[node]:
            place = stack.index(node)
            component = stack[place:]
            del stack[place:]
            if len(component) > 1:
                found.append(sorted(component))

    for node in sorted(graph):
        if node not in index:
            visit(node)
    return found


def test_packages_import_downwards() -> None:
    wrong = [
        f"{file}: {file.split('/')[0]} may not import {imported}"
        for file, all_imported in edges().items()
        for imported in sorted(all_imported)
        if imported.split("/")[0] != file.split("/")[0]
        if LEVELS[imported.split("/")[0]] <= LEVELS[file.split("/")[0]]
    ]
    assert not wrong, "\n".join(wrong)


def test_no_file_and_no_folder_imports_itself_through_others() -> None:
    files = edges()
    folders: dict[str, set[str]] = {}
    for file, imported in files.items():
        folder = file.rpartition("/")[0]
        folders.setdefault(folder, set()).update(other.rpartition("/")[0] for other in imported)
        folders[folder].discard(folder)
    assert circles(files) == []
    assert circles(folders) == []


def test_imports_are_under_foosim() -> None:
    bare = [
        f"{name_of(path)}:{line}: import foosim.{name}"
        for path in ALL_FILES
        for line, name in imports_of(path)
        if name.split(".")[0] in PACKAGES
    ]
    assert not bare, "\n".join(bare)


@pytest.mark.parametrize("library", sorted(ONLY_IN))
def test_a_library_is_known_to_its_files(library: str) -> None:
    importers = {name_of(path) for path in SOURCES for _, name in imports_of(path) if name.split(".")[0] == library}
    assert importers == ONLY_IN[library]


def test_cores_are_pure() -> None:
    wrong = []
    for path in SOURCES:
        if name_of(path) in SHELLS:
            continue
        for line, name in imports_of(path):
            if name.split(".")[0] in IMPURE and not (name == "threading.Lock" and name_of(path) in MAY_LOCK):
                wrong.append(f"{name_of(path)}:{line}: imports {name}")
        for node in nodes_of(path):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in {"open", "input"}:
                wrong.append(f"{name_of(path)}:{node.lineno}: calls {node.func.id}()")
    assert not wrong, "\n".join(wrong)


def test_each_shell_exists_and_is_no_core() -> None:
    """A name left over in SHELLS would let the next file of that name be impure."""
    assert {shell for shell in SHELLS if not (ROOT / shell).is_file() or shell.endswith("/core.py")} == set()


def test_no_running_random_generator() -> None:
    """A draw depends on its key alone (foosim.common.keyed_random); a generator also depends on who drew before."""
    wrong = []
    for path in SOURCES:
        uses = [
            *imports_of(path),
            *((node.lineno, ast.unparse(node)) for node in nodes_of(path) if isinstance(node, ast.Attribute)),
        ]
        generators = re.compile(r"(random|secrets|np\.random|numpy\.random)\b")
        wrong += [f"{name_of(path)}:{line}: {name}" for line, name in uses if generators.match(name)]
    assert not wrong, "\n".join(wrong)


# What numpy hands to BLAS and LAPACK, or sums in an order of its own, by attributes of its modules and arrays.
INEXACT = {"dot", "vdot", "inner", "matmul", "tensordot", "einsum", "linalg", "polyfit", "cov", "corrcoef"}
ARRAYS = {"np", "numpy"}


def test_no_blas_and_no_lapack() -> None:
    """Their bits differ from one library, processor and count of rows to the next; a world has the same bits
    everywhere. This holds for what a world is made of, and for the fates of packets."""
    wrong = []
    for path in python_files("common", "world", "node", "vhub"):
        wrong += [
            f"{name_of(path)}:{line}: imports {name}"
            for line, name in imports_of(path)
            if name.startswith(("numpy.linalg", "scipy")) or (name.startswith("numpy.") and name[6:] in INEXACT)
        ]
        for node in nodes_of(path):
            if isinstance(node, ast.BinOp | ast.AugAssign) and isinstance(node.op, ast.MatMult):
                wrong.append(f"{name_of(path)}:{node.lineno}: a product of matrices: {ast.unparse(node)}")
            elif isinstance(node, ast.Attribute) and node.attr in INEXACT:
                of = ast.unparse(node.value)
                if of in ARRAYS or of.startswith(("np.", "numpy.")) or node.attr in ("dot", "linalg"):
                    wrong.append(f"{name_of(path)}:{node.lineno}: {of}.{node.attr}")
    assert not wrong, "\n".join(wrong)


def test_functions_are_short() -> None:
    long = [
        f"{name_of(path)}:{node.lineno}: {node.name}"
        for path in ALL_FILES
        for node in nodes_of(path)
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
        if (node.end_lineno or 0) - node.lineno + 1 > LINES_OF_A_FUNCTION_MAX
    ]
    assert not long, "\n".join(long)


def test_every_module_says_what_it_is() -> None:
    silent = [name_of(path) for path in ALL_FILES if not ast.get_docstring(tree_of(path))]
    assert not silent, "\n".join(silent)


def test_nothing_is_there_for_tests_alone() -> None:
    """What protocol, node and vHub define is used, by another line than its own, outside of `tests/`."""
    used = Counter(
        word
        for path in (*SOURCES, *python_files("bench", "docs"))
        for word in re.findall(r"\w+", re.sub(r'"""[\s\S]*?"""', "", path.read_text()))
    )
    idle = [
        f"{name_of(path)}: {name}"
        for path in python_files("protocol", "node", "vhub")
        for node in tree_of(path).body
        for name in _defined(node)
        if not name.startswith("_") and used[name] < 2
        if path.parent.name != "engines"  # the registry imports these by their names
    ]
    assert not idle, "\n".join(idle)


def _defined(node: ast.stmt) -> list[str]:
    """The names that a statement of a module defines."""
    if isinstance(node, ast.FunctionDef | ast.ClassDef):
        return [node.name]
    targets = node.targets if isinstance(node, ast.Assign) else [node.target] if isinstance(node, ast.AnnAssign) else []
    return [target.id for target in targets if isinstance(target, ast.Name)]


def test_nothing_is_left_for_later() -> None:
    later = re.compile(r"\b(TO" + r"DO|FIX" + r"ME|XX" + r"X|HA" + r"CK)\b|NotImplemented" + r"Error|\bfor no" + r"w\b")
    left = [
        f"{name_of(path)}:{number}: {line.strip()}"
        for path in ALL_FILES
        for number, line in enumerate(path.read_text().splitlines(), 1)
        if later.search(line)
    ]
    assert not left, "\n".join(left)


def test_tests_are_no_package() -> None:
    """With an __init__.py, pytest would import tests by folder name and tests/node would hide the real node."""
    assert not list((ROOT / "tests").rglob("__init__.py"))


def compiled() -> dict[str, ast.Module]:
    """The modules that setup.py compiles, by dotted name, as syntax trees."""
    named: dict[str, str] = PYPROJECT["tool"]["foosim"]["compiled"]
    assert list(named) == sorted(named), "in order"
    paths = [ROOT / f"{name}.py" for name in named]
    return {
        ".".join(("foosim", *path.relative_to(ROOT).with_suffix("").parts)).removesuffix(".__init__"): tree_of(path)
        for path in paths
    }


def test_what_derives_from_a_compiled_class_is_compiled() -> None:
    """An interpreted class cannot: it fails when it is made."""
    modules = compiled()
    wrong = []
    for path in ALL_FILES:
        if tree_of(path) in modules.values():
            continue
        named = {
            alias.asname or alias.name: node.module
            for node in nodes_of(path)
            if isinstance(node, ast.ImportFrom)
            for alias in node.names
        }
        wrong += [
            f"{name_of(path)}:{node.lineno}: {node.name} derives from a class of {named[base.id]}"
            for node in nodes_of(path)
            if isinstance(node, ast.ClassDef)
            for base in node.bases
            if isinstance(base, ast.Name) and named.get(base.id) in modules
            if not is_open(modules[str(named[base.id])], base.id)
        ]
    assert not wrong, "\n".join(wrong)


def is_open(tree: ast.Module, name: str) -> bool:
    """Whether a compiled class says that interpreted ones may derive from it."""
    (found,) = (node for node in tree.body if isinstance(node, ast.ClassDef) and node.name == name)
    return "allow_interpreted_subclasses" in ast.dump(found)


def test_no_bench_replaces_what_is_compiled() -> None:
    """`make bench` runs compiled: a class's methods cannot be replaced there, and what replaces a module's function is
    not called."""
    modules = compiled()
    wrong = []
    for path in python_files("bench"):
        named = {
            alias.asname or alias.name
            for node in ast.walk(tree_of(path))
            if isinstance(node, ast.ImportFrom)
            for alias in node.names
            if node.module in modules or f"{node.module}.{alias.name}" in modules
        }
        wrong += [
            f"{name_of(path)}:{target.lineno}: {ast.unparse(target)}"
            for target in replaced(tree_of(path))
            if root_of(target) in named or any(root_of(target).startswith(module) for module in modules)
        ]
    assert not wrong, "\n".join(wrong)


def replaced(tree: ast.Module) -> Iterator[ast.expr]:
    """Yield what a module assigns or deletes attributes of, and what it has `mock` or `setattr` replace."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store | ast.Del):
            yield node.value
        elif (
            isinstance(node, ast.Call)
            and node.args
            and re.search(r"\b(patch|setattr|delattr)\b", ast.unparse(node.func))
        ):
            yield node.args[0]


def root_of(expression: ast.expr) -> str:
    """Return the name that an expression begins with, or the text that it is."""
    while isinstance(expression, ast.Attribute):
        expression = expression.value
    if isinstance(expression, ast.Constant):
        return str(expression.value)
    return expression.id if isinstance(expression, ast.Name) else ""


def test_no_compiled_constant_is_a_tuple_of_floats_of_a_fixed_length() -> None:
    """Those of mypyc 2.4 count as not set."""
    fixed = re.compile(r"Final(?!.*\.\.\.).*")
    wrong = [
        f"{module}:{node.lineno}: {ast.unparse(node.target)}"
        for module, tree in compiled().items()
        for node in tree.body
        if isinstance(node, ast.AnnAssign) and isinstance(node.value, ast.Tuple)
        if fixed.fullmatch(ast.unparse(node.annotation)) and are_floats(node.value.elts)
    ]
    assert not wrong, "\n".join(wrong)


def are_floats(values: list[ast.expr]) -> bool:
    """Whether all look like numbers of which one is no whole one."""
    whole = [isinstance(value, ast.Constant) and not isinstance(value.value, float) for value in values]
    nested = any(isinstance(value, ast.Tuple | ast.Starred) for value in values)
    return not all(whole) and not nested


def test_every_package_folder_is_in_the_wheel() -> None:
    folders = sorted({path.parent.relative_to(ROOT) for path in SOURCES})
    setuptools = PYPROJECT["tool"]["setuptools"]
    named = sorted(".".join(("foosim", *folder.parts)).removesuffix(".door") for folder in folders)
    assert setuptools["packages"] == named
    dirs = {f"foosim.{package}".removesuffix(".door"): package for package in PACKAGES}
    assert list(setuptools["package-dir"].items()) == sorted(dirs.items())
    assert [folder for folder in folders if not (ROOT / folder / "__init__.py").is_file()] == []
    assert [package for package in PACKAGES if not (ROOT / package / "py.typed").is_file()] == []


def test_the_makefile_links_every_package_for_the_type_checker() -> None:
    line = re.search(r"^PACKAGES := (.*)$", (ROOT / "Makefile").read_text(), re.MULTILINE)
    assert line is not None
    assert line[1].split() == PACKAGES


@pytest.mark.parametrize("script", sorted(PYPROJECT["project"]["scripts"]))
def test_each_command_has_its_function(script: str) -> None:
    module, _, function = PYPROJECT["project"]["scripts"][script].partition(":")
    assert callable(getattr(importlib.import_module(module), function))
