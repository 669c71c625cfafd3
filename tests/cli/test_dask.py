"""`--dask`: the same table as by processes of this machine, also where a worker dies, and clusters that are refused."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from subprocess import DEVNULL
from typing import Any, Final, NamedTuple

import pytest

from tests.conftest import Command, Typed

distributed: Any = import_module("distributed")  # half of it has types
TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
SHORT: Final = ("--vary", "network.links.0.delay=0ms,30ms", "--seeds", "1..2", "--for", "100ms", "--set", "engine=pure")
KILLS: Final = """
import os
from foosim import Player
class Kills(Player):
    def __init__(self, deployment, parameters):
        self.order = os.path.join(os.path.dirname(__file__), str(os.getppid()))
    def act(self, tick, samples):
        if os.path.exists(self.order):
            os.remove(self.order)
            os.kill(os.getppid(), 9)
        return {}
"""
"""Kills the worker that it runs on, where a file has its name: the parent of the process that has the run."""


class Cluster(NamedTuple):
    """The address of a scheduler, and the process of one of its two workers; the other one is a thread here."""

    address: str
    worker: subprocess.Popen[bytes]


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    folder = tmp_path_factory.mktemp("dask")
    here = {"host": "127.0.0.1", "dashboard_address": "127.0.0.1:0", "protocol": "tcp", "local_directory": folder}
    words = [sys.executable, "-m", "distributed.cli.dask_worker", "--no-nanny", "--no-dashboard", "--nthreads=1"]
    with (
        distributed.LocalCluster(n_workers=1, threads_per_worker=1, processes=False, silence_logs=60, **here) as found,
        distributed.Client(found) as client,
        subprocess.Popen(
            [*words, "--host=127.0.0.1", f"--local-directory={folder}", found.scheduler_address], stderr=DEVNULL
        ) as worker,
    ):
        try:
            client.wait_for_workers(2)
            yield Cluster(found.scheduler_address, worker)
        finally:
            worker.kill()


@pytest.fixture
def command(typed: Typed) -> Command:
    """Runs `foosim sweep` for a short study of the table, whose red player kills the worker if it is ordered to."""
    Path("kills.py").write_text(KILLS)
    Path("table.yaml").write_bytes(TABLE.read_bytes())
    sweep = typed("sweep")
    return lambda *words: sweep("table.yaml", *SHORT, "--set", "players.player-red.class=kills:Kills", *words)


def test_a_cluster_with_another_version_of_foosim_is_refused(
    command: Command, cluster: Cluster, tmp_path: Path
) -> None:
    """A worker finds the files of another installation first."""
    other = tmp_path / "packages" / "foosim-9.9.dist-info"
    other.mkdir(parents=True)
    (other / "METADATA").write_text("Metadata-Version: 2.1\nName: foosim\nVersion: 9.9\n")
    with distributed.Client(cluster.address) as client:
        (there,) = [worker for worker, pid in client.run(os.getpid).items() if pid == cluster.worker.pid]
        client.run(lambda: sys.path.insert(0, str(other.parent)), workers=[there])
        done = command("--dask", cluster.address)
        client.run(lambda: sys.path.remove(str(other.parent)), workers=[there])
    assert done.code == 1 and f"--dask: {there} has another foosim than this machine, 0.2.0+" in done.err
    assert ": 9.9+" in done.err and not Path("table-sweep.csv").exists()


def test_the_table_is_that_of_processes_of_this_machine_and_a_worker_that_dies_costs_no_row(
    command: Command, cluster: Cluster
) -> None:
    here = command("--jobs", "1", "--out", "here.csv")
    order = Path(str(cluster.worker.pid))
    order.touch()
    there = command("--dask", cluster.address, "--out", "there.csv")
    assert (here.code, there.code, order.exists()) == (0, 0, False), there.err
    assert there.out.startswith("4 of 4 runs, in there.csv")
    rows = Path("there.csv").read_bytes()
    assert rows == Path("here.csv").read_bytes() and rows.count(b"\n") == 5


def test_a_match_is_played_on_a_cluster(typed: Typed, cluster: Cluster) -> None:
    words = ("--deployment", TABLE, "--games", "1", "--minutes", "0.01", "--set", "engine=pure")
    done = typed("match")("passive", "passive", *words, "--dask", cluster.address)
    assert done.code == 0 and "passive against passive: 1 game of" in done.out, done.err


def test_a_scheduler_that_is_not_there_is_refused_as_is_a_lack_of_dask(
    command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    with socket.socket() as nobody:  # has the port, and does not listen
        nobody.bind(("127.0.0.1", 0))
        monkeypatch.setattr("foosim.cli.executor.CONNECT", "100ms")
        for address in (f"127.0.0.1:{nobody.getsockname()[1]}", "tls://127.0.0.1:9", "127.0.0.1", "what://ever:1"):
            done = command("--dask", address)
            assert done.code == 1 and done.err.startswith(f"--dask: {address}: no scheduler answers, ")
    monkeypatch.setitem(sys.modules, "distributed", None)
    done = command("--dask", "127.0.0.1:9")
    assert done.code == 1 and done.err == "--dask needs Dask: pip install 'foosim[dask]'\n"
    done = command("--dask", "127.0.0.1:9", "--jobs", "2")
    assert done.code == 2 and "the workers of --dask are those of its cluster" in done.err
    assert not Path("table-sweep.csv").exists()
