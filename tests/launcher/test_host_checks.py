"""What the hosts of a run need before its start: their certificates, and a route to the supervisor."""

from __future__ import annotations

from pathlib import Path

import pytest

from foosim.common.errors import Refused
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.deployment.schema import Deployment
from foosim.launcher import pki as certificates
from foosim.launcher.hosts import check_hosts, remotes
from foosim.launcher.pki import files_for
from foosim.launcher.plan import check_certificates, make_plan
from foosim.launcher.run_options import RunOptions
from foosim.protocol.identity import identities_of
from foosim.runtime.transport.certificate_folder import CertificateError

DEPLOY = Path(__file__).parents[2] / "deploy"


def with_certificates(*sets: str) -> Deployment:
    """The cluster, whose host `left` has a folder of certificates."""
    sets = ("hosts.left.pki=/etc/foosim/pki", *sets)
    return load_deployment(apply_sets((DEPLOY / "cluster.yaml").read_text(), "cluster.yaml", sets), "cluster.yaml")


def test_what_is_sent_to_a_host_is_its_own_and_no_more(tmp_path: Path) -> None:
    folder = tmp_path / "pki"
    certificates.provide(folder, identities_of(with_certificates()))

    def sent(host: str, *sets: str) -> list[str]:
        files = files_for(with_certificates(*sets), host, folder)
        assert all(content == (folder / name).read_bytes() for name, content in files.items())
        return [*files]

    assert sent("left") == ["ca.pem", "node.blue.key", "node.blue.pem"]
    assert sent("radio") == ["ca.pem", "vhub.key", "vhub.pem"]
    assert sent("left", "players.player-red.host=left") == [
        *("ca.pem", "node.blue.key", "node.blue.pem", "client.player-red.key", "client.player-red.pem")
    ]
    (folder / "vhub.key").write_bytes((folder / "node.blue.key").read_bytes())
    with pytest.raises(CertificateError, match=r"vhub\.key: the key does not belong to the certificate"):
        sent("radio")


def test_who_is_elsewhere_has_certificates_there(tmp_path: Path) -> None:
    folder = tmp_path / "pki"
    certificates.init(folder)
    certificates.issue(folder, ["supervisor", "client.player-red", "client.player-blue", "operator.admin"])
    hosts = [f"hosts.{name}.pki=/etc/foosim" for name in ("left", "radio", "right")]
    plan = make_plan(RunOptions(DEPLOY / "cluster.yaml", sets=tuple(hosts), pki=folder))
    check_hosts(plan.deployment, plan.address, remotes(plan.deployment))
    assert check_certificates(plan) == []
    plan = make_plan(RunOptions(DEPLOY / "cluster.yaml", sets=tuple(hosts[:2]), pki=folder))
    with pytest.raises(Refused, match=r"red on host right .* set hosts.right.pki .* `foosim pki init DIR FILE"):
        check_hosts(plan.deployment, plan.address, remotes(plan.deployment))


def test_hosts_have_to_reach_the_supervisor() -> None:
    file = DEPLOY / "cluster.yaml"
    with pytest.raises(Refused, match="or --insecure to allow it"):
        make_plan(RunOptions(file))

    def check(listen: str, *sets: str) -> None:
        plan = make_plan(RunOptions(file, sets=sets, listen=listen, insecure=True))
        check_hosts(plan.deployment, plan.address, remotes(plan.deployment))

    check("192.168.10.1")
    with pytest.raises(Refused, match=r"blue on host left \(192.168.10.2\) cannot connect to tcp/127.0.0.1:7400"):
        check("127.0.0.1:7400")
    with pytest.raises(Refused, match="needs a fixed port"):
        check("192.168.10.1", "nodes.blue.launch=systemd")
