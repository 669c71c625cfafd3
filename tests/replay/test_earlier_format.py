"""Captures of format 2, written by the version before: `info` and `export` read them, all else names what it needs.

`data/format_2.mcap.gz` is a rehearsal of 30 ticks of the table, `format_2_hashed.mcap.gz` the same with hashes in the
place of payloads (`capture.payloads: hashed`), which format 3 does not have.
"""

from __future__ import annotations

import csv
import gzip
from pathlib import Path

import msgspec
import pytest

from foosim.capture.mcap.checks import CaptureError
from foosim.capture.reader import open_capture
from foosim.capture.start_frame import BadBranch, read_branch
from foosim.deployment.loader import load_deployment
from tests.replay.conftest import TABLE, replay

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
