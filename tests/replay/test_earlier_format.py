"""Captures of earlier formats. Of format 2: `info` and `export` read them, all else names what it needs. Of format 3,
whose rows lack counts within channels: everything reads them, and says that robots' draws are not made again.

`data/format_2.mcap.gz` is a rehearsal of 30 ticks of the table, `format_2_hashed.mcap.gz` the same with hashes in the
place of payloads (`capture.payloads: hashed`), which format 3 does not have.
"""

from __future__ import annotations

import csv
import gzip
from pathlib import Path

import msgspec
import pytest

from foosim.analysis.explain import PacketName, explain_packet
from foosim.capture.mcap.checks import CaptureError
from foosim.capture.reader import open_capture
from foosim.capture.rows import PACKETS, PacketRow
from foosim.capture.start_frame import BadBranch, read_branch
from foosim.deployment.loader import load_deployment
from foosim.rehearsal.run import rehearse
from foosim.replay.what_if import what_if
from foosim.vhub.state import hub_state
from tests.replay.conftest import TABLE, messages_of, replay, rewritten

LINKS = (
    "network.links=[{id: camera, from: camera, to: player-blue, delay: 30 ms, loss: 5 %},"
    " {id: all, from: '*', to: '*', delay: 1 ms, jitter: {shape: gamma, sd: 1 ms}, loss: 20 %, duplicate: 20 %,"
    " reorder: {probability: 20 %, extra: 3 ms}, corrupt: {bit_error_rate: 0.1 %}}]"
)
UNKNOWN = "; its draws are not made again: the capture's format has no counts within channels"
DATA = Path(__file__).parent / "data"
TEXT = "a capture of format 2, written by foosim 0.1.0, which can do this. foosim 0."


@pytest.fixture(params=["format_2", "format_2_hashed"])
def earlier(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    path = tmp_path / f"{request.param}.mcap"
    path.write_bytes(gzip.decompress((DATA / f"{path.name}.gz").read_bytes()))
    return path


def test_info_reads_it(earlier: Path) -> None:
    done = replay("info", earlier, "--json")
    info = msgspec.json.decode(done.out)
    assert done.code == 0 and info["finished"] and info["metadata"]["format"] == "2"
    assert (info["ticks"], info["packets"]["offered"], info["nodes"]) == (30, 108, ["n1", "n2"])
    assert "player-red" in info["clients"] and info["topics"]["/tick"] == 31


@pytest.mark.parametrize(("what", "count"), [("packets", 108), ("commands", 48), ("poses", 87), ("tick", 31)])
def test_export_reads_it(earlier: Path, tmp_path: Path, what: str, count: int) -> None:
    out = tmp_path / "out.csv"
    assert replay("export", earlier, "--what", what, "-o", out).code == 0
    with out.open() as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == count
    if what == "packets":
        has_payloads = earlier.name == "format_2.mcap"
        assert {bool(row["payload"]) for row in rows} == {has_payloads}
        assert {int(row["size"]) for row in rows} == {len(row["payload"]) // 2 for row in rows} or not has_payloads
    if what == "commands" and earlier.name == "format_2.mcap":
        assert all(row["slide"] for row in rows)


@pytest.mark.parametrize("command", ["verify", "whatif", "recover", "cut", "play", "diff"])
def test_all_else_says_what_it_needs(earlier: Path, tmp_path: Path, command: str) -> None:
    out = tmp_path / "out.mcap"
    more: dict[str, list[str | Path]] = {"cut": ["-o", out], "diff": [earlier]}
    done = replay(command, earlier, *more.get(command, []))
    assert done.code != 0 and f"{earlier}: {TEXT}" in done.err, done
    assert not out.exists()


def test_no_run_begins_with_it(earlier: Path) -> None:
    with pytest.raises(BadBranch, match=TEXT):
        read_branch(f"{earlier}@last", load_deployment(TABLE.read_text(), TABLE.name))
    with pytest.raises(CaptureError, match=TEXT):
        open_capture(earlier)


@pytest.fixture
def without_counts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A capture as format 3 has it: robots' packets drew by other addresses, and rows have no counts."""
    monkeypatch.setattr(hub_state, "robot_number", lambda tick, count: 7_000_000 + 9 * tick + count)
    whole, path = tmp_path / "whole.mcap", tmp_path / "format_3.mcap"
    rehearse(TABLE.read_text(), TABLE.name, 60, 1, ["engine=pure", LINKS], capture=whole)
    monkeypatch.undo()
    assert not any(b'"count"' in message.data for message in messages_of(whole) if message.topic == PACKETS)
    return rewritten(whole, path, messages_of(whole), format="3")


def test_draws_of_robots_in_format_3_are_not_made_again(without_counts: Path, tmp_path: Path) -> None:
    """`explain` says so in a sentence, and tells what the row has; draws of players are as they were."""
    capture, robots = open_capture(without_counts), 0
    newer = open_capture(rewritten(without_counts, tmp_path / "newer.mcap", messages_of(without_counts), format="4"))
    for row in capture.rows(PACKETS):
        assert isinstance(row, PacketRow)
        which = PacketName(row.source, row.sequence, row.destination, row.copy)
        explained = explain_packet(capture, which)
        is_robot = row.source in capture.deployment.robots
        robots += is_robot
        assert explained.agrees and explained.verdict.endswith(UNKNOWN) == is_robot
        if row.loss_word and is_robot:
            assert not explain_packet(newer, which).agrees
        told = {step.stage: step.text for step in explained.steps}
        if row.loss_word:
            assert f"loss draw {int(row.loss_word, 16) / 2**64:.6g} is" in told["residual"]
    assert robots > 50


def test_all_else_reads_format_3(without_counts: Path, tmp_path: Path) -> None:
    out = tmp_path / "part.mcap"
    assert replay("verify", without_counts).code == replay("info", without_counts).code == 0
    assert replay("cut", without_counts, "--to", "60 ms", "-o", out).code == 0
    assert open_capture(out).about.metadata["format"] == "3"
    found = what_if(open_capture(without_counts))
    robots = {change.source for change in found.changes} & open_capture(without_counts).deployment.robots.keys()
    assert robots and found.caveats == (
        "its format has no counts within channels: packets of robots are judged by other draws",
    )


def test_a_recovered_capture_of_format_3_has_format_3(without_counts: Path, tmp_path: Path) -> None:
    """Its rows are written again as they are, without counts."""
    torn, out = tmp_path / "torn.mcap", tmp_path / "recovered.mcap"
    torn.write_bytes(without_counts.read_bytes()[:-200])
    assert replay("recover", torn, "-o", out).code == 3, "there is no journal of it"
    assert open_capture(out).about.metadata["format"] == "3"
