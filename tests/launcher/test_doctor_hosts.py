"""What is made of the answers of hosts, and what a host looks at that the supervisor's machine does not."""

from __future__ import annotations

import io
import socket
from contextlib import closing
from pathlib import Path
from typing import Any, Final

import msgspec
import pytest

from foosim.common.errors import Malformed
from foosim.deployment.hosts import Host
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.deployment.schema import Deployment
from foosim.launcher import pki as certificates
from foosim.launcher.doctor import CLOCK_WARN_NS, GREETING, Answer, Case, Finding, Question, compared, examine, serve
from foosim.launcher.hosts import Remote
from foosim.launcher.pki import files_for, fingerprint
from foosim.runtime.transport.certificate_files import read_certificate

CLUSTER: Final = Path(__file__).parents[2] / "deploy" / "cluster.yaml"
LISTEN: Final = "192.168.10.1:7400"
LEFT: Final = Remote("left", Host(address="a.lan"))
HERS: Final = Finding("disk", "state", "fine", "9 GiB", host="who it takes itself for")


def found(check: str, subject: str, fingerprint: str = "aa", **about: Any) -> Finding:
    findings = compared(LEFT, Answer(fingerprint, [HERS]), "aa", **about)
    assert {finding.host for finding in findings} == {"left"}, "whatever it says"
    (finding,) = [finding for finding in findings if (finding.check, finding.subject) == (check, subject)]
    assert (finding.state == "fine") == (finding.remedy == ""), finding
    return finding


@pytest.mark.parametrize(
    ("offset_ns", "error_ns", "state"),
    [
        (CLOCK_WARN_NS, 0, "fine"),
        (-CLOCK_WARN_NS, 0, "fine"),
        (CLOCK_WARN_NS + 1, 0, "warning"),
        (-CLOCK_WARN_NS - 1, 0, "warning"),
        (10 * CLOCK_WARN_NS, 9 * CLOCK_WARN_NS, "fine"),  # it may be right: the way took long
        (3_600 * 10**9, 10**6, "warning"),
    ],
)
def test_a_clock_that_is_surely_off_is_told(offset_ns: int, error_ns: int, state: str) -> None:
    finding = found("clock", "offset", offset_ns=offset_ns, error_ns=error_ns)
    assert finding.state == state and finding.text.startswith(f"{offset_ns / 1e6:+.0f} ms")


def test_other_arithmetic_is_told_as_the_handshake_would() -> None:
    assert found("arithmetic", "compared").state == "fine"
    assert found("arithmetic", "compared", "bb").state == "problem"
    assert found("arithmetic", "compared", "bb", mixed_cpu=True).state == "warning"


def test_a_vhub_that_would_not_be_reached_is_told() -> None:
    radio = "tcp/a.lan:7401"
    assert found("network", "radio plane", radio=radio).state == "fine"
    finding = found("network", "radio plane", radio=radio, not_reached="no answer within 3 s")
    assert finding.state == "problem" and "tcp/a.lan:7401 is not reached from here: no answer" in finding.text
    assert not [finding for finding in compared(LEFT, Answer("aa", []), "aa") if finding.check == "network"]


# --- on a host -------------------------------------------------------------------------------------------------------


def deployed(*sets: str) -> Deployment:
    return load_deployment(apply_sets(CLUSTER.read_text(), "cluster.yaml", sets), "cluster.yaml")


def on_host(case: Case) -> dict[str, Finding]:
    return {finding.subject: finding for finding in examine(case)}


@pytest.fixture(autouse=True)
def state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))


def test_a_host_has_its_own_certificates_of_the_runs_root(tmp_path: Path) -> None:
    folder, there = tmp_path / "pki", tmp_path / "there"
    deployment = deployed()
    ca = fingerprint(read_certificate(certificates.init(folder)))
    certificates.issue(folder, ["node.blue", "vhub"])
    there.mkdir()
    for name, content in (files_for(deployment, "left", folder) | files_for(deployment, "radio", folder)).items():
        (there / name).write_bytes(content)
        (there / name).chmod(0o600)
    left = Case(deployment, LISTEN, pki=there, host="left", ca=ca)
    findings = on_host(left)
    assert findings["node.blue"].state == findings["ca.pem"].state == "fine"
    assert {"node.red", "vhub"}.isdisjoint(findings), "others have these"
    assert {finding.host for finding in findings.values()} == {"left"}
    vhub = on_host(Case(deployment, LISTEN, pki=there, host="radio", ca=ca))["vhub"]
    assert vhub.text.endswith("not for 192.168.10.4"), "where it listens is not where the supervisor does"
    assert vhub.remedy == "foosim pki init DIR FILE --host 192.168.10.4 --send"
    assert on_host(Case(deployment, LISTEN, pki=there, host="left", ca="00"))["ca.pem"].state == "problem"
    (there / "ca.key").write_bytes((folder / "ca.key").read_bytes())
    assert on_host(left)["ca.key"].state == "problem"
    (there / "node.blue.pem").unlink()
    assert on_host(left)["node.blue"].remedy == "foosim pki init DIR FILE --send"
    nowhere = on_host(Case(deployment, LISTEN, host="left", ca=ca))["folder"]
    assert nowhere.state == "problem" and "set hosts.left.pki" in nowhere.remedy


def test_a_host_answers_a_question_and_tries_to_reach_the_supervisor() -> None:
    text = apply_sets(CLUSTER.read_text(), "cluster.yaml", ["hosts.radio.address=127.0.0.1"])
    with closing(socket.create_server(("127.0.0.1", 0))) as taken:
        port = taken.getsockname()[1]
        where = f"tcp/127.0.0.1:{port}"
        question = Question("radio", "cluster.yaml", text, f"127.0.0.1:{port - 1}", True, "", where, where)
        said = io.BytesIO()
        serve(io.BytesIO(msgspec.json.encode(question) + b"\n"), said)
        greeting, clock, line = said.getvalue().splitlines()
        answer = msgspec.json.decode(line, type=Answer)
    assert greeting == GREETING.encode() and clock.isdigit()
    by_subject = {finding.subject: finding for finding in answer.findings}
    assert by_subject["supervisor"].state == "fine"
    assert by_subject["radio plane"].state == "problem", "its port is taken"
    said = io.BytesIO()
    serve(io.BytesIO(msgspec.json.encode(question) + b"\n"), said)
    answer = msgspec.json.decode(said.getvalue().splitlines()[2], type=Answer)
    by_subject = {finding.subject: finding for finding in answer.findings}
    refused = by_subject["supervisor"]
    assert refused.state == "problem" and refused.text.endswith("is not reached: Connection refused")
    with pytest.raises(Malformed, match="not a question"):
        serve(io.BytesIO(b"what\n"), io.BytesIO())
