"""Runs of processes that end uncleanly, and runs whose disks get full: captures are valid, nothing is lost silently."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest

from foosim.capture.info import capture_info
from foosim.capture.parts import files_from
from foosim.capture.reader import open_capture
from foosim.runtime import disk
from foosim.simulation.run import rehearse
from foosim.simulation.verify import verify_capture
from foosim.vhub.recording.recovery import UNCLEAN
from tests.wire.conftest import ONE, House
from tests.wire.test_run import last_json


def test_the_next_start_completes_the_capture_of_a_run_that_was_killed_whole(house: House) -> None:
    slow = "network.links.everything.delay=20 ms"  # a picture every 10 ms: some are on their way
    split = ("--set", "capture.split_time=40 ms", "--set", slow)
    up = house.up("--pace", "fast", "--engine", "pure", "--capture", "run.mcap", *split, *ONE, players=True)
    run = house.info()
    house.ticking(100)
    up.kill()
    house.end(up)
    house.wait_for("an end of all of them", lambda: not house.processes_with(run.run))
    path = house.folder / "run.mcap"
    had = open_capture(path)
    assert not had.finished

    (house.folder / "elsewhere").mkdir()
    again = house.up("--for", "2 ms", "--no-capture", "--engine", "pure", *ONE)
    code, out, err = house.end(again)
    assert code == 0, err
    (line,) = [line for line in out.splitlines() if "recovered" in line]
    made = house.folder / "run.recovered.mcap"
    assert line.startswith(f"run {run.run}: capture {path} of an unclean end is recovered to {made}: ")
    journals = house.folder / "state" / "foosim" / "runs" / run.run / "journals"
    assert not list(journals.glob("vhub-*")), "they are done with"

    assert not open_capture(path).finished and len(files_from(path)) >= 3, "it stays as it is"
    capture = open_capture(made)
    last = int(capture.ticks[-1])
    assert capture.finished and capture.about.end["reason"] == UNCLEAN and "problem" not in capture.about.end
    assert capture.ticks.tolist() == list(range(last + 1)) and last >= int(had.ticks[-1])
    same = rehearse(house.table.read_text(), "table.yaml", last, None, ["engine=pure", slow])
    assert capture_info(made).chain == same.json["digest"]["chain"]
    assert verify_capture(made).equal and files_from(made) == [made]
    packets = capture.packets
    fates = {fate: int((packets.fate == fate).sum()) for fate in ("delivered", "dropped", "in_flight")}
    assert sum(fates.values()) == len(packets) and fates["in_flight"] > 0
    assert len({*zip(packets.source, packets.sequence, packets.destination, strict=True)}) == len(packets)


def test_a_run_whose_capture_gets_full_ends_with_all_of_it_captured(
    house: House, small_disk: Callable[[int], Path]
) -> None:
    path = small_disk(400) / "run.mcap"
    arguments = ("--engine", "pure", "--pace", "fast", "--for", "60s", "--json", "--capture", path)
    code, out, err = house.end(house.up(*arguments, "--set", "capture.reserve=256 KiB", *ONE, players=True))
    content = last_json(out)
    assert code == 1 and content["failed"], err
    assert content["reason"].startswith(f"lost the capture: {path}: ") and "KiB left on its disk" in content["reason"]
    recording = content["recording"]
    assert recording["state"] == "full" and recording["refused"] == 0
    assert recording["offered"] == recording["written"] > 0
    info = capture_info(path)
    assert info.finished and info.ticks == content["ticks"] > 0
    assert info.chain == content["digest"]["chain"] and info.packets["offered"] == content["packets"]["offered"]
    assert f"capture full: {path}: " in err


@pytest.mark.parametrize("fault", ["reserve", "refused"])
def test_a_run_whose_journals_have_no_room_ends_with_all_that_is_committed_captured(
    house: House, small_disk: Callable[[int], Path], monkeypatch: pytest.MonkeyPatch, fault: str
) -> None:
    state = small_disk(64 * 1024)
    monkeypatch.setenv("XDG_STATE_HOME", str(state))
    reserve = "32 MiB" if fault == "reserve" else "64 KiB"
    up = house.up(
        *("--engine", "pure", "--pace", "fast", "--for", "600s", "--json", "--capture", "run.mcap"),
        *("--set", f"capture.reserve={reserve}", *ONE),
        players=True,
    )
    house.ticking(50)
    keep = 16 * 1024 * 1024 if fault == "reserve" else 0
    with suppress(OSError), (state / "others").open("wb") as others:
        for _ in range((disk.free_bytes(state) - keep) // 4096 + 1):
            others.write(bytes(4096))
            others.flush()
    code, out, err = house.end(up)
    content = last_json(out)
    assert code == 1 and content["failed"], err
    assert content["reason"].startswith("lost room for the journal: " if fault == "reserve" else "lost "), content
    info = capture_info(house.folder / "run.mcap")
    assert info.finished and info.ticks == content["ticks"] >= 50
    assert info.chain == content["digest"]["chain"]
    assert verify_capture(house.folder / "run.mcap").equal
