"""The processes that the files in deploy/ declare start with exactly their arguments and compute what a rehearsal does.

Only places differ: addresses, and the paths of the deployment, of the state and of the progress files. The deployment
is the table with longer deadlines, without Bullet and slow: while a test waits for processes, each tick only costs. The
processes start in the wrong order: those first that have to wait for others.
"""

from __future__ import annotations

import json
import re
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from foosim.client.control import Control
from foosim.common.units import parse_pace
from foosim.deployment.loader import apply_sets
from foosim.simulation.run import rehearse
from tests.deploy.processes import Declared, from_compose, from_kubernetes, from_units
from tests.wire.conftest import LONG
from tests.wire.test_run import free_port

if TYPE_CHECKING:
    from tests.wire.conftest import House

TICKS: Final = 30
NAMES: Final = {"node-0": "red", "node-1": "blue", "supervisor": "table"}
"""What pods are called where the other files say otherwise: nodes, and the run, which is named as its pod."""
FIRST: Final = ("foosim", "role", "player", "foosim", "role", "node", "foosim", "role", "vhub", "foosim")


def moved(words: tuple[str, ...], places: dict[str, str]) -> list[str]:
    """The command with places of this test in it."""
    for old, new in places.items():
        words = tuple(word.replace(old, new) for word in words)
    return list(words)


def own_words(process: Declared) -> tuple[str, ...]:
    """A command without what belongs to its file alone: addresses, the progress file, other names of the nodes."""
    words, found = iter(process.command), []
    for word in words:
        if word in ("--progress-file", "--set"):
            next(words)
        elif word != "--insecure":
            found.append(re.sub(r"tcp/[\w.]+:", "tcp/HOST:", NAMES.get(word, word)))
    return tuple(found)


def test_all_files_start_the_same_processes() -> None:
    """So that the run of one of them, below, stands for all."""
    containers, pods, units = ({own_words(it) for it in read()} for read in (from_compose, from_kubernetes, from_units))
    assert len(containers) == 6
    assert containers == pods == units


def test_the_processes_run_with_the_arguments_of_their_file(house: House) -> None:
    processes, port, table = from_kubernetes(), free_port(), house.folder / "table.yaml"
    sets = [LONG, "engine=pure", "pace=0.1x", "players.player-red.rate=25 Hz"]
    text = apply_sets(house.table.read_text(), "table.yaml", sets)
    table.write_text(text)
    places = {
        **dict.fromkeys(("tcp/0.0.0.0:7400", "tcp/supervisor:7400"), f"tcp/127.0.0.1:{port}"),
        **dict.fromkeys(("tcp/0.0.0.0:7401", "tcp/vhub:7401"), f"tcp/127.0.0.1:{port + 1}"),
        "/etc/foosim/table.yaml": str(table),
        "/var/lib/foosim": str(house.folder),
    }

    def words_of(process: Declared, command: tuple[str, ...]) -> list[str]:
        return moved(command, {**places, "/run/foosim/progress": str(house.folder / f"progress-{process.name}")})

    processes.sort(key=lambda process: FIRST.index(process.command[0]))
    started = {process.name: house.start(*words_of(process, process.command)) for process in processes}
    house.ticking(TICKS)
    for probe in {process.probe: process for process in processes}.values():
        code, out, err = house.run(*words_of(probe, probe.probe))
        assert code == 0 and out.startswith("alive, "), err
    with Control(f"tcp/127.0.0.1:{port}") as control:
        control.request("down")
    for name, process in started.items():
        code, _, err = house.end(process)
        assert code == 0, f"{name}: {err}"

    result = result_of(house.folder)
    assert (result["reason"], result["failed"], result["recoveries"]) == ("stopped", False, [])
    assert sum(node["solved_ticks"] > 0 for node in result["nodes"].values()) == 2
    (supervisor,) = [process.command for process in processes if process.name == "supervisor"]
    asked = [value for option, value in pairwise(supervisor) if option == "--set"]
    text = apply_sets(text, "table.yaml", asked)
    again = rehearse(text, "table.yaml", result["ticks"], None, pace=parse_pace("fast"))
    assert (again.json["digest"], again.json["packets"]) == (result["digest"], result["packets"])


def result_of(folder: Path) -> dict[str, Any]:
    """What the supervisor wrote at the run's end."""
    content = json.loads((folder / "state" / "foosim" / "runs" / "supervisor" / "result.json").read_text())
    assert isinstance(content, dict)
    return content
