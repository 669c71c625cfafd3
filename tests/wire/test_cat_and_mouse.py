"""A controller by the unchanged pymorse of PyPI catches the mouse in a run of real processes."""

from __future__ import annotations

import re
import subprocess
import sys
from importlib.util import find_spec
from typing import TYPE_CHECKING, Final

import pytest

from foosim.client import control
from foosim.simulation.verify import verify_capture
from tests.deployed import DEPLOY
from tests.wire.conftest import ONE, wait_for

if TYPE_CHECKING:
    from tests.wire.conftest import House

SCRIPT: Final = DEPLOY.parent / "examples" / "cat_and_mouse" / "cat_script.py"
PATCHED: Final = """
import runpy, sys
import pymorse
pymorse.Component.__dir__ = lambda self: sorted({*vars(self), *vars(type(self))})
del sys.argv[0]
runpy.run_path(sys.argv[0], run_name="__main__")
"""
"""On Python 3.8 to 3.11 the `__dir__` of pymorse raises, and its process would never end."""
GATEWAY: Final = "morse: {kind: socket, listen: '127.0.0.1:0', streams: 0}"
MANY: Final = pytest.mark.campaign
NODES: Final = {
    1: "n1: {launch: local, robots: [cat, mouse]}",
    2: "n1: {launch: local, robots: [cat]}, n2: {launch: local, robots: [mouse]}",
    3: "n1: {launch: local, robots: []}, n2: {launch: local, robots: [cat]}, n3: {launch: local, robots: [mouse]}",
}


@pytest.mark.skipif(find_spec("pymorse") is None, reason="pymorse needs Python 3.11 or older")
@pytest.mark.parametrize("nodes", [pytest.param(1, marks=MANY), pytest.param(2, marks=MANY), 3])
def test_the_tutorial_s_controller_catches_the_mouse_and_the_run_is_verified(house: House, nodes: int) -> None:
    sets = {"players": "player-mouse: {like: wanderer}", "clients": "", "gateways": GATEWAY, "nodes": NODES[nodes]}
    options = [word for key, value in sets.items() for word in ("--set", f"{key}={{{value}}}")]
    house.start("foosim", "up", DEPLOY / "cat_and_mouse.yaml", *ONE, "--pace", "2x", "--capture", "run.mcap", *options)
    log = house.live().logs / "morse.log"

    def port() -> str:
        found = re.search(r"services at tcp/127\.0\.0\.1:(\d+)", log.read_text()) if log.exists() else None
        return "" if found is None else found[1]

    cat = subprocess.Popen([sys.executable, "-c", PATCHED, str(SCRIPT), wait_for("the gateway", port)])
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
