"""The units that `install` writes: what stands in them, that systemd takes them, and what is refused."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from foosim.cli import supervisor
from foosim.common.addresses import Address
from foosim.common.errors import BadValue, Failed, Refused
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.deployment.schema import Deployment
from foosim.launcher.hosts.prepare import NoFolder, OutOfReach, check_hosts
from foosim.launcher.hosts.ssh import remotes
from foosim.launcher.hosts.systemd_units import units_of
from foosim.launcher.pki import certificates
from foosim.launcher.pki.hosts import files_for
from foosim.launcher.plan import check_certificates, make_plan
from foosim.launcher.run_options import RunOptions

DEPLOY = Path(__file__).parents[2] / "deploy"
COMMANDS = Path(sys.executable).parent
CLUSTER = load_deployment(
    apply_sets((DEPLOY / "cluster.yaml").read_text(), "cluster.yaml", [f"hosts.left.commands={COMMANDS}"]),
    "cluster.yaml",
)
ADDRESS = Address("192.168.10.1", 7400)


def lines(text: str) -> dict[str, str]:
    """The settings of a unit."""
    return dict(line.split("=", 1) for line in text.splitlines() if "=" in line and not line.startswith("#"))


def test_a_unit_restarts_a_node_that_ends_or_hangs_within_bounds() -> None:
    (name, text), *others = units_of(CLUSTER, "left", ADDRESS, is_users=False).items()
    assert name == "foosim-blue.service" and not others
    unit = lines(text)
    command = f"{COMMANDS}/foosim-node --name blue --connect tcp/192.168.10.1:7400 --world table"
    expected = {
        "Type": "notify", "ExecStart": command, "WatchdogSec": "5", "Restart": "on-failure",
        "KillMode": "control-group", "MemoryMax": "1G", "TasksMax": "128", "DynamicUser": "yes",
        "RestartPreventExitStatus": "2 3", "WantedBy": "multi-user.target",
    }  # fmt: skip
    assert {key: unit.get(key) for key in expected} == expected
    own = lines(units_of(CLUSTER, "left", ADDRESS, is_users=True)[name])
    assert "DynamicUser" not in own and own["WantedBy"] == "default.target" and own["ExecStart"] == command


def with_certificates(*sets: str) -> Deployment:
    """The cluster, whose host `left` has a folder of certificates."""
    sets = (f"hosts.left.commands={COMMANDS}", "hosts.left.pki=/etc/foosim/pki 100%", *sets)
    return load_deployment(apply_sets((DEPLOY / "cluster.yaml").read_text(), "cluster.yaml", sets), "cluster.yaml")


def test_a_unit_of_the_system_is_lent_the_nodes_certificate_and_a_users_reads_it() -> None:
    address = Address("192.168.10.1", 7400, "tls")
    (text,) = units_of(with_certificates(), "left", address, is_users=False).values()
    command = f"{COMMANDS}/foosim-node --name blue --connect tls/192.168.10.1:7400 --world table"
    assert lines(text)["ExecStart"] == f"{command} --pki %d"
    lent = [line for line in text.splitlines() if line.startswith("LoadCredential=")]
    files = ("ca.pem", "node.blue.pem", "node.blue.key")
    assert lent == [f"LoadCredential={name}:/etc/foosim/pki 100%%/{name}" for name in files]
    (own,) = units_of(with_certificates(), "left", address, is_users=True).values()
    assert lines(own)["ExecStart"] == f"{command} --pki '/etc/foosim/pki 100%%'" and "LoadCredential" not in own
    with pytest.raises(Failed, match=r"host left has no certificates: set hosts\.left\.pki"):
        units_of(CLUSTER, "left", address, is_users=False)
    plain = units_of(with_certificates(), "left", ADDRESS, is_users=False)
    assert plain == units_of(CLUSTER, "left", ADDRESS, is_users=False), "a run without certificates has none"


def test_what_is_sent_to_a_host_is_its_own_and_no_more() -> None:
    assert files_for(with_certificates(), "left") == ["ca.pem", "node.blue.key", "node.blue.pem"]
    assert files_for(with_certificates(), "radio") == ["ca.pem", "vhub.key", "vhub.pem"]
    passwords = with_certificates("access={radio: password}", "players.player-red.host=left")
    assert files_for(passwords, "left") == ["ca.pem", "node.blue.key", "node.blue.pem", "client.player-red.password"]
    compared = ["client.player-blue.password", "client.player-red.password"]
    assert files_for(passwords, "radio") == ["ca.pem", "vhub.key", "vhub.pem", *compared]
    with pytest.raises(Failed, match="nothing is placed on host radio"):
        files_for(with_certificates("vhub.host=left"), "radio")


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="not installed: systemd-analyze")
def test_systemd_takes_them(tmp_path: Path) -> None:
    secured = Address("192.168.10.1", 7400, "tls")
    for name, text in units_of(with_certificates(), "left", secured, is_users=False).items():
        (tmp_path / name).write_text(text)
        command = ["systemd-analyze", "verify", "--man=no", str(tmp_path / name)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert name not in done.stderr, done.stderr


def test_what_cannot_be_a_unit_is_refused() -> None:
    with pytest.raises(BadValue, match=r"unknown host \(declared: .*left.*\), 'lefft', nearest is left"):
        units_of(CLUSTER, "lefft", ADDRESS, is_users=False)
    with pytest.raises(Failed, match="no node is placed on host radio"):
        units_of(CLUSTER, "radio", ADDRESS, is_users=False)
    for bad in (Address("192.168.10.1"), Address("0.0.0.0", 7400)):
        with pytest.raises(BadValue, match="always listens"):
            units_of(CLUSTER, "left", bad, is_users=False)
    with pytest.raises(BadValue, match="host left cannot connect"):
        units_of(CLUSTER, "left", Address("127.0.0.1", 7400), is_users=False)


def test_install_prints_or_writes_them(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """Without a file it is the cluster's; a node that `up` would start by itself is told of."""

    def install(*arguments: str) -> tuple[str, str]:
        monkeypatch.setattr(sys, "argv", ["foosim-supervisor", "install", *arguments])
        with pytest.raises(SystemExit) as ended:
            supervisor.main()
        assert ended.value.code == 0
        return capsys.readouterr()

    monkeypatch.chdir(DEPLOY.parent)
    out, err = install("right", "--print")
    assert "ExecStart=foosim-node --name red --connect tcp/192.168.10.1:7400" in out
    assert "node red has `launch: local`" in err
    out, err = install("right", "--output", str(tmp_path / "new"), "--user", "--set", "nodes.red.launch=systemd")
    assert (out, err) == (f"{tmp_path}/new/foosim-red.service\n", "")
    assert "default.target" in (tmp_path / "new" / "foosim-red.service").read_text()


def test_who_is_elsewhere_has_certificates_there(tmp_path: Path) -> None:
    folder = tmp_path / "pki"
    certificates.init(folder)
    certificates.issue(folder, ["supervisor", "client.player-red", "client.player-blue", "operator.admin"])
    hosts = [f"hosts.{name}.pki=/etc/foosim" for name in ("left", "radio", "right")]
    plan = make_plan(RunOptions(DEPLOY / "cluster.yaml", sets=tuple(hosts), pki=folder))
    check_hosts(plan.deployment, plan.address, remotes(plan.deployment))
    assert check_certificates(plan) == []
    plan = make_plan(RunOptions(DEPLOY / "cluster.yaml", sets=tuple(hosts[:2]), pki=folder))
    with pytest.raises(NoFolder, match=r"red on host right .* set hosts.right.pki .* `foosim-pki init DIR FILE"):
        check_hosts(plan.deployment, plan.address, remotes(plan.deployment))


def test_hosts_have_to_reach_the_supervisor() -> None:
    file = DEPLOY / "cluster.yaml"
    with pytest.raises(Refused, match="or --insecure to allow it"):
        make_plan(RunOptions(file))

    def check(listen: str, *sets: str) -> None:
        plan = make_plan(RunOptions(file, sets=sets, listen=listen, insecure=True))
        check_hosts(plan.deployment, plan.address, remotes(plan.deployment))

    check("192.168.10.1")
    with pytest.raises(OutOfReach, match=r"blue on host left \(192.168.10.2\) cannot connect to tcp/127.0.0.1:7400"):
        check("127.0.0.1:7400")
    with pytest.raises(OutOfReach, match="needs a fixed port"):
        check("192.168.10.1", "nodes.blue.launch=systemd")
