"""A recording that follows a source with a clock of its own: a live run or a replay that somebody plays."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from foosim.capture.mcap.checks import CaptureError
from foosim.cli.view import app
from foosim.common.errors import BadValue, Refused
from foosim.console.clock.leading import HeardClock, Leader
from foosim.console.recorded.capture_source import FileSource
from foosim.console.recorded.poses_csv import BadPoses
from foosim.console.recorded.poses_source import PosesSource
from foosim.console.recorded.recording import Recording
from foosim.console.recorded.second import open_follower
from foosim.console.shown.source import Moment, Wanted
from tests.console.memory import MemorySource, running, table, table_with_spares
from tests.simulation.conftest import TICKS, replay

LOOKED_AT = Wanted(1, 50.0)


def led() -> tuple[MemorySource, Leader]:
    """A live world in memory, and what leads with it."""
    live = MemorySource(table_with_spares())
    return live, Leader(live, live.about.tick_ns, time.monotonic_ns)


def distances(compared: Mapping[str, Any]) -> dict[str, float]:
    """How far apart the entities are, by name (m)."""
    return {entity["name"]: entity["distance_m"] for entity in compared["entities"]}


def test_recordings_follow_a_live_run_and_the_distance_is_told_as_it_goes(run: Path, tmp_path: Path) -> None:
    csv = tmp_path / "poses.csv"
    assert replay("export", run, "--what", "poses", "-o", csv).code == 0
    recording = Recording(run)

    def poses(tick: int) -> np.ndarray[tuple[int, int], np.dtype[np.float32]]:
        look = recording.look(tick)
        assert look is not None and look.tick == tick
        return look.poses

    async def look() -> None:
        live, leader = led()
        capture, both = open_follower(run, leader, live.deployment, 20_000_000)
        real, names = open_follower(csv, leader, live.deployment)
        assert isinstance(capture, FileSource) and isinstance(real, PosesSource)
        assert "ball" in both and "world" not in both and "red.goal/slide" in names
        assert (capture.about.verbs, real.about.verbs, real.covers()) == (("branch",), (), (0, TICKS))
        async with running(leader) as ours, running(capture) as theirs, running(real) as walked:
            for source in (leader, capture, real):
                source.want(LOOKED_AT)
            await live.begun.wait()

            def show(tick: int, of: int, jump: bool = False, paused: bool = False) -> None:
                assert live.feed is not None
                live.feed.show(Moment(tick, poses(of), np.zeros(live.layout.size), jump, paused))

            show(40, of=50)
            await theirs.until(lambda: theirs.tick == 50 and not theirs.moments[-1].paused)
            await walked.until(lambda: walked.tick == 40 and bool(walked.of("compared")))
            await theirs.until(lambda: bool(theirs.of("compared")))
            near, far = theirs.of("compared")[-1], walked.of("compared")[-1]
            assert distances(near) == dict.fromkeys({*both} - {"ball-2"}, 0.0), "the spare ball is not there yet"
            assert (near["at"], near["covers"], near["series"]) == (40, (-10, TICKS - 10), [[40, 0.0]])
            moved = poses(50)[0, :3] - poses(40)[0, :3]
            assert distances(far)["ball"] == pytest.approx(np.linalg.norm(moved), abs=1e-5)

            leader.want(Wanted())
            show(60, of=50)
            await walked.until(lambda: walked.of("compared")[-1]["at"] == 60)
            assert [at for at, metres in walked.of("compared")[-1]["series"] if metres is None] == [41]

            show(10, of=20, jump=True, paused=True)
            await theirs.until(lambda: theirs.tick == 20 and theirs.moments[-1].paused)
            await walked.until(lambda: walked.tick == walked.of("compared")[-1]["at"] == 10)
            assert walked.moments[-1].jump and walked.moments[-1].paused and any(one.jump for one in theirs.moments[1:])
            await theirs.until(lambda: theirs.of("status")[-1]["status"]["state"] == "paused")
            assert [tick for tick, _ in walked.of("compared")[-1]["series"]] == [10], "what was later is forgotten"

            show(TICKS + 40, of=50, jump=True)
            await theirs.until(lambda: theirs.tick == TICKS and theirs.of("compared")[-1]["at"] == TICKS + 40)
            await walked.until(lambda: walked.tick == walked.of("compared")[-1]["at"] == TICKS + 40)
            assert (theirs.of("compared")[-1]["entities"], theirs.of("compared")[-1]["series"][-1][1]) == ([], None)
            assert np.isnan(walked.moments[-1].poses).all() and ours.tick == TICKS + 40
            assert [at for at, _ in walked.of("compared")[-1]["series"]] == [10, 11, TICKS + 40], "a jump leaves a hole"

    asyncio.run(look())


def test_what_nobody_looked_at_is_a_gap_and_a_request_goes_to_the_one_who_leads() -> None:
    async def look() -> None:
        live, leader = led()
        leader.want(LOOKED_AT)
        leader.want(Wanted(2, 50.0))
        assert live.wanted == [LOOKED_AT, Wanted(2, 50.0)] and leader.gaps == 1
        leader.want(Wanted())
        assert leader.gaps == 2
        assert (await leader.request("pause", {}, "me")).text == "pause done"

    asyncio.run(look())


def test_a_change_of_the_clock_before_anybody_waits_is_not_missed() -> None:
    async def look() -> None:
        clock = HeardClock(2_000_000, time.monotonic_ns)
        seen = clock.changes
        clock.heard(Moment(7, np.empty((0, 7), np.float32), np.empty(0), jump=True, paused=True))
        async with asyncio.timeout(10):
            await clock.wait(None, seen)
        assert (clock.time_ns(), clock.jumps, clock.paused, clock.wall_ns(1)) == (14_000_000, 1, True, None)

    asyncio.run(look())


def test_what_has_nothing_of_the_run_is_refused_with_the_names_of_both(tmp_path: Path, bad_files: list[Path]) -> None:
    _, leader = led()
    csv = tmp_path / "poses.csv"
    for text, said in (
        (
            "time,entity,x,y\n0,tiger,1,2\n0,cow,1,2\n",
            r"nothing that the table has, ball, .* and \d+ more; it has cow, tiger",
        ),
        ("time,entity,x\n0,ball,1\n", "poses.csv:1: no column for y"),
    ):
        csv.write_text(text)
        with pytest.raises((BadValue, BadPoses), match=said):
            open_follower(csv, leader, table())
    csv.write_text("time,entity,x,y\n0,tiger,1,2\n0,ball,1,2\n0,ball-2,1,2\n")
    assert open_follower(csv, leader, table())[1] == ["ball", "ball-2"]
    assert open_follower(csv, leader, table_with_spares())[1] == ["ball", "ball-2"]
    for path in bad_files[:1]:
        with pytest.raises(CaptureError, match="absent: cannot be read"):
            open_follower(path, leader, table())


def test_an_offset_is_one_of_a_second_recording(capsys: pytest.CaptureFixture[str]) -> None:
    for arguments, said in (
        (["--offset", "1s"], "--offset needs --second"),
        (["--offset", "soon", "--second", "x.csv"], "--offset: "),
    ):
        with pytest.raises(Refused, match=said):
            app(arguments, standalone_mode=False)
