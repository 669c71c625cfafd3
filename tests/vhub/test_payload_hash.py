"""Captures whose payloads are hashed: no payload is in the file, and everything else is."""

from __future__ import annotations

from base64 import b64encode
from hashlib import blake2b
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec
import pytest

from foosim.protocol.deployment_file import apply_sets, load_deployment
from foosim.protocol.journal import Journal
from foosim.vhub.capture_reader import open_capture
from foosim.vhub.capture_recovery import recover_capture
from foosim.vhub.capture_writer import CaptureWriter
from foosim.vhub.mcap_checks import CaptureError
from foosim.vhub.mcap_file import McapFile, Message

if TYPE_CHECKING:
    from tests.vhub.conftest import HubRun


def written(path: Path, run: HubRun, *sets: str, closings: int | None = None) -> Path:
    """Write the first closings of a run."""
    text = apply_sets(run.text, "table.yaml", sets)
    writer = CaptureWriter(path, load_deployment(text, "table.yaml"), "table.yaml", text, {"run": "run-1"})
    for closing in run.closings[:closings]:
        writer.keep(closing)
    writer.finish()
    return path


def rows(path: Path) -> list[tuple[str, Any]]:
    with path.open("rb") as stream:
        contents = McapFile(stream, path.stat().st_size, str(path)).contents()
        found = [content for content in contents if isinstance(content, Message) and content.data[:1] == b"{"]
    return [(message.topic, msgspec.json.decode(message.data)) for message in found]


def hashed(text: str) -> str:
    return b64encode(blake2b(msgspec.json.decode(f'"{text}"', type=bytes), digest_size=16).digest()).decode()


def in_place(topic: str, row: dict[str, Any]) -> dict[str, Any]:
    """What a row becomes whose payloads are hashed, by other code than the writer's."""
    if topic == "/packets":
        return {**row, "payload": "", "payload_hash": hashed(row["payload"])}
    if topic == "/tick":
        told = [{**d, "payload": "", "payload_hash": hashed(d["payload"])} for d in row["deliveries"]]
        return {**row, "deliveries": told}
    if topic == "/frame":
        boxes = [{**box, "packets": "", "packets_hash": hashed(box["packets"])} for box in row["outboxes"]]
        return {**row, "outboxes": boxes}
    return row


@pytest.fixture(scope="module")
def both(hub_run: HubRun, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp("payloads")
    exact, without = folder / "exact.mcap", folder / "hashed.mcap"
    return written(exact, hub_run), written(without, hub_run, "capture.payloads=hashed")


def test_hashes_stand_where_payloads_stood_and_nothing_else_differs(both: tuple[Path, Path]) -> None:
    exact, without = map(rows, both)
    assert [(topic, in_place(topic, row)) for topic, row in exact] == without
    kinds = {topic for topic, row in exact if in_place(topic, row) != row}
    assert kinds == {"/packets", "/tick", "/frame"}, "the run has packets, deliveries and outboxes"


def test_no_payload_is_anywhere_in_the_file(both: tuple[Path, Path]) -> None:
    payloads = {payload for payload in open_capture(both[0]).packets.payload if len(payload) >= 6}
    with both[1].open("rb") as stream:
        contents = list(McapFile(stream, both[1].stat().st_size, "").contents())
    texts = b"\n".join(content.data for content in contents if isinstance(content, Message))
    assert len(payloads) > 100
    assert not any(payload in texts or b64encode(payload)[:-4] in texts for payload in payloads)


def test_columns_have_one_or_the_other(both: tuple[Path, Path]) -> None:
    exact, without = (open_capture(path).packets for path in both)
    assert set(exact.payload_hash) == {b""} == set(without.payload)
    assert [blake2b(payload, digest_size=16).digest() for payload in exact.payload] == list(without.payload_hash)
    assert exact.size.tolist() == without.size.tolist()
    with pytest.raises(CaptureError, match="its payload is hashed"):
        list(open_capture(both[1]).captured_ticks())


def test_what_a_journal_adds_is_hashed_too(hub_run: HubRun, tmp_path: Path, both: tuple[Path, Path]) -> None:
    with Journal(tmp_path / "journals", "vhub") as journal:
        for record in hub_run.records:
            journal.append(record)
    left = tmp_path / "left.mcap"
    left.write_bytes(both[1].read_bytes()[: both[1].stat().st_size // 3])
    found = recover_capture(left, tmp_path / "journals")
    assert found is not None and found.is_whole and found.added_ticks > 40
    packets, whole = open_capture(left).packets, open_capture(both[1]).packets
    assert set(packets.payload) == {b""} and len(packets) == len(whole)
    assert packets.payload_hash.tolist() == whole.payload_hash.tolist()
