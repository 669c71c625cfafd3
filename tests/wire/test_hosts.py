"""A run with certificates that is spread over hosts, through a real ssh to a real sshd on this machine.

What the doctor finds of the hosts, what brings them their certificates, and that it runs then.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import pytest

from foosim.capture.info import capture_info
from foosim.deployment.loader import apply_sets
from foosim.launcher import doctor as doctor_remote
from foosim.launcher.doctor import LIMIT_S, Question, checks_of
from foosim.launcher.hosts import Remote
from tests.apart import apart
from tests.wire import sshd
from tests.wire.conftest import LONG
from tests.wire.test_run import free_port, last_json
from tests.wire.test_secured_run import certificates
from tests.wire.test_ssh import There

if TYPE_CHECKING:
    from tests.wire.conftest import House

pytestmark = pytest.mark.skipif(bool(sshd.missing()), reason=sshd.missing())

OWN: Final = (
    *("ca.pem", "node.blue.key", "node.blue.pem", "process.one-there.key", "process.one-there.pem"),
    *("vhub.key", "vhub.pem"),
)
PLACED: Final = ("nodes.blue.host=there", "vhub.host=there", "players={}", "engine=pure", LONG)


@pytest.fixture
def other(tmp_path: Path) -> Iterator[There]:
    made = There(tmp_path)
    yield made
    made.close()


def deployed(path: Path, hosts: dict[str, Any]) -> Path:
    path.write_text(apply_sets(apart(), "table.yaml", [f"hosts={json.dumps(hosts)}", *PLACED]))
    return path


def examined(house: House, *arguments: str | Path) -> tuple[int, dict[tuple[str, str, str], dict[str, str]]]:
    """Exit code and findings of the doctor, by host, check and subject."""
    code, out, err = house.ask("foosim", "doctor", *arguments, "--json")
    assert code in (0, 1), err
    content = json.loads(out)
    assert content["well"] == (code == 0)
    return code, {(found["host"], found["check"], found["subject"]): found for found in content["findings"]}


def test_hosts_are_examined_get_their_certificates_and_run(other: There, house: House) -> None:
    folder, there = certificates(house.folder / "certs"), house.folder / "there-pki"
    host = other.host(pki=str(there))
    file = deployed(house.folder / "run.yaml", {"there": host, "gone": other.host(port=free_port())})
    asked = file, "--listen", f"127.0.0.1:{free_port()}", "--pki", folder
    code, found = examined(house, *asked)
    gone = [finding for (where, *_), finding in found.items() if where == "gone"]
    assert [finding["subject"] for finding in gone] == ["127.0.0.1"] and code == 1
    assert "cannot be reached" in gone[0]["text"] and gone[0]["remedy"].startswith("make `ssh -F ")
    root = found["there", "certificates", "ca.pem"]
    assert root["state"] == "problem" and root["remedy"] == "foosim pki init DIR FILE --send"

    deployed(file, {"there": host})
    code, out, err = house.ask("foosim", "pki", "init", folder, file, "--send")
    brought = sorted(line for line in out.split() if line.startswith(f"{there}/"))
    assert code == 0 and brought == [f"{there}/{name}" for name in OWN], err
    assert sorted(path.name for path in there.iterdir()) == list(OWN), "and nothing of others"
    for path in there.iterdir():
        assert path.read_bytes() == (folder / path.name).read_bytes() and path.stat().st_mode & 0o777 == 0o600
        if path.suffix == ".key":
            (folder / path.name).unlink()  # where the others are is enough

    (folder / "ca.key").unlink()
    code, found = examined(house, *asked)
    assert code == 0, [finding for finding in found.values() if finding["state"] == "problem"]
    for about in (("network", "supervisor"), ("network", "radio plane"), ("certificates", "vhub"), ("clock", "offset")):
        assert found["there", *about]["state"] == "fine"
    assert ("there", "certificates", "node.red") not in found and ("here", "certificates", "node.red") in found

    digests = []
    for shape in ("each", "one"):
        run = [*asked, "--for", "20 ms", "--json", "--processes", shape]
        code, out, err = house.end(house.start("foosim", "up", *run))
        assert code == 0, err
        content = last_json(out)
        assert capture_info(Path(house.folder / content["capture"])).finished, "home from the vHub's host"
        digests.append(content["digest"])
    assert digests[0] == digests[1] and "process one-there has vhub, blue" in err


def why_silent(remote: Remote, limit_s: float = LIMIT_S) -> tuple[str, str]:
    """What is said, and said to do, of a host that does not answer."""
    (finding,) = checks_of(remote, Question("there", "", "", "", False, "", "", ""), limit_s)
    assert (finding.subject, finding.state, finding.host) == ("127.0.0.1", "problem", "there")
    return finding.text, finding.remedy


def test_why_a_host_does_not_answer_is_said(other: There, monkeypatch: pytest.MonkeyPatch) -> None:
    """One that takes the connection and says nothing holds nobody up."""
    silent = other.remote("-o", "ProxyCommand=sleep 1000", "-o", "ConnectTimeout=1000")
    assert why_silent(silent, 0.5) == ("no answer within 0.5 s", f"make `{silent.typed}` work")
    text, remedy = why_silent(other.remote(commands="/nowhere"))
    assert "there is no /nowhere/foosim on host there" in text and remedy.startswith("install foosim ")
    text, remedy = why_silent(other.remote())
    assert text == "ended with exit code 2 on host there: :1:1: no YAML document, ''", "it was asked nonsense"
    monkeypatch.setattr(doctor_remote, "version", lambda name: "99.0")
    text, remedy = why_silent(other.remote())
    assert "is installed there, the run has 99.0" in text and remedy.startswith("install foosim 99.0 on host there")
