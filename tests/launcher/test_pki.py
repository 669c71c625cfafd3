"""Certificates: what is issued, that it is accepted, what is refused, and how that is said."""

import json
import os
import stat
from datetime import timedelta
from pathlib import Path
from typing import Final

import pytest
from cryptography import x509
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID
from typer.testing import CliRunner

from foosim.cli.pki import app
from foosim.common import wall_clock
from foosim.common.errors import BadValue, Refused
from foosim.launcher import pki
from foosim.runtime.transport import certificates
from foosim.runtime.transport.certificate_files import hosts_of, read_certificate
from foosim.runtime.transport.certificate_folder import CertificateError
from foosim.runtime.transport.certificates import (
    check_host,
    load_credentials,
    operator_credentials,
    viewer_credentials,
)

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    path = tmp_path / "pki"
    pki.init(path)
    return path


def run(*arguments: str | Path) -> tuple[int, str]:
    """Exit code and output of the command; a refusal is its text."""
    result = CliRunner().invoke(app, list(map(str, arguments)))
    if isinstance(result.exception, Refused):
        return result.exception.exit_code, str(result.exception)
    return result.exit_code, result.output


def test_a_certificate_is_what_the_docs_say(folder: Path) -> None:
    pki.issue(folder, ["supervisor"], ["10.0.0.1", "sim1.lan"])
    ca, leaf = read_certificate(folder / "ca.pem"), read_certificate(folder / "supervisor.pem")
    constraints = ca.extensions.get_extension_for_class(x509.BasicConstraints)
    assert constraints.critical and constraints.value == x509.BasicConstraints(ca=True, path_length=0)
    assert (ca.not_valid_after_utc - ca.not_valid_before_utc).days == 3650
    assert (leaf.not_valid_after_utc - leaf.not_valid_before_utc).days == 90
    public = leaf.public_key()
    assert isinstance(public, ec.EllipticCurvePublicKey) and isinstance(public.curve, ec.SECP256R1)
    assert set(hosts_of(leaf)) >= {"supervisor", "localhost", "127.0.0.1", "::1", "10.0.0.1", "sim1.lan"}
    usage = leaf.extensions.get_extension_for_class(x509.ExtendedKeyUsage).value
    assert set(usage) == {ExtendedKeyUsageOID.CLIENT_AUTH, ExtendedKeyUsageOID.SERVER_AUTH}
    assert not leaf.extensions.get_extension_for_class(x509.BasicConstraints).value.ca
    for path in folder.iterdir():
        assert stat.S_IMODE(path.stat().st_mode) == 0o600, path
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700


def test_what_is_issued_is_accepted_and_nothing_is_overwritten(folder: Path) -> None:
    pki.issue(folder, ["node.red", "client.a_b"])
    credentials = load_credentials(folder, "node.red")
    assert credentials is not None and credentials.name == "red" and credentials.ends_soon(wall_clock.now_utc()) == ""
    assert load_credentials(None, "node.red") is None, "no folder, no certificates"
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    with pytest.raises(Refused, match=r"not overwritten: .*node\.red\.pem, .*node\.red\.key"):
        pki.issue(folder, ["node.blue", "node.red"])
    with pytest.raises(Refused, match=r"ca\.pem"):
        pki.init(folder)
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before, "nothing was made"


def test_renewed_is_the_same_but_for_the_dates(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    everybody = ["supervisor", "node.red"]
    pki.issue(folder, everybody, ["10.0.0.7"], days=10)
    old, key = read_certificate(folder / "node.red.pem"), (folder / "node.red.key").read_bytes()
    in_days(4, monkeypatch)
    assert pki.provide(folder, everybody, within_days=3) == []
    made = pki.provide(folder, ["node.red"], within_days=7)
    assert made == [folder / "node.red.pem"]
    new = read_certificate(folder / "node.red.pem")
    assert new.not_valid_after_utc - old.not_valid_after_utc > timedelta(days=3)
    assert (new.not_valid_after_utc - new.not_valid_before_utc).days == 10
    assert hosts_of(new) == hosts_of(old) and new.serial_number != old.serial_number
    assert (folder / "node.red.key").read_bytes() == key
    assert load_credentials(folder, "node.red") is not None
    assert pki.provide(folder, everybody, within_days=7) == [folder / "supervisor.pem"], "the other one lasts"


def test_a_certificate_of_another_root_is_issued_anew_and_one_of_somebody_else_is_not(folder: Path) -> None:
    pki.issue(folder, ["node.red", "node.blue"])
    for name in ("ca.pem", "ca.key"):
        (folder / name).unlink()
    assert [path.name for path in pki.provide(folder, ["node.red"])] == ["ca.pem", "node.red.pem"]
    assert load_credentials(folder, "node.red") is not None
    before = (folder / "node.red.pem").read_bytes()
    (folder / "node.blue.pem").write_bytes(before)
    with pytest.raises(CertificateError, match=r"a certificate of 'node\.red', not of node\.blue"):
        pki.provide(folder, ["node.blue"])
    assert (folder / "node.blue.pem").read_bytes() == before


def in_days(days: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let it be so many days later."""
    then = wall_clock.now_utc() + timedelta(days=days)
    monkeypatch.setattr(wall_clock, "now_utc", lambda: then)


GARBAGE: Final = b"-----BEGIN CERTIFICATE-----\nAAAA\n-----END CERTIFICATE-----\n"
SPOILED: Final[tuple[tuple[dict[str, str | bytes | None], float, str], ...]] = (
    ({}, 91, r"node\.red\.pem: expired on .* UTC; foosim pki init .* FILE"),
    ({}, -2 / 24, r"ca\.pem: valid from .* mind the clock"),
    ({}, 3700, r"ca\.pem: expired on"),
    (
        {"node.red.key": "node.blue.key"},
        0,
        r"node\.red\.key: the key does not belong to the certificate node",
    ),
    (
        {"node.red.pem": "node.blue.pem", "node.red.key": "node.blue.key"},
        *(0, r"node\.red\.pem: a certificate of 'node\.blue', not of node\.red"),
    ),
    ({"ca.pem": "../other/ca.pem"}, 0, r"node\.red\.pem: not issued by the root in ca\.pem beside it"),
    ({"ca.pem": "node.blue.pem"}, 0, r"ca\.pem: not the certificate of an authority"),
    ({"node.red.pem": GARBAGE}, 0, r"node\.red\.pem: not a certificate in PEM"),
    ({"node.red.key": b"\0\1\2"}, 0, r"node\.red\.key: not a private key in PEM"),
    ({"node.red.key": None}, 0, r"node\.red\.key: cannot be read, No such file"),
    ({"node.red.pem": None}, 0, r"has no certificate of node\.red; it has: node\.blue"),
    ({"ca.pem": None}, 0, r"has no ca\.pem; foosim pki init"),
)
"""What replaces which files, the days that pass, and what is said."""


@pytest.mark.parametrize(("files", "days", "said"), SPOILED)
def test_what_would_be_refused_is_refused_before_anything_is_opened(
    folder: Path, monkeypatch: pytest.MonkeyPatch, files: dict[str, str | bytes | None], days: float, said: str
) -> None:
    pki.issue(folder, ["node.red", "node.blue"])
    pki.init(folder.parent / "other")
    for name, content in files.items():
        if content is None:
            (folder / name).unlink()
        else:
            (folder / name).write_bytes(content if isinstance(content, bytes) else (folder / content).read_bytes())
    in_days(days, monkeypatch)
    with pytest.raises(CertificateError, match=said) as refused:
        load_credentials(folder, "node.red")
    assert refused.value.exit_code == 3
    if (folder / "ca.pem").exists() and (folder / "node.red.pem").exists():
        code, output = run("show", folder)
        assert code == 1 and any(
            line.startswith(("node.red ", "foosim ", "node.blue ")) for line in output.splitlines()
        )


def test_a_certificate_that_ends_soon_is_told(folder: Path) -> None:
    pki.issue(folder, ["node.red"], days=5)
    credentials = load_credentials(folder, "node.red")
    assert credentials is not None and "renew it" in credentials.ends_soon(wall_clock.now_utc())


def test_who_listens_has_a_certificate_for_that_host(folder: Path) -> None:
    pki.issue(folder, ["supervisor"], ["10.0.0.1"])
    credentials = load_credentials(folder, "supervisor")
    check_host(credentials, "tls/10.0.0.1:7400")
    check_host(credentials, "tls/[::1]:7400")
    check_host(None, "tcp/10.9.9.9:7400")
    with pytest.raises(CertificateError, match=r"not for 10\.0\.0\.2, where supervisor listens: .* --host 10\.0\.0\.2"):
        check_host(credentials, "tls/10.0.0.2:7400")
    pki.issue(folder, ["node.red"])
    code, output = run("init", folder, TABLE, "--host", "10.0.0.2", "--host", "10.0.0.1")
    made = {Path(line).stem for line in output.split()}
    assert code == 0 and {"supervisor", "vhub", "node.blue"} <= made and "node.red" not in made
    node = hosts_of(read_certificate(folder / "node.blue.pem"))
    assert not {"10.0.0.1", "10.0.0.2"} & set(node), "it listens nowhere"
    check_host(load_credentials(folder, "supervisor"), "tls/10.0.0.2:7400")


def test_an_operator_is_the_only_one_or_named(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("FOOSIM_OPERATOR", raising=False)
    assert operator_credentials(None) is None
    with pytest.raises(CertificateError, match="no operator's certificate"):
        operator_credentials(folder)
    pki.issue(folder, ["operator.ann", "operator.bob"])
    with pytest.raises(CertificateError, match=r"several operators \(operator\.ann, operator\.bob\)"):
        operator_credentials(folder)
    monkeypatch.setenv("FOOSIM_OPERATOR", "bob")
    found = operator_credentials(folder)
    assert found is not None and found.identity == "operator.bob"


def test_a_viewer_is_the_only_one_or_named_or_the_operator(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for variable in ("FOOSIM_OPERATOR", "FOOSIM_VIEWER"):
        monkeypatch.delenv(variable, raising=False)
    assert viewer_credentials(None) is None
    for issued, expected in (("operator.ann", "operator.ann"), ("viewer.desk", "viewer.desk")):
        pki.issue(folder, [issued])
        found = viewer_credentials(folder)
        assert found is not None and found.identity == expected
    pki.issue(folder, ["viewer.wall"])
    with pytest.raises(
        CertificateError, match=r"several viewers \(viewer\.desk, viewer\.wall\): set FOOSIM_VIEWER=NAME"
    ):
        viewer_credentials(folder)
    monkeypatch.setenv("FOOSIM_VIEWER", "wall")
    found = viewer_credentials(folder)
    assert found is not None and found.identity == "viewer.wall"


def test_a_client_gets_a_certificate_by_its_name(folder: Path) -> None:
    code, output = run("client", folder, "hand", "--days", "7")
    assert (code, output) == (0, f"{folder / 'client.hand.pem'}\n")
    found = load_credentials(folder, "client.hand")
    assert found is not None and found.until is not None and found.until - wall_clock.now_utc() < timedelta(days=7)
    assert stat.S_IMODE((folder / "client.hand.key").stat().st_mode) == 0o600
    before = (folder / "client.hand.pem").read_bytes()
    code, output = run("client", folder, "other", "hand")
    assert code == 3 and f"exists already, and is not overwritten: {folder / 'client.hand.pem'}" in output
    assert (folder / "client.hand.pem").read_bytes() == before and not (folder / "client.other.pem").exists()


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (["init", "FOLDER", "TABLE", "--host", "a b"], 2, "not a host name or an IP address, 'a b'"),
        (["init", "FOLDER", "TABLE", "--days", "9999"], 2, "days of a certificate are from 1 to 825"),
        (["init", "FOLDER", "TABLE", "--send"], 2, "--send: the deployment places nothing on a host, 'table'"),
        (["init", "FOLDER", "NOWHERE"], 2, "there is no such file"),
        (["client", "FOLDER", "Hand"], 2, "not a name for a client, 'Hand'"),
        (["client", "FOLDER", "../hand"], 2, "not a name for a client, '../hand'"),
        (["client", "FOLDER", "hand", "--days", "0"], 2, "days of a certificate are from 1 to 825"),
        (["client", "NOWHERE", "hand"], 3, "has no ca.pem; foosim pki init"),
        (["show", "NOWHERE"], 3, "cannot be read, No such file"),
    ],
)
def test_what_cannot_be_done_is_said(folder: Path, arguments: list[str], code: int, said: str) -> None:
    places = {"FOLDER": str(folder), "NOWHERE": str(folder.parent / "nowhere"), "TABLE": str(TABLE)}
    found, output = run(*(places.get(argument, argument) for argument in arguments))
    assert found == code and said in output, output


@pytest.mark.parametrize("who", ["robot.red", "node.Red"])
def test_only_identities_get_certificates(folder: Path, who: str) -> None:
    with pytest.raises(BadValue, match=r"not an identity \(supervisor, vhub, node.NAME,"):
        pki.issue(folder, [who])
    with pytest.raises(CertificateError, match=r"has no ca.pem; foosim pki init .* FILE makes one"):
        pki.issue(folder.parent / "nowhere", ["node.red"])


def test_without_the_roots_key_nothing_is_issued(folder: Path) -> None:
    os.remove(folder / "ca.key")
    for words in (("init", folder, TABLE), ("client", folder, "hand")):
        code, output = run(*words)
        assert code == 3 and "certificates are issued where the root's key is kept" in output


def test_a_whole_deployment_is_issued_in_one_command(folder: Path) -> None:
    pki.issue(folder, ["node.red"])
    code, output = run("init", folder, TABLE, "--host", "10.0.0.1")
    assert code == 0 and "node.red.pem" not in output and "ca.pem" not in output
    everybody = {
        "supervisor",
        "vhub",
        "node.red",
        "node.blue",
        "client.player-red",
        "client.player-blue",
        "operator.admin",
    }
    assert set(certificates.identities_in(folder)) == everybody
    code, output = run("show", folder, "--json")
    shown = {its["identity"]: its for its in json.loads(output)["certificates"]}
    assert code == 0 and shown.keys() == everybody | {"foosim"}
    assert "10.0.0.1" in shown["vhub"]["hosts"] and not any(its["problem"] for its in shown.values())
