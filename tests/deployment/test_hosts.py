"""Which process runs on which host: by name, by label evenly, by default on the supervisor's machine."""

from __future__ import annotations

from pathlib import Path

import pytest

from foosim.deployment.hosts import Host
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.deployment.schema import Deployment, places
from tests.apart import apart

DEPLOY = Path(__file__).parents[2] / "deploy"
TEXT = apart()
LABELS = {"c": "x", "a": "x, y", "b": "x"}
HOSTS = f"hosts={{{', '.join(f'{name}: {{address: {name}.lan, labels: [{them}]}}' for name, them in LABELS.items())}}}"


def deployed(*sets: str) -> Deployment:
    return load_deployment(apply_sets(TEXT, "table.yaml", [HOSTS, *sets]), "table.yaml")


def test_what_has_no_place_runs_where_the_supervisor_does() -> None:
    assert places(deployed()) == {}
    assert places(deployed("nodes.blue.host=c", "players.player-red.host=a")) == {"blue": "c", "player-red": "a"}


@pytest.mark.parametrize(
    ("sets", "expected"),
    [
        (("nodes.blue.label=x", "nodes.red.label=x", "vhub.label=x"), {"blue": "a", "red": "b", "vhub": "c"}),
        (("nodes.blue.label=x", "nodes.red.label=x", "vhub.host=a"), {"blue": "b", "red": "c", "vhub": "a"}),
        (("nodes.blue.label=y", "nodes.red.label=y"), {"blue": "a", "red": "a"}),
    ],
)
def test_a_label_spreads_processes_evenly(sets: tuple[str, ...], expected: dict[str, str]) -> None:
    assert places(deployed(*sets)) == expected


def test_ssh_goes_to_the_address_unless_it_is_told_otherwise() -> None:
    assert Host(address="[fe80::1]").destination == "fe80::1"
    assert Host(address="10.0.0.2", ssh="me@left").destination == "me@left"


def test_the_cluster_is_the_table_elsewhere() -> None:
    """The same world, inputs and network: the number of machines is no parameter."""
    table = load_deployment(TEXT, "table.yaml").model_dump()
    cluster = load_deployment((DEPLOY / "cluster.yaml").read_text(), "cluster.yaml")
    assert set(places(cluster)) == {"red", "blue", "vhub"} and cluster.listen != "127.0.0.1"
    content = cluster.model_dump()
    for what in ("listen", "hosts", "vhub"):
        content.pop(what), table.pop(what)
    for node in (*content["nodes"].values(), *table["nodes"].values()):
        node.pop("host"), node.pop("label")
    assert content == table
