"""A controller by the unchanged pymorse of PyPI catches the mouse in a run of real processes."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Final

import pytest

from foosim.client import control
from foosim.simulation.verify import verify_capture
from tests.deployed import DEPLOY
from tests.wire.conftest import ONE, wait_for

if TYPE_CHECKING:
    from tests.wire.conftest import House

SCRIPTS: Final = DEPLOY.parent / "examples" / "cat_and_mouse"
PATCHED: Final = """
import runpy, sys
import pymorse
pymorse.Component.__dir__ = lambda self: sorted({*vars(self), *vars(type(self))})
del sys.argv[0]
runpy.run_path(sys.argv[0], run_name="__main__")
"""
"""On Python 3.8 to 3.11 the `__dir__` of pymorse raises, and its process would never end."""
MANY: Final = pytest.mark.campaign
NODES: Final = {
    1: "n1: {launch: local, robots: [cat, mouse]}",
    2: "n1: {launch: local, robots: [cat]}, n2: {launch: local, robots: [mouse]}",
    3: "n1: {launch: local, robots: []}, n2: {launch: local, robots: [cat]}, n3: {launch: local, robots: [mouse]}",
}
SOCKET: Final = "{kind: socket, listen: '127.0.0.1:0', streams: 0}"


def by_script(nodes: int) -> list[str | Path]:
    """Return how the builder script is run: its mouse waits for keys, and a rule notes the catch."""
    rule = "{kind: catch, prey: object, hunter: vehicle, distance: 1.2 m}"
    sets = (f"gateways={{morse: {SOCKET}}}", f"rules={{mouse: {rule}}}")
    options = [word for one in sets for word in ("--set", one)]
    return ["morse", "run", SCRIPTS / "cat_mouse.py", "--nodes", str(nodes), *options]


def by_deployment(nodes: int) -> list[str | Path]:
    """Return how the deployment is run with a gateway in place of the cat's player; its mouse moves."""
    sets = {"players": "player-mouse: {like: wanderer}", "clients": "", "gateways": f"morse: {SOCKET}"}
    options = [word for key, value in sets.items() for word in ("--set", f"{key}={{{value}}}")]
    return ["up", DEPLOY / "cat_and_mouse.yaml", *options, "--set", f"nodes={{{NODES[nodes]}}}"]


RUNS: Final = [
    pytest.param(by, nodes, marks=() if (by, nodes) == (by_script, 3) else MANY)
    for by in (by_script, by_deployment)
    for nodes in NODES
]


@pytest.mark.skipif(find_spec("pymorse") is None, reason="pymorse needs Python 3.11 or older")
@pytest.mark.parametrize(("by", "nodes"), RUNS)
def test_the_tutorial_s_controller_catches_the_mouse_and_the_run_is_verified(
    house: House, by: Callable[[int], list[str | Path]], nodes: int
) -> None:
    house.start("foosim", *by(nodes), *ONE, "--pace", "2x", "--capture", "run.mcap")
    log = house.live().logs / "morse.log"

    def port() -> str:
        found = re.search(r"services at tcp/127\.0\.0\.1:(\d+)", log.read_text()) if log.exists() else None
        return "" if found is None else found[1]

    cat = subprocess.Popen(
        [sys.executable, "-c", PATCHED, str(SCRIPTS / "cat_script.py"), wait_for("the gateway", port)]
    )
    try:
        house.ticking()
        with control.connect() as run:
            wait_for("the catch", lambda: run.status()["catch mouse"]["caught_s"])
            assert cat.poll() is None
            run.request("down")
    finally:
        cat.kill()
        cat.wait()
    assert house.end(house.started[0])[0] == 0
    for again in NODES:
        found = verify_capture(house.folder / "run.mcap", nodes=again)
        assert found.equal, found
