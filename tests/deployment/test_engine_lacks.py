"""An installation without pybullet, as of any Python after 3.11: what it refuses, where, and what it still does."""

import sys
from pathlib import Path
from typing import Final

import pytest

from foosim.capture.mcap.checks import CaptureError
from foosim.capture.reader import About
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.launcher.doctor import Case, examine
from foosim.node.core import NodeCore
from foosim.protocol import channels
from foosim.protocol.codec import encode
from foosim.protocol.messages import Build
from foosim.simulation.verify import captured_world
from foosim.vhub.core import HubCore
from foosim.world.assembly.initial_state import first_frame
from tests.conftest import Typed

DEPLOY: Final = Path(__file__).parents[2] / "deploy"
TABLE: Final = DEPLOY / "table.yaml"
TEXT: Final = TABLE.read_text()
LACK: Final = "the engine bullet needs pybullet, which has wheels for Python 3.11 alone"
PRINT: Final = bytes(32)


@pytest.fixture(autouse=True)
def _there_is_no_pybullet(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pybullet", None)


@pytest.mark.parametrize("words", [["check"], ["up"], ["rehearse", "--for=2ms"], ["match", "team", "team"]])
def test_a_table_is_refused_at_the_line_of_its_engine(words: list[str], tmp_path: Path, typed: Typed) -> None:
    verb, *options = words
    table = tmp_path / "table.yaml"
    table.write_text(TEXT)
    file = ["--deployment", table] if verb == "match" else [table]
    done = typed()(verb, *options, *file)
    line = next(number for number, text in enumerate(TEXT.splitlines(), 1) if text.startswith("engine:"))
    assert done.code == 2
    assert done.err.startswith(f"{table}:{line}:9: engine: {LACK}: set engine: pure, or use Python 3.11; ")


def test_also_where_it_names_none_and_no_other_engine_is(tmp_path: Path, typed: Typed) -> None:
    file = tmp_path / "table.yaml"
    file.write_text(TEXT.replace("engine: bullet\n", ""))
    bare = typed()("check", file)
    assert bare.code == 2 and f": engine: {LACK}: " in bare.err and bare.err.startswith(f"{file}:")
    assert typed()("check", file, "--set", "engine=pure").code == 0
    assert typed()("check", DEPLOY / "yard.yaml").code == 0


def test_a_table_with_another_engine_is_led_to_one_that_is_there(typed: Typed) -> None:
    done = typed()("check", TABLE, "--set", "engine=mujoco")
    assert done.code == 2 and ": set engine: pure, 'mujoco'" in done.err


def test_nodes_on_other_machines_may_have_it(tmp_path: Path, typed: Typed) -> None:
    """What the launcher lacks is no matter then; the node whose machine lacks it takes no part, and says why."""
    assert typed()("check", DEPLOY / "cluster.yaml", "--set", "listen=127.0.0.1").code == 0
    text = apply_sets(TEXT, TABLE.name, ["players={}"])
    node, hub = NodeCore("red", "boot", PRINT, 0, ""), HubCore("boot", PRINT, 0)
    for process, name in ((node, "red"), (hub, "vhub")):
        process.wake(0)
        process.receive(channels.BUILD, name, encode(Build(name, "boot", "first", "run", "t", text, "fast")), 0)
    assert node.member.problem == f"lost red: its machine cannot compute the run: {LACK}"
    assert hub.deployment is not None and not hub.member.problem


def test_a_capture_is_read_and_not_computed_again() -> None:
    deployment = load_deployment(TEXT, TABLE.name)
    about = About(TABLE, metadata={"deployment": TABLE.name}, deployment_text=TEXT)
    with pytest.raises(CaptureError, match=f"the run cannot be computed again here: {LACK}"):
        captured_world(about, deployment, first_frame(deployment, None))


def test_the_doctor_names_what_to_do() -> None:
    (finding,) = (one for one in examine(Case(load_deployment(TEXT, TABLE.name), "127.0.0.1")) if one.check == "engine")
    assert (finding.state, finding.text) == ("problem", LACK) and finding.remedy.startswith("set engine: pure, or ")
