"""Finding the class of a player: what is said of a path that leads to none, and of modules that fail at import."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from foosim.cli.rehearse import app
from foosim.client.errors import PlayerError
from foosim.client.loading import class_faults, load_player
from foosim.common.errors import DeploymentError
from foosim.library.table.players.football import Team

TABLE = Path(__file__).parents[2] / "deploy" / "table.yaml"
OWN = """
from foosim import Player

class Acts(Player):
    def act(self, tick, samples):
        return {}

class Sits:
    pass

class Takes(Acts):
    def __init__(self, deployment):
        pass

class Bare:
    def act(self, tick, samples):
        return {}

class Nothing(Player):
    pass

class Hears(Acts):
    def act(self, tick):
        return {}

number = 3
"""
MODULES = {
    "own_player": OWN,
    "own_broken": "def begin():\n    return 1 / 0\n\nbegin()\n",
    "own_typo": "class Acts:\n    def act(self tick)\n",
    "own_importer": "import own_missing\n",
    "own_leaver": "import sys\nprint('own words')\nsys.exit(0)\n",
    "own_crash": "import os\nos.kill(os.getpid(), 11)\n",
    "own_hang": "import threading\nthreading.Lock().acquire()\nthreading.Event().wait()\n",
}


@pytest.fixture
def modules(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Modules of somebody's own, on the path."""
    for name, source in MODULES.items():
        (tmp_path / f"{name}.py").write_text(source)
        monkeypatch.delitem(sys.modules, name, raising=False)
    monkeypatch.syspath_prepend(tmp_path)
    return tmp_path


CASES = [
    ("own_player", "not of the form module:Class"),
    ("own_player.Acts", "not of the form module:Class, nearest is 'own_player:Acts'"),
    (":Acts", "not of the form module:Class"),
    ("own_playr:Acts", "there is no module own_playr (it is not beside the deployment or on PYTHONPATH),"
     " nearest is 'own_player:Acts'"),
    ("own_player.acts:Acts", "there is no module own_player.acts (own_player is a module, not a package)"),
    ("foosim.library.table.players.footbal:Team",
     "there is no module foosim.library.table.players.footbal, "
     "nearest is 'foosim.library.table.players.football:Team'"),
    ("own_importer:Acts", "cannot be imported: ModuleNotFoundError: No module named 'own_missing'"
     " (own_importer.py:1)"),
    ("own_broken:Acts",
     "cannot be imported: ZeroDivisionError: division by zero (own_broken.py:2)"),
    ("own_typo:Acts",
     "cannot be imported: SyntaxError: invalid syntax (own_typo.py:2)"),
    ("own_leaver:Acts", "cannot be imported: SystemExit: 0 (own_leaver.py:3)"),
    ("own_player:Atcs", "there is no Atcs in own_player (there are: Acts, Bare, Hears, Nothing, Sits, Takes),"
     " nearest is 'own_player:Acts'"),
    ("own_player:Sits", "Sits is no Player (own_player.py:8);"
     " write: from foosim import Player, class Sits(Player):"),
    ("own_player:number", "number is no class, 3"),
    ("own_player:Takes", "Takes cannot be made with (deployment, parameters): its constructor takes (deployment)"),
    ("own_player:Bare", "Bare is no Player (own_player.py:15);"
     " write: from foosim import Player, class Bare(Player):"),
    ("own_player:Hears", "Hears.act cannot be called with (tick, samples): it takes (self, tick)"),
]  # fmt: skip


@pytest.mark.parametrize(("path", "text"), CASES)
def test_a_class_that_cannot_be_loaded_says_why(modules: Path, path: str, text: str) -> None:
    with pytest.raises(PlayerError) as error:
        load_player(path)
    assert str(error.value) == f"player {path}: {text}"


@pytest.mark.usefixtures("modules")
def test_a_class_is_found_by_its_path() -> None:
    assert load_player("foosim.library.table.players.football:Team") is Team
    assert load_player("own_player:Acts").__name__ == "Acts"
    assert load_player("own_player:Nothing")(None, {}).act(0, {}) == {}, "all hooks of a player are empty"


# --- before a run begins ---------------------------------------------------------------------------------------------


@pytest.mark.usefixtures("modules")
def test_all_that_cannot_play_is_found_and_what_modules_print_goes_to_standard_error(
    capfd: pytest.CaptureFixture[str],
) -> None:
    paths = ("own_leaver:A", "own_player:Acts", "own_player:Atcs", "own_player:Sits")
    faults = class_faults(
        (*paths, "foosim.library.table.players.football:Team", "foosim.library.table.players.football:Teem"), 60.0
    )
    assert {path: fault.problem.partition(" (")[0] for path, fault in faults.items()} == {
        "own_leaver:A": "cannot be imported: SystemExit: 0",
        "own_player:Atcs": "there is no Atcs in own_player",
        "own_player:Sits": "Sits is no Player",
        "foosim.library.table.players.football:Teem": "there is no Teem in foosim.library.table.players.football",
    }
    printed = capfd.readouterr()
    assert (printed.out, "own words" in printed.err) == ("", True)


@pytest.mark.parametrize(
    ("module", "code", "place"),
    [("own_hang", 1, 'own_hang.py", line 3 in <module>'), ("own_crash", -11, 'own_crash.py", line 2 in <module>')],
)
def test_a_module_that_hangs_or_crashes_ends_the_process_and_its_stack_is_shown(
    modules: Path, module: str, code: int, place: str
) -> None:
    program = f"from foosim.client.loading import class_faults; class_faults(['{module}:A'], 0.2)"
    environment = {**os.environ, "PYTHONPATH": str(modules)}
    done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, place in done.stderr) == (code, "", True), done.stderr


def test_a_rehearsal_refuses_all_that_cannot_play_before_it_begins(modules: Path) -> None:
    capture = modules / "run.mcap"
    sets = {"player-red.class": "own_player:Atcs", "player-blue.class": "own_importer:Acts"}
    words = [word for key, value in sets.items() for word in ("--set", f"players.{key}={value}")]
    ran = CliRunner().invoke(app, [str(TABLE), "--for", "1 s", "--capture", str(capture), *words])
    assert isinstance(ran.exception, DeploymentError) and not capture.exists()
    red, blue = ran.exception.problems
    assert red == (
        "--set:1:26: players.player-red.class: there is no Atcs in own_player"
        " (there are: Acts, Bare, Hears, Nothing, Sits, Takes), 'own_player:Atcs', nearest is 'own_player:Acts'"
    )
    assert blue.startswith("--set:2:27: players.player-blue.class: cannot be imported: ModuleNotFoundError: ")
