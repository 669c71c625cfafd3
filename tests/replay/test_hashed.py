"""Captures without payloads: what is done with them as with all, and what is refused, by name."""

from __future__ import annotations

from pathlib import Path

import msgspec
import pytest

from foosim.capture.reader import open_capture
from foosim.capture.start_frame import read_branch
from foosim.deployment.loader import load_deployment
from foosim.rehearsal.run import rehearse
from foosim.replay.what_if import what_if
from tests.replay.conftest import TABLE, disturb, replay

NETWORK = (
    "network.links=[{id: w, from: '*', to: '*', delay: 1 ms, loss: 5 %, rate: 400 kbit/s,"
    " corrupt: {bit_error_rate: 0.0005 p, deliver: true}, duplicate: 5 %}]"
)


def captured(path: Path, *sets: str) -> Path:
    rehearse(TABLE.read_text(), TABLE.name, 100, 2, ["engine=pure", NETWORK, *sets], prepare=disturb, capture=path)
    return path


@pytest.fixture(scope="module")
def hashed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return captured(tmp_path_factory.mktemp("hashed") / "run.mcap", "capture.payloads=hashed")


def test_info_says_it_first(hashed: Path) -> None:
    lines = replay("info", hashed).out.splitlines()
    assert lines[1].startswith("  PAYLOADS ARE HASHED")
    assert msgspec.json.decode(replay("info", hashed, "--json").out)["payloads"] == "hashed"


def test_what_needs_payloads_is_refused(hashed: Path, tmp_path: Path) -> None:
    for arguments, text in (
        (("verify", hashed), "its payloads are hashed (capture.payloads), and a verification needs them as they were"),
        (("export", hashed, "--what", "commands", "-o", tmp_path / "o.csv"), "and the table commands needs them"),
        (("play", hashed, "--topic", "/packets/camera"), "--topic: payloads of this capture are hashed"),
    ):
        done = replay(*arguments)
        assert done.code == 2 and text in done.err, done
    assert not (tmp_path / "o.csv").exists()


def test_the_rest_is_done(hashed: Path, tmp_path: Path) -> None:
    exact = captured(tmp_path / "exact.mcap")
    found, theirs = what_if(open_capture(hashed)), what_if(open_capture(exact))
    assert (found.packets, found.changed, found.inputs_changed) == (theirs.packets, 0, 0) and found == theirs
    done = replay("export", hashed, "-o", tmp_path / "o.csv")
    assert done.code == 0 and "payload_hash" in (tmp_path / "o.csv").read_text().splitlines()[0]
    deployment = load_deployment(open_capture(hashed).about.deployment_text, "table.yaml")
    mine, other = (read_branch(f"{path}@0.1s", deployment).start for path in (hashed, exact))
    assert (mine.origin.digest, mine.values) == (other.origin.digest, other.values)
    assert replay("cut", hashed, "--from", "0.1 s", "-o", tmp_path / "part.mcap").code == 0
    assert "PAYLOADS ARE HASHED" in replay("info", tmp_path / "part.mcap").out


def test_a_world_that_is_not_there_is_not_computed_again(tmp_path: Path) -> None:
    places = "places: {player-red: [-2 m, 1 m, 1 m], player-blue: [1 m, 0 m, 1 m], camera: [0 m, 0 m, 2 m]}"
    network = f"network={{radios: {{z: {{preset: zigbee}}}}, robots: {{'*': [z]}}, {places}}}"
    path = captured(tmp_path / "run.mcap", "capture.payloads=hashed", network)
    done = replay("whatif", path)
    assert done.code == 2 and "a world that is computed again needs them" in done.err, done
