"""A body that cannot be made in the vHub, which draws it and looks past it: the run ends, and names it."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any, Final

import pytest

from foosim.simulation.run import rehearse
from tests.own_components import folder_on_path

COMPONENTS: Final = """
import sys
from msgspec import Struct
from foosim import Player
from foosim.world.component_types.quantities import Metres
from foosim.world.components.base import Model, Sensor
from foosim.world.component_types.registry import model, sensor
from foosim.world.component_types.settings import RobotSettings, SensorSettings
from foosim.world.scene import ORIGIN, Body, Box, Link, Shape

acts = {}


def raises():
    raise ValueError("no file here")


def leaves():
    sys.exit(0)


class Reading(Struct, frozen=True):
    x: Metres


@sensor("hub_beam", SensorSettings, Reading)
class Beam(Sensor):
    def __init__(self, settings, at):
        pass

    def sample(self, view):
        return Reading(1.0)


class Looker(Player):
    def act(self, tick, samples):
        return {}


def callers():
    frame = sys._getframe()
    while frame is not None:
        yield frame.f_globals.get("__name__", "")
        frame = frame.f_back


def in_vhub():
    names = [*callers()]
    return any(name.startswith(("foosim.vhub.", "foosim.capture.writer")) for name in names) and (
        "trial" in acts or "foosim.deployment.loader" not in names
    )


class Settings(RobotSettings):
    x: float = 0.0


@model("hub_post", Settings)
class Post(Model):
    def __init__(self, settings, at):
        self.x, self.name = settings.x, at.robot.name

    def body(self):
        if in_vhub():
            acts.get(self.name, int)()
        shape = Shape(Box((0.1, 0.1, 0.5)), "", (1.0, 0.0, 0.0, 1.0))
        return Body(self.name, "post", (self.x, 0.0, 0.5), (Link(self.name, "fixed", (shape,), 0.0, ORIGIN),))

    def place(self, view):
        pass

    def is_plausible(self, numbers, before):
        return True
"""
YARD: Final = """
format: 2
world: posts
seed: 1
tick: 10 ms
substeps: 1
engine: pure
pace: fast
robots:
  alpha: {model: 'hub_components:Post', sensors: {beam: {kind: 'hub_components:Beam', rate: 50 Hz}}}
  beta: {model: 'hub_components:Post', x: 5.0}
nodes: {one: {robots: ['*']}}
players: {looker: {class: 'hub_components:Looker', rate: 50 Hz, robots: {alpha: [beam]}}}
network:
  radios: {air: {preset: wifi_5_indoor}}
  robots: {'*': [air], looker: [air]}
  places: {looker: [0 m, 3 m, 1 m]}
"""


SAID: Final = "model hub_post of beta failed at tick 0: {} (hub_components.py:"


@pytest.fixture
def components(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    (tmp_path / "hub_components.py").write_text(COMPONENTS)
    folder_on_path(tmp_path, monkeypatch)
    yield import_module("hub_components")
    sys.modules.pop("hub_components")


@pytest.mark.parametrize(
    ("act", "said"), [("raises", "ValueError: no file here"), ("leaves", "SystemExit: 0")], ids=["raises", "leaves"]
)
def test_a_body_that_fails_in_the_vhub_ends_a_rehearsal_in_order(components: Any, act: str, said: str) -> None:
    """As one does that reads what is missing on the vHub's machine."""
    assert not rehearse(YARD, "posts.yaml", 50, 2).json["failed"]
    components.acts["beta"] = getattr(components, act)
    done = rehearse(YARD, "posts.yaml", 50, 2).json
    assert done["failed"] and done["reason"].startswith(SAID.format(said))
    failed = done["failed_component"]
    assert (failed["entity"], failed["component"]) == ("beta", "model hub_post")
    assert failed["traceback"].startswith("Traceback")


@pytest.mark.parametrize(
    ("acts", "said"),
    [
        ("{'beta': raises}", SAID.format("ValueError: no file here")),
        (
            "{'beta': raises, 'trial': True}",
            "lost vhub: the deployment is not valid on its machine: posts.yaml:15:3: robots: model hub_post of beta "
            "failed at tick 0: ValueError: no file here (hub_components.py:",
        ),
    ],
    ids=["in the run", "where it reads the deployment"],
)
def test_a_body_that_fails_in_the_vhubs_process_ends_the_run_at_once(tmp_path: Path, acts: str, said: str) -> None:
    """Of the capture, which draws it, where there are no radios."""
    (tmp_path / "hub_components.py").write_text(f"{COMPONENTS}\nacts.update({acts})\n")
    (tmp_path / "posts.yaml").write_text(YARD.partition("network:")[0])
    command = [sys.executable, "-P", "-c", "from foosim.cli import main; main()"]
    done = subprocess.run(
        [*command, "up", "posts.yaml", "--for", "2s", "--capture", "run.mcap"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(tmp_path), "XDG_STATE_HOME": str(tmp_path / "state")},
        capture_output=True,
        text=True,
        check=False,
    )
    printed = done.stdout + done.stderr
    assert done.returncode == 1 and f"the run has ended: {said}" in printed, printed
    (log,) = tmp_path.glob("state/foosim/runs/*/logs/vhub.log")
    assert said in log.read_text()
