"""The door: what `import foosim` has, and that nothing else is needed by who writes programs and components."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from pathlib import Path
from typing import Final

import pytest

import foosim
from foosim import components, env, gateway
from foosim.capture.mcap.checks import CaptureError
from foosim.common.errors import BadValue
from foosim.runtime.run_folder import NoRun

ROOT: Final = Path(__file__).parents[2]
TABLE: Final = ROOT / "deploy" / "table.yaml"
DOOR: Final = {"foosim", "foosim.components", "foosim.env", "foosim.gateway"}
CODE: Final = re.compile(r"^```py(?:thon)?\n(.*?)^```$", re.MULTILINE | re.DOTALL)
QUICK: Final = ("engine=pure", "substeps=1")
TICKS: Final = 60


@pytest.mark.parametrize("module", [foosim, components, env, gateway], ids=lambda module: module.__name__)
def test_each_name_is_there(module: object) -> None:
    names: list[str] = module.__all__  # type: ignore[attr-defined]
    assert len(names) == len({*names})
    assert [name for name in names if getattr(module, name, None) is None] == []


def test_it_lists_its_names() -> None:
    assert sorted(dir(foosim)) == sorted(foosim.__all__)


def test_the_import_itself_imports_nothing(tmp_path: Path) -> None:
    program = "import sys; before = {*sys.modules}; import foosim; dir(foosim); print(*{*sys.modules} - before)"
    done = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["foosim"]


def test_a_wrong_name_is_python_s_own_error_with_the_nearest(tmp_path: Path) -> None:
    program = "import foosim; foosim.Simulaton"
    done = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.stderr.splitlines()[-1] == (
        "AttributeError: module 'foosim' has no attribute 'Simulaton'. Did you mean: 'Simulation'?"
    )


def imports_in(source: str) -> list[str]:
    """The modules of foosim that a program imports, or has Gymnasium import."""
    found = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.ImportFrom):
            found.append(str(node.module))
        elif isinstance(node, ast.Import):
            found += [alias.name for alias in node.names]
        elif isinstance(node, ast.Constant) and ":foosim/" in str(node.value):
            found.append(str(node.value).partition(":")[0])
    return [name for name in found if name.partition(".")[0] == "foosim"]


def test_examples_and_pages_import_nothing_deeper() -> None:
    sources = {path: [path.read_text()] for path in sorted((ROOT / "examples").rglob("*.py"))}
    for page in (ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))):
        sources[page] = CODE.findall(page.read_text())
    found = [(path, name) for path, texts in sources.items() for text in texts for name in imports_in(text)]
    deeper = [f"{path.relative_to(ROOT)}: {name}" for path, name in found if name not in DOOR]
    assert len(found) > 15 and deeper == []


# --- what its own functions do ----------------------------------------------------------------------------------------


def digests(*events: str, nodes: int = 3, **more: str | Path) -> list[bytes]:
    found = foosim.rehearse(TABLE, TICKS, nodes, events, sets=QUICK, **more)  # type: ignore[arg-type]
    assert not found.json["failed"], found.json["reason"]
    assert len(found.digests) == TICKS
    return found.digests


def test_events_of_a_rehearsal_change_nodes_and_leave_the_world_as_it_is(tmp_path: Path) -> None:
    calm, path = digests(nodes=1), tmp_path / "run.mcap"
    events = (
        *("kill n2 for 300 ms at 20 ms", "move red.goal to n3 at 30 ms", "cut n3 for 2 s at 40 ms"),
        *("kill n1 at 101 ms", "kill player-red for 5 ms at 60 ms"),
    )
    assert digests(*events[:-1], capture=path) == calm
    capture = foosim.open_capture(path)
    assert {lost.name for lost in capture.recoveries} >= {"n1", "n2", "n3"}
    assert {owner.robot: owner.node for epoch in capture.epochs for owner in epoch.owners}["red.goal"] != "n1"
    assert capture.finished and capture.info().ticks == TICKS
    assert capture.verify().equal and len(capture.packets) and len(capture.frames) == len(capture.frame_ticks)
    assert capture.poses("red.goal").positions.shape == (len(capture.frames), 3)
    found = foosim.rehearse(TABLE, TICKS, 2, events[-1:], sets=QUICK)
    assert [lost["what"] for lost in found.json["recoveries"]] == ["player"]


@pytest.mark.parametrize(
    ("event", "text"),
    [
        ("kil n2 at 1 s", "no event: write kill NAME [for TIME] at TIME, cut NODE for TIME at TIME, or move ROBOT to"),
        ("cut n2 at 1 s", "no event: "),
        ("move red.goal at 1 s", "no event: "),
        ("kill n2 to n1 at 1 s", "no event: "),
        ("kill n2", "no event: "),
        ("kill n9 at 1 s", "kill n9 at 1 s: no such node or player (there are: n1, n2, player-blue, player-red), 'n9'"),
        ("cut player-red for 1 s at 1 s", "cut player-red for 1 s at 1 s: no such node (there are: n1, n2)"),
        ("move red.gaol to n1 at 1 s", "move red.gaol to n1 at 1 s: no such robot"),
        ("move red.goal to n3 at 1 s", "move red.goal to n3 at 1 s: no such node"),
        ("kill n2 at noon", "kill n2 at noon: not a time"),
        ("kill n2 for ever at 1 s", "kill n2 for ever at 1 s: not a time"),
    ],
)
def test_what_is_no_event_is_refused_before_the_rehearsal(event: str, text: str) -> None:
    with pytest.raises(BadValue) as error:
        foosim.rehearse(TABLE, TICKS, 2, ["kill n1 at 20 ms", event], sets=QUICK)
    assert str(error.value).startswith(text)


@pytest.mark.parametrize(
    ("events", "text"),
    [
        (["kill n2 at 1 h"], "this event did not happen: the rehearsal ended before, 'kill n2 at 1 h'"),
        (["kill n2 at 10 ms", "kill n2 at 20 ms"], "this event did not happen: n2 was away, 'kill n2 at 20 ms'"),
        (["kill n2 at 10 ms", "move red.goal to n2 at 20 ms"], "this event did not happen: no node 'n2'; there are n1"),
    ],
)
def test_an_event_that_does_not_happen_is_an_error(events: list[str], text: str) -> None:
    with pytest.raises(BadValue) as error:
        foosim.rehearse(TABLE, 30, 2, events, sets=QUICK)
    assert str(error.value).startswith(text)


def test_a_rehearsal_continues_a_capture(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    whole = digests(capture=path)
    rest = foosim.rehearse(TABLE, 10, 2, sets=QUICK, start=f"{path}@80ms").json
    assert (rest["first_tick"], len(whole)) == (40, TICKS)


def test_a_deployment_is_loaded_with_changes() -> None:
    assert foosim.load_deployment(TABLE, sets=["seed=7"]).seed == 7


def test_a_file_that_is_no_capture_is_refused(tmp_path: Path) -> None:
    (tmp_path / "none.mcap").write_bytes(b"none")
    with pytest.raises(CaptureError):
        foosim.open_capture(tmp_path / "none.mcap")


def test_a_client_finds_runs_by_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    with pytest.raises(NoRun, match="no run is live"):
        foosim.connect("run:newest", "hand")
    with pytest.raises(NoRun, match="no run 'evening'"):
        foosim.connect("run:evening", "hand")
