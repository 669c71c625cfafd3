"""The README and the docs are true: their code runs, their commands parse, their files, names and options exist.

What stands in the tutorials is extracted and run as a reader would run it, through the rehearsal on the pure engine.
The generated parts of the docs are those that docs/generate.py writes today.
"""

from __future__ import annotations

import ast
import importlib.util
import json
import re
import shlex
import sys
import tomllib
from collections.abc import Iterator
from functools import cache, reduce
from pathlib import Path
from types import ModuleType
from typing import Any, Final

import pytest

from foosim.capture.reader import open_capture
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.deployment.text.yaml import locate_in, plain, read_tree
from foosim.launcher.plan import make_plan
from foosim.launcher.run_options import RunOptions
from foosim.library.table.rod_position import Command
from foosim.simulation.run import rehearse
from foosim.simulation.study.study import read_study, seeds_of, study_of
from foosim.simulation.system import System
from foosim.world.component_types.per_field import codec_of
from foosim.world.component_types.registry import find_component

ROOT: Final = Path(__file__).parents[1]
FRONT: Final = [ROOT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")]
PAGES: Final = [*FRONT, *sorted((ROOT / "docs").rglob("*.md"))]
FIRST_PLAYER: Final = ROOT / "docs" / "tutorials" / "first_player.md"
PYPROJECT: Final = tomllib.loads((ROOT / "pyproject.toml").read_text())
PACKAGES: Final = tuple(PYPROJECT["tool"]["setuptools"]["package-dir"].values())
OTHER_OPTIONS: Final = {
    "--help",
    "--install-completion",
    "--version",
    "--strict",
    "--hypothesis-profile",
    "--only",
    "--slow-start",
    "--load",
    "--record-seconds",
    "--rename",
}
"""Options that belong to no command of ours, or to all."""

pages = pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)


@cache
def reference() -> ModuleType:
    """docs/generate.py as a module."""
    spec = importlib.util.spec_from_file_location("reference", ROOT / "docs" / "generate.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def blocks(page: Path, language: str) -> list[str]:
    """The fenced blocks of a language."""
    return re.findall(rf"^```{language}\n(.*?)^```$", page.read_text(), re.MULTILINE | re.DOTALL)


def spans(page: Path) -> list[str]:
    """What stands between backquotes in the text."""
    text = re.sub(r"^```.*?^```$", "", page.read_text(), flags=re.MULTILINE | re.DOTALL)
    return re.findall(r"`([^`\n]+)`", text)


def typed_lines(page: Path) -> list[list[str]]:
    """The command lines of foosim in a page's blocks, as words, without what stands before and behind them."""
    indented = [line[4:] for line in page.read_text().splitlines() if line.startswith("    ")]
    lines = "\n".join([*blocks(page, "sh"), *indented]).replace("\\\n", " ").splitlines()
    words = [shlex.split(line, comments=True) for line in lines if re.search(r"(^|=\. )foosim [a-z]+", line)]
    return [line[line.index("foosim") :] for line in words]


@cache
def commands() -> dict[str, Any]:
    """Every command that can be typed, with what typer knows of it."""
    return dict(reference().commands())


def command_of(words: list[str]) -> tuple[Any, list[str]]:
    """What typer knows of the command that is typed, and its arguments."""
    known = commands()
    for used in (3, 2):
        if " ".join(words[:used]) in known:
            return known[" ".join(words[:used])], words[used:]
    raise AssertionError(f"no command {' '.join(words)}; there are {', '.join(known)}")


# --- the tutorials ---------------------------------------------------------------------------------------------------


def add_a_ball(system: System) -> None:
    """What a reader reads may have had something added to it, for a while."""
    system.at_tick(1000, lambda: system.request("add", name="ball", at="0,0.3,0.05"))
    system.at_tick(1200, lambda: system.request("remove", name="ball-2"))


@pytest.fixture(scope="module")
def house(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A reader's folder: deploy/table.yaml, the README's player, and the capture of its first game."""
    folder = tmp_path_factory.mktemp("house")
    (folder / "deploy").symlink_to(ROOT / "deploy")
    (player,) = blocks(FIRST_PLAYER, "python")
    (folder / "follower.py").write_text(player)
    (words,) = typed_lines(FIRST_PLAYER)
    command, arguments = command_of(words)
    asked = command.make_context("readme", arguments).params
    assert asked["engine"] == "pure"
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.syspath_prepend(str(folder))
        plan = make_plan(RunOptions(asked["file"], "fast", asked["duration"], sets=tuple(asked["sets"]), engine="pure"))
        given = plan.text, str(asked["file"]), plan.ticks, asked["nodes"]
        result = rehearse(*given, prepare=add_a_ball, capture=asked["capture"]).json
        assert not result["failed"] and result["ticks"] == 2500
        yield folder
    sys.modules.pop("follower", None)


def test_the_readmes_player_plays(house: Path) -> None:
    """It commands its four rods, swings back and kicks, and its rods meet the ball."""
    capture = open_capture(house / "follower.mcap")
    sent = capture.packets.where(capture.packets.source == "player-red")
    rods = [f"red.{line}" for line in ("goal", "defence", "midfield", "attack")]
    assert set(sent.destination) == set(rods)
    codec = codec_of(find_component("actuator", "rod_position"))
    commands: list[Command] = [codec.decode(payload) for payload in sent.payload]
    assert {command.spin for command in commands} == {0.5, -1.2}
    assert any(capture.frames.column(rod, "contacts", 1).any() for rod in rods)
    absent = capture.frames.column("ball-2", "absent")
    assert (absent[0], absent.min(), absent[-1]) == (1.0, 0.0, 1.0), "something was added, and removed again"


@pytest.mark.parametrize(
    "name",
    [
        "docs/how-to/use_a_capture.md",
        "docs/reference/capture.md",
        "docs/how-to/write_a_player.md",
    ],
)
def test_the_code_runs(house: Path, capsys: pytest.CaptureFixture[str], name: str) -> None:
    """Each page's last block of Python; it prints what it found."""
    program = blocks(ROOT / name, "python")[-1]
    exec(compile(program, name, "exec"), {"__name__": "page"})
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) >= program.count("print(") >= 1


@pytest.mark.parametrize(
    ("name", "number", "shorter"),
    [
        ("docs/reference/python.md", 0, {}),
        ("docs/reference/python.md", 1, {}),
        ("docs/reference/python.md", -1, {}),
        ("docs/tutorials/learn_to_defend.md", 0, {"range(20)": "range(2)"}),
    ],
)
def test_the_code_of_learning_runs(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    name: str,
    number: int,
    shorter: dict[str, str],
) -> None:
    """In a shorter form: fewer shots."""
    program = blocks(ROOT / name, "python")[number]
    for written, run in shorter.items():
        assert written in program
        program = program.replace(written, run)
    monkeypatch.chdir(ROOT)
    exec(compile(program, name, "exec"), {"__name__": "__main__"})
    assert len(capsys.readouterr().out.splitlines()) >= 1


def test_the_cells_of_the_notebook_run_in_their_order(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """With shorter runs, in one process beside this one."""
    shorter = {'"1s"': '"200ms"', "ticks=500": "ticks=100", "jobs=2": "jobs=1"}
    (tmp_path / "deploy").symlink_to(ROOT / "deploy")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "Agg")
    page = ROOT / "docs" / "tutorials" / "notebook.md"
    names: dict[str, Any] = {"__name__": "notebook"}
    for cell in blocks(page, "python"):
        program = reduce(lambda text, change: text.replace(*change), shorter.items(), cell)
        exec(compile(program, page.name, "exec"), names)
    shown = capsys.readouterr().out
    assert "'dealy', nearest is 'delay'" in shown and "8 of 8 runs\n" in shown
    assert names["means"].loc["20ms", "0%"] - names["means"].loc["0ms", "0%"] == pytest.approx(20.0, abs=1.0)
    assert (tmp_path / "radio.png").stat().st_size > 10_000 and len(names["ball"]) == 11
    names["plt"].close("all")


def test_the_study_file_of_the_page_is_valid(tmp_path: Path) -> None:
    (tmp_path / "deploy").symlink_to(ROOT / "deploy")
    (text,) = blocks(ROOT / "docs" / "how-to" / "run_a_study.md", "yaml")
    (tmp_path / "study.yaml").write_text(text)
    found = read_study(tmp_path / "study.yaml")
    assert found is not None
    file, seeds = tmp_path / found.deployment, seeds_of(str(found.seeds))
    study = study_of(file, found.duration, found.vary, seeds, found.sets)
    assert len(study.combinations) * len(study.seeds) == 120


def test_a_players_declaration_is_valid() -> None:
    table = (ROOT / "deploy" / "table.yaml").read_text()
    classes = []
    for text in blocks(ROOT / "docs" / "how-to" / "write_a_player.md", "yaml"):
        tree, _ = read_tree(text, locate_in("page"))  # not PyYAML's own: there the key `on` would be true
        assert tree is not None
        content: Any = plain(tree)
        ((name, declared),) = content["players"].items()
        changed = apply_sets(table, "table.yaml", [f"players.{name}={json.dumps(declared)}"])
        classes.append(load_deployment(changed, "table.yaml").players[name].class_)
    assert classes == ["follower:Follower", "scouting:Scout", "follower:Follower"]


# --- what is named exists --------------------------------------------------------------------------------------------


@pages
def test_generated_parts_are_current(page: Path) -> None:
    text = page.read_text()
    assert reference().regenerated(text) == text, "write it anew: python docs/generate.py"


NO_DEADLINES = {
    "POLL_S",
    "WATCH_S",
    "_NEVER_NS",
    "LATE_EVERY_NS",
    "AGAIN_S",
    "QUERY_S",
    "SWITCH_S",
    "FORGET_EVERY_NS",
    "LOOK_EVERY_NS",
    "OBSERVED_EVERY_S",
    "STARVED_S",
    "WARNED_EVERY_S",
    "REMINDER_NS",
    "SILENT_NS",
}
"""How often something is done or said again, and what is no wait for another process."""


def test_every_constant_that_waits_for_somebody_is_in_the_table_of_deadlines() -> None:
    told = set(reference().CONSTANTS)
    files = {module: (ROOT / f"{module.replace('.', '/')}.py").read_text() for module, _ in told}
    found = {
        (m, name)
        for m, text in files.items()
        for name in re.findall(r"^([A-Z_]+_(?:NS|MS|US|S)(?:_MAX)?)\b", text, re.M)
    }
    assert {(module, name) for module, name in found - told if name not in NO_DEADLINES} == set()


WAITS = ("acquire", "communicate", "join", "poll", "result", "select", "settimeout", "wait", "wait_for")
"""Methods whose number is how long is waited. How often is looked (`sleep`) is no deadline."""


def test_no_wait_has_its_number_in_its_call() -> None:
    """It would be in no table: a constant with a name is, whose end is its unit."""
    found = []
    for path in sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py")):
        for call in (node for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.Call)):
            named = [k.value for k in call.keywords if re.search(r"timeout|_n?s$|_ms$", k.arg or "")]
            is_wait = isinstance(call.func, ast.Attribute) and call.func.attr in WAITS
            for given in [*named, *(call.args if is_wait else ())]:
                if isinstance(given, ast.Constant) and type(given.value) in (int, float) and given.value:
                    found.append(f"{path.relative_to(ROOT)}:{call.lineno}: {ast.unparse(call)}")
    assert found == []


def test_every_part_that_can_be_generated_stands_in_a_page() -> None:
    text = "".join(page.read_text() for page in PAGES)
    assert sorted(re.findall(r"<!-- generated: ([\w ]+) -->", text)) == sorted(reference().WRITERS)


@pages
def test_command_lines_parse(page: Path) -> None:
    for words in typed_lines(page):
        command, arguments = command_of(words)
        command.make_context(words[0], arguments)


@pages
def test_commands_and_options_exist(page: Path) -> None:
    options = {option for command in commands().values() for one in command.params for option in one.opts}
    named = spans(page)
    for span in named:
        assert not set(re.findall(r"(?<![\w-])--[a-z][a-z-]*", span)) - options - OTHER_OPTIONS, span
    inline = [span.split() for span in named if re.match(r"foosim [a-z]", span)]
    begun = {" ".join(name.split()[:count]) for name in commands() for count in (2, 3)}
    for words in inline:
        if " ".join(words[:3]) not in begun:
            command_of(words)


@pages
def test_targets_of_make_exist(page: Path) -> None:
    targets = set(re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    assert set(re.findall(r"(?:^    |`)make ([a-z]+)", page.read_text(), re.MULTILINE)) <= targets


@cache
def names_in(path: Path) -> frozenset[str]:
    """Everything that a module defines, members of classes as `Class.member`."""
    found = set()
    for node in ast.parse(path.read_text()).body:
        for name in _defined(node):
            found.add(name)
            if isinstance(node, ast.ClassDef):
                found |= {f"{name}.{member}" for inner in node.body for member in _defined(inner)}
    return frozenset(found)


def _defined(node: ast.stmt) -> list[str]:
    if isinstance(node, ast.ClassDef | ast.FunctionDef):
        return [node.name]
    targets = node.targets if isinstance(node, ast.Assign) else [node.target] if isinstance(node, ast.AnnAssign) else []
    return [target.id for target in targets if isinstance(target, ast.Name)]


@cache
def all_names() -> frozenset[str]:
    sources = [path for package in PACKAGES for path in (ROOT / package).rglob("*.py")]
    return frozenset(name for path in sources for name in names_in(path))


@pages
def test_files_and_names_exist(page: Path) -> None:
    missing = []
    for span in spans(page):
        path = re.fullmatch(r"(?P<path>[a-z][\w.-]*(/[\w.-]+)*(/|\.(py|yaml|json|md)))(:(?P<name>[\w.]+))?", span)
        if path is not None and "/" in path["path"]:
            file = ROOT / path["path"]
            if not file.exists() or (path["name"] and path["name"] not in names_in(file)):
                missing.append(span)
        elif re.fullmatch(r"[A-Z][A-Za-z]+\._?[a-z]\w*", span) and span not in all_names():
            missing.append(span)
    assert not missing


def anchors(page: Path) -> set[str]:
    """The anchors of a page's headings, as GitHub makes them of their text."""
    text = re.sub(r"^```.*?^```$", "", page.read_text(), flags=re.MULTILINE | re.DOTALL)
    headings = re.findall(r"^#+ (.+)$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).strip().replace(" ", "-") for heading in headings}


@pages
def test_links_lead_to_pages_and_headings(page: Path) -> None:
    missing = []
    for target, anchor in re.findall(r"\]\(([^)#:\s]*)(?:#([^)]*))?\)", page.read_text()):
        to = page.parent / target if target else page
        if not to.is_file() or (anchor and anchor not in anchors(to)):
            missing.append(f"{target}#{anchor}")
    assert not missing


def test_every_page_is_in_the_index() -> None:
    index = ROOT / "docs" / "README.md"
    links = {(index.parent / target).resolve() for target in re.findall(r"\]\(([^)#:]+)\)", index.read_text())}
    assert links == {page for page in PAGES if page not in FRONT and page != index}


def test_pictures_are_shown_with_what_one_sees_and_stay_small() -> None:
    """Each file is shown on some page, each page shows files that are there, and all together stay below 600 kB."""
    shown = {
        (page.parent / target).resolve()
        for page in PAGES
        for text, target in re.findall(r"!\[([^]]*)\]\(([^)]+)\)", page.read_text())
        if len(text) > 40  # characters: a name is no description
    }
    files = set((ROOT / "docs" / "pictures").iterdir())
    assert shown == files
    assert sum(file.stat().st_size for file in files) < 600_000
