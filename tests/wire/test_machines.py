"""A run on several machines: namespaces with networks of their own, reached by a real sshd.

Whatever the network does to the machines, the world is the one that would have been.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import pytest

from foosim.capture.reader import open_capture
from foosim.simulation.run import rehearse
from tests.apart import apart
from tests.wire import namespaces
from tests.wire.conftest import LONG, command_path
from tests.wire.namespaces import Machine, Machines
from tests.wire.test_run import last_json

if TYPE_CHECKING:
    from tests.wire.conftest import House

pytestmark = pytest.mark.skipif(bool(namespaces.missing()), reason=namespaces.missing())

LISTEN: Final = "10.77.0.1:7400"
DESK: Final = """
import sys
from foosim.common.json_text import encode_json
from foosim.client.control import Control
with Control(sys.argv[1]) as control:
    for line in sys.stdin:
        verb = line.strip()
        print(encode_json(control.status() if verb == "status" else control.request(verb).text).decode(), flush=True)
"""
"""An operator on the supervisor's machine: says a verb, gets the answer."""


class Cluster:
    """A house whose runs are spread over machines: supervisor and players on `sup`, the vHub on `hub`, two nodes."""

    def __init__(self, house: House, machines: Machines) -> None:
        self.house = house
        house.table = house.folder / "table.yaml"
        house.table.write_text(apart())
        self.machines = machines
        self.sup, self.hub, self.left, self.right = (machines[name] for name in ("sup", "hub", "left", "right"))
        self.desk: subprocess.Popen[str] | None = None

    def deployed(self, *sets: str, **changes: str) -> list[str]:
        """Settings that spread the table over the machines; `changes` are other keys of the host `right`."""
        commands = Path(sys.executable).parent
        hosts = {
            name: {
                "address": self.machines[name].address,
                "ssh_options": ["-F", str(self.machines.ssh_config)],
                "commands": str(commands),
                "labels": ["arena"] if name in ("left", "right") else [],
            }
            for name in ("hub", "left", "right")
        }
        hosts["right"].update(changes)
        places = ("nodes.red.label=arena", "nodes.blue.label=arena", "vhub.host=hub", "engine=pure", LONG)
        settings = (f"hosts={json.dumps(hosts)}", f"listen={LISTEN}", *places, *sets)
        return [word for setting in settings for word in ("--set", setting)]

    def up(self, *arguments: str) -> subprocess.Popen[str]:
        """Start a run on the supervisor's machine."""
        command = [command_path("foosim"), "up", str(self.house.table), "--insecure", "--json", *arguments]
        process = subprocess.Popen(
            self.sup.inside(*command),
            cwd=self.house.folder,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            process_group=0,
        )
        self.house.started.append(process)
        return process

    def ask(self, verb: str) -> Any:
        """Ask the supervisor from its own machine."""
        if self.desk is None:
            command = self.sup.inside(sys.executable, "-c", DESK, f"tcp/{LISTEN}")
            self.desk = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        assert self.desk.stdin is not None and self.desk.stdout is not None
        self.desk.stdin.write(f"{verb}\n")
        self.desk.stdin.flush()
        return json.loads(self.desk.stdout.readline())

    def told(self, what: str, *names: str, times: int = 1) -> None:
        """Wait until the recoveries tell this of these nodes, that often each."""

        def are_told() -> bool:
            entries = self.ask("status")["recoveries"]
            told = [(entry["what"], entry["name"]) for entry in entries]
            return all(told.count((what, name)) >= times for name in names)

        self.house.wait_for(f"{what} of {', '.join(names)}", are_told)

    def disturb(self, cut: Callable[[], None], heal: Callable[[], None], *names: str, times: int = 1) -> None:
        """Cut nodes off until they are lost, heal, and wait until they take part again."""
        cut()
        self.told("node", *names, times=times)
        heal()
        self.told("join", *names, times=times)

    def close(self) -> None:
        if self.desk is not None:
            self.desk.communicate()


@pytest.fixture
def cluster(house: House, tmp_path: Path) -> Iterator[Cluster]:
    with Machines(tmp_path, "sup", "hub", "left", "right") as machines:
        for days, name in enumerate(("hub", "left", "right")):  # clocks of machines need not agree
            machines.serve_ssh(name, days * 86_400, XDG_STATE_HOME=str(tmp_path / f"state-{name}"))
        made = Cluster(house, machines)
        yield made
        made.close()


def test_machines_that_are_cut_off_come_back_to_the_same_world(cluster: Cluster) -> None:
    """The vHub's machine, the nodes' and the supervisor's are four; links are slow, go down, and lose one way."""
    up = cluster.up(*cluster.deployed())
    cluster.house.live()
    cluster.house.info()
    cluster.house.wait_for("the ball in play", lambda: cluster.ask("status")["ticks"] > 150)
    status = cluster.ask("status")
    hosts = {name: process["host"] for name, process in status["processes"].items()}
    assert hosts == {"red": "right", "blue": "left", "vhub": "hub", "supervisor": ""}
    marks = (cluster.right, "--name red"), (cluster.left, "--name blue"), (cluster.hub, "foosim role vhub")
    for machine, mark in marks:
        assert any(mark in line for line in machine.processes().values()), "it runs where it is said to"
    sup, left, right = cluster.sup, cluster.left, cluster.right
    left.limit("4mbit")

    def cut() -> None:
        left.link("down")
        right.deafen(sup)

    def heal() -> None:
        left.link("up")
        right.heal(sup)

    cluster.disturb(cut, heal, "red", "blue")
    cluster.ask("down")
    assert_same_world(cluster, up)


@pytest.mark.campaign
def test_each_way_of_being_cut_off(cluster: Cluster) -> None:
    """Link down, nothing out, nothing in, neither, one node after the other; then all links slow."""
    up = cluster.up(*cluster.deployed())
    cluster.house.info()
    cluster.house.wait_for("the first ticks", lambda: cluster.ask("status")["ticks"] > 10)
    sup, left, right = cluster.sup, cluster.left, cluster.right
    cluster.disturb(lambda: left.link("down"), lambda: left.link("up"), "blue")
    cluster.disturb(lambda: right.deafen(sup), lambda: right.heal(sup), "red")
    cluster.disturb(lambda: sup.deafen(left), lambda: sup.heal(left), "blue", times=2)

    def both(do: Callable[[Machine, Machine], None]) -> Callable[[], None]:
        def each() -> None:
            do(sup, right)
            do(right, sup)

        return each

    cluster.disturb(both(Machine.deafen), both(Machine.heal), "red", times=2)
    lines = cluster.hub.processes().items()
    (hub,) = (pid for pid, line in lines if "foosim role vhub" in line and "guard" not in line)
    os.kill(hub, signal.SIGKILL)
    cluster.told("vhub", "vhub")
    for machine in cluster.machines.by_name.values():
        machine.limit("3mbit")
    so_far = cluster.ask("status")["ticks"]
    cluster.house.wait_for("more ticks over slow links", lambda: cluster.ask("status")["ticks"] > so_far + 500)
    cluster.ask("down")
    assert_same_world(cluster, up)


def assert_same_world(cluster: Cluster, up: subprocess.Popen[str]) -> None:
    """The run ends in order, equals its rehearsal, and leaves its capture and its logs at home, nothing elsewhere."""
    code, out, err = cluster.house.end(up)
    assert code == 0, err
    content = last_json(out)
    same = rehearse(cluster.house.table.read_text(), "table.yaml", content["ticks"], None, ["engine=pure"]).json
    assert content["digest"] == same["digest"] and content["packets"] == same["packets"]
    capture = open_capture(cluster.house.folder / content["capture"])
    assert capture.about.finished and capture.about.end["reason"] == "stopped"
    logs = {path.name: path.read_text() for path in cluster.house.folder.glob("state/foosim/runs/*/logs/*.log")}
    assert "lost the supervisor" in logs["red.log"] + logs["blue.log"], "what they said over there is here"
    cluster.house.wait_for(
        "nothing left on the hosts", lambda: not list(cluster.house.folder.glob("state-*/foosim/hosts/*"))
    )
