"""A vHub that something ends before its run: what it leaves is gone on with by the next one, or recovered."""

from __future__ import annotations

import gc
import re
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from threading import Event
from typing import TYPE_CHECKING

import msgspec
import pytest

from foosim.capture import contents as capture_contents
from foosim.capture import file as capture_file
from foosim.capture.info import capture_info
from foosim.capture.parts import end_of, has_end
from foosim.capture.reader import open_capture
from foosim.common import limits
from foosim.common.errors import Failed
from foosim.common.json_text import decode_json
from foosim.deployment.schema import Deployment
from foosim.protocol import channels
from foosim.protocol.channels import Channel
from foosim.protocol.codec import decode, decode_any, encode
from foosim.protocol.messages import CAPTURE, Build, End, Heartbeat
from foosim.runtime.command import DONE, FAILED
from foosim.runtime.journal import Journal, journal_files
from foosim.runtime.roles.shell import Process
from foosim.runtime.transport.session import Session
from foosim.vhub.main import HubOptions, HubShell
from foosim.vhub.recording.recorder import Recorder
from foosim.vhub.recording.recovery import UNCLEAN, recover_capture
from foosim.vhub.state.records import HeadRecord, HubRecord, TickRecord
from tests.vhub.conftest import NAME
from tests.vhub.test_capture_recovery import LAST

if TYPE_CHECKING:
    from tests.vhub.conftest import HubRun

CAPTURED = 20


@pytest.fixture
def plane() -> Iterator[Session]:
    """The simulation plane, for a vHub that runs amid tests: it sets how threads and garbage are dealt with."""
    switch_s, thresholds = sys.getswitchinterval(), gc.get_threshold()
    with Session.router("tcp/127.0.0.1:0") as session:
        yield session
    sys.setswitchinterval(switch_s)
    gc.set_threshold(*thresholds)
    gc.unfreeze()


def leave(folder: Path, run: HubRun, without: int = -1) -> Path:
    """Leave what a vHub that was killed does: a capture of some ticks, a journal of all, but perhaps one."""
    path = folder / "run.mcap"
    writer = Recorder(path, run.deployment, NAME, run.text, {"run": "run-1"})
    for closing in run.closings[:CAPTURED]:
        writer.keep(closing)
    writer.leave()
    with Journal(folder / "journals", "vhub") as journal:
        head = decode_any(HeadRecord, run.journal[0])
        journal.append(encode(msgspec.structs.replace(head, capture=str(path))))
        for raw in run.journal[1:]:
            record = decode_any(HubRecord, raw)
            if not isinstance(record, TickRecord) or record.tick != without:
                journal.append(raw)
    return path


def live(plane: Session, run: HubRun, folder: Path) -> str:
    """Be a vHub that is started again, and whose port is in use; return what it has lost."""

    def is_busy(deployment: Deployment) -> Session:
        raise Failed("its port is in use")

    process = Process("vhub")
    hub = HubShell(process, plane, is_busy, HubOptions(folder=folder))
    build = Build("vhub", hub.core.member.boot, "first", "run-1", NAME, run.text, "fast")
    hub.core.receive(channels.BUILD, "vhub", encode(build), time.monotonic_ns())
    process.inbox.wake()
    process.add(hub)
    code = process.run()
    assert code == FAILED and hub.core.lost
    return hub.core.lost


def test_a_vhub_that_cannot_listen_leaves_a_capture_that_the_next_one_goes_on_with(
    hub_run: HubRun, plane: Session, tmp_path: Path
) -> None:
    path = leave(tmp_path, hub_run)
    for _ in range(2):
        with pytest.raises(Failed, match="its port is in use"):
            live(plane, hub_run, tmp_path)
        assert end_of(path) is None
    found = recover_capture(path, tmp_path / "journals")
    assert found is not None and (found.tick, found.problem) == (LAST, "")
    assert has_end(found.path) and capture_info(found.path).end["reason"] == UNCLEAN


def test_a_vhub_whose_journal_contradicts_itself_leaves_its_capture_as_it_was(
    hub_run: HubRun, plane: Session, tmp_path: Path
) -> None:
    path = leave(tmp_path, hub_run, without=40)
    size = path.stat().st_size
    assert "it cannot continue: " in (told := live(plane, hub_run, tmp_path)) and "does not follow on tick" in told
    assert path.stat().st_size == size
    found = recover_capture(path, tmp_path / "journals")
    assert found is not None and "does not follow on tick" in found.problem
    assert found.tick == 39, "what is before the gap is used"


def test_a_vhub_whose_journal_is_damaged_goes_on_over_nothing(hub_run: HubRun, plane: Session, tmp_path: Path) -> None:
    """The run ends, with the place; the capture has what the journal tells up to there, and says so."""
    path = leave(tmp_path, hub_run)
    before = path.read_bytes()
    (journal,) = journal_files(tmp_path / "journals", "vhub")
    content = bytearray(journal.read_bytes())
    content[len(content) // 2] ^= 1
    journal.write_bytes(content)
    text = live(plane, hub_run, tmp_path)
    told = re.fullmatch(
        r"lost vhub: it cannot continue: .*vhub-000001\.journal: byte \d+: record \d+ is damaged, \d+ whole .* "
        rf"after it; tick (\d+) is the last before it\. A new run begins with the .*up table\.yaml --from {path}@last",
        text,
    )
    assert told is not None, text
    assert path.read_bytes() == before
    found = recover_capture(path, tmp_path / "journals")
    assert found is not None and "its journal cannot be used to its end: " in found.problem
    assert CAPTURED < found.tick == int(told[1]) < LAST


def test_a_vhub_that_closes_its_capture_says_meanwhile_how_far_it_is(
    hub_run: HubRun, plane: Session, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its disk takes the end of the capture only when it has said so three times."""
    process, gate, write, told = Process("vhub"), Event(), capture_contents.write_all, list[str]()
    monkeypatch.setattr(limits, "DOWNLINK_KEPT_NS", 0)

    def slow(file: int, content: bytes) -> None:
        gate.wait(60)
        write(file, content)

    def put(channel: Channel, name: str, payload: bytes) -> None:
        if channel is channels.HEARTBEAT:
            beat = decode(Heartbeat, payload)
            if beat.waiting_for == CAPTURE:
                told.append(decode_json(beat.report)["recording"]["state"])
            if len(told) == 3:
                gate.set()

    def listen(deployment: Deployment) -> Session:
        monkeypatch.setattr(capture_file, "write_all", slow)
        process.inbox.offer((channels.END.key, "supervisor", encode(End(0, "enough", False))))
        return radio

    with Session.router("tcp/127.0.0.1:0") as radio:
        hub = HubShell(process, plane, listen, HubOptions(tmp_path / "run.mcap", folder=tmp_path))
        monkeypatch.setattr(hub._wire, "put", put)
        build = Build("vhub", hub.core.member.boot, "first", "run-1", NAME, hub_run.text, "fast")
        process.inbox.offer((channels.BUILD.key, "vhub", encode(build)))
        process.add(hub)
        assert process.run() == DONE
    assert told[:3] == 3 * ["closing"] and open_capture(tmp_path / "run.mcap").about.end["reason"] == "enough"
