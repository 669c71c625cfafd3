"""The doctor: what it finds wrong, what it says to do, and that doing it helps."""

import importlib.metadata
import json
import socket
from collections.abc import Callable
from pathlib import Path
from typing import Final

import pytest
from typer.testing import CliRunner

from foosim.cli.doctor import app
from foosim.common.errors import Refused
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.deployment.schema import Capture, Deployment
from foosim.deployment.text.files import read_deployment_text
from foosim.launcher import doctor
from foosim.launcher import pki as certificates
from foosim.launcher.doctor import CHECKS, Case, Finding, examine, is_well
from foosim.launcher.plan import check_rooms
from foosim.protocol.identity import identities_of
from foosim.runtime.disk import free_bytes
from foosim.runtime.run_folder import runs_folder
from tests.apart import apart

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"


@pytest.fixture
def deployment() -> Deployment:
    return load_deployment(read_deployment_text(TABLE), "table.yaml")


@pytest.fixture
def folder(tmp_path: Path, deployment: Deployment) -> Path:
    path = tmp_path / "pki"
    certificates.init(path)
    certificates.issue(path, identities_of(deployment))
    return path


@pytest.fixture(autouse=True)
def state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.chdir(tmp_path)


def found(case: Case, subject: str) -> Finding:
    (finding,) = [finding for finding in examine(case) if finding.subject == subject]
    return finding


def test_where_all_is_well_every_check_says_so(deployment: Deployment, folder: Path) -> None:
    (folder / "ca.key").unlink()
    findings = examine(Case(deployment, "127.0.0.1", pki=folder))
    assert {finding.check for finding in findings} == CHECKS.keys() - {"hosts", "network"}, "which others have"
    assert [finding for finding in findings if finding.state == "problem"] == [] and is_well(findings)
    for finding in findings:
        assert (finding.state == "fine") == (finding.remedy == ""), finding


def test_the_classes_of_players_are_imported_where_they_are_to_run(tmp_path: Path) -> None:
    hosts = "\nhosts:\n  arm:\n    address: 192.0.2.7\n"
    text = apart() + hosts
    text = text.replace("class: foosim.library.table.players.football:Team", "class: own_team:Team\n    host: arm", 1)
    text = text.replace(
        "class: foosim.library.table.players.football:Team", "class: foosim.library.table.players.football:Teem", 1
    )
    deployment = load_deployment(text, "table.yaml")
    here, there = Case(deployment, "127.0.0.1"), Case(deployment, "127.0.0.1", host="arm")
    (finding,) = [finding for finding in examine(here) if finding.check == "players"]
    assert (finding.subject, finding.state) == ("player-blue", "problem") and "no Teem" in finding.text
    assert finding.remedy.startswith("correct players.player-blue.class, or put the module's folder on PYTHONPATH")
    (finding,) = [finding for finding in examine(there) if finding.check == "players"]
    assert (finding.subject, finding.state, finding.host) == ("player-red", "problem", "arm")
    assert "there is no module own_team" in finding.text and "as ssh to arm has it" in finding.remedy


def short(pem: Path) -> None:
    """Issue a certificate for three days."""
    for path in (pem, pem.with_suffix(".key")):
        path.unlink()
    certificates.issue(pem.parent, ["node.red"], days=3)


@pytest.mark.parametrize(
    ("spoil", "subject", "state", "said", "remedy"),
    [
        (lambda pem: pem.unlink(), "node.red", "problem", "no certificate", "foosim pki init"),
        (lambda pem: pem.with_suffix(".key").write_bytes(b""), "node.red", "problem", "not a", "remove both files"),
        (lambda pem: pem.with_suffix(".key").chmod(0o644), "node.red.key", "problem", "can be read by", "chmod 600"),
        (lambda pem: pem.with_name("ca.pem").unlink(), "ca.pem", "problem", "has no ca.pem", "foosim pki init"),
        (short, "node.red", "warning", "renew it", "foosim pki init"),
    ],
)
def test_what_is_wrong_with_certificates_is_found(
    deployment: Deployment, folder: Path, spoil: Callable[[Path], object], subject: str, state: str, said: str,
    remedy: str,
) -> None:  # fmt: skip
    spoil(folder / "node.red.pem")
    finding = found(Case(deployment, "127.0.0.1", pki=folder), subject)
    assert finding.state == state and said in finding.text and remedy in finding.remedy


def test_the_servers_need_the_host_where_they_listen(deployment: Deployment, folder: Path) -> None:
    case = Case(deployment, "127.0.0.9:7400", pki=folder)
    finding = found(case, "vhub")
    assert finding.state == "problem" and finding.remedy.endswith(f"foosim pki init {folder} FILE --host 127.0.0.9")
    assert found(case, "node.red").state == "fine", "who only connects listens nowhere"
    certificates.renew(folder, "vhub", hosts=["127.0.0.9"])
    assert found(case, "vhub").state == "fine"


def test_ports_that_are_taken_or_elsewhere_are_found(deployment: Deployment) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        finding = found(Case(deployment, f"127.0.0.1:{port}"), "simulation plane")
        assert finding.state == "problem" and "end what listens there" in finding.remedy
    finding = found(Case(deployment, "192.0.2.1:7400", insecure=True), "radio plane")
    assert finding.state == "problem" and "192.0.2.1:7401" in finding.text


@pytest.mark.parametrize(
    ("share", "on_full", "state"),
    [
        (3.0, "stop_world", "problem"),
        (3.0, "continue_unlogged", "warning"),
        (0.7, "stop_world", "warning"),
        (1e-4, "stop_world", "fine"),
    ],
)
def test_a_disk_without_room_is_found_as_by_what_starts_a_run(
    deployment: Deployment, tmp_path: Path, share: float, on_full: str, state: str
) -> None:
    kept = Capture.model_construct(reserve_bytes=int(share * free_bytes(tmp_path)), on_full=on_full)
    case = Case(deployment.model_copy(update={"capture": kept}), "127.0.0.1")
    finding = found(case, "captures")
    assert finding.state == state and "the reserve is" in finding.text
    assert found(case, "runs").state == ("problem" if share > 1 else state), "journals have to be written"
    if share > 1:
        with pytest.raises(Refused, match="nothing was started"):
            check_rooms(kept, case.captures / "a.mcap", runs_folder())
    else:
        assert bool(check_rooms(kept, case.captures / "a.mcap", runs_folder())) == (state == "warning")


@pytest.mark.parametrize(("kept", "state"), [(0, "fine"), (5, "warning")])
def test_a_clock_that_nobody_keeps_is_found(
    deployment: Deployment, monkeypatch: pytest.MonkeyPatch, kept: int, state: str
) -> None:
    monkeypatch.setattr(doctor, "_clock_state", lambda: kept)
    assert found(Case(deployment, "127.0.0.1"), "clock").state == state


def test_a_library_that_is_too_old_or_missing_is_found(deployment: Deployment, monkeypatch: pytest.MonkeyPatch) -> None:
    wanted = ["numpy>=99", "nothing-is-called-so>=1", "pytest>=9999; extra == 'dev'"]
    monkeypatch.setattr(importlib.metadata, "requires", lambda name: wanted)
    case = Case(deployment, "127.0.0.1")
    assert "is not >=99" in found(case, "numpy").text
    assert found(case, "nothing-is-called-so").remedy == "pip install 'nothing-is-called-so>=1'"
    assert "pytest" not in {finding.subject for finding in examine(case)}, "developers' tools are not needed to run"


def test_the_command_tells_it_as_text_and_as_json(folder: Path) -> None:
    (folder / "vhub.key").unlink()
    shown = CliRunner().invoke(app, [str(TABLE), "--pki", str(folder)])
    assert shown.exit_code == 1
    assert any(line.startswith("NO  certificates  vhub: ") for line in shown.output.splitlines())
    told = CliRunner().invoke(app, [str(TABLE), "--json"])
    content = json.loads(told.output)
    assert told.exit_code == 0 and content["well"] is True
    assert content["findings"][0] == {
        "check": "processes",
        "subject": "main",
        "state": "fine",
        "remedy": "",
        "host": "here",
        "text": "has vhub, supervisor, player-blue, player-red",
    }


def test_it_says_which_roles_share_a_process() -> None:
    sets = [f"{role}.process=main" for role in ("supervisor", "vhub", "nodes.red")]
    text = apply_sets(apart(), "table.yaml", sets)
    case = Case(load_deployment(text, "table.yaml"), "127.0.0.1")
    found = [(finding.subject, finding.text) for finding in examine(case) if finding.check == "processes"]
    assert found == [("main", "has vhub, supervisor, red")]
