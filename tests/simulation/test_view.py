"""The command `view`: which sources it opens, what it refuses; and a replay on its plane as a source of the page."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from foosim.cli.view import open_sources
from foosim.client.replay_listener import Replay, hear_replay
from foosim.common.errors import BadValue, Refused
from foosim.console.recorded.capture_source import FileSource
from foosim.console.recorded.poses_source import PosesSource
from foosim.console.recorded.replay_source import PlayedSource
from foosim.console.shown.source import Wanted
from tests.console.memory import Heard, running
from tests.simulation.conftest import TICKS, foosim, replay
from tests.simulation.test_play import playing


def test_the_command_opens_captures_and_tables_and_the_second_follows_the_first(run: Path, tmp_path: Path) -> None:
    table = tmp_path / "poses.csv"
    table.write_text("time,entity,x,y\n0,ball,0,0\n")
    one, other = open_sources(run, run, -5_000_000)
    assert isinstance(one, FileSource) and isinstance(other, FileSource)
    assert "seek" in one.about.verbs and "seek" not in other.about.verbs, "the first leads"
    assert other.clock is one.clock and other.offset_ns == -5_000_000
    _, real = open_sources(run, table)
    assert isinstance(real, PosesSource) and real.about.world == "table"
    (alone,) = open_sources(table)
    assert isinstance(alone, PosesSource) and "seek" in alone.about.verbs
    with pytest.raises(BadValue, match="give the capture first"):
        open_sources(table, run)


def test_what_cannot_be_shown_ends_the_command_as_bad_input(run: Path, tmp_path: Path, bad_files: list[Path]) -> None:
    table = tmp_path / "poses.csv"
    table.write_text("time,entity,x\n0,ball,0\n")
    for arguments, said in (
        ((bad_files[0],), "absent: cannot be read"),
        ((bad_files[2],), "text: no MCAP file"),
        ((run, "--second", bad_files[0]), "absent: cannot be read"),
        ((run, "--second", table), "poses.csv:1: no column for y (y, y_m, y_cm, y_mm) among time, entity, x"),
        ((run, "--offset", "1s"), "--offset needs --second"),
        ((run, "--second", run, "--offset", "soon"), "--offset: "),
    ):
        done = foosim("view", *arguments)
        assert done.code == 2 and said in done.err, done
    done = foosim("view", run, "--listen", "0.0.0.0")
    assert done.code == 3 and "--certificate" in done.err


def test_a_replay_on_its_plane_is_seen_and_controlled(run: Path) -> None:
    async def look(address: str) -> None:
        source = PlayedSource(lambda streams: hear_replay(address, streams))
        assert source.about.kind == "replay" and source.about.span == (0, TICKS)
        source.want(Wanted(1, 50.0))
        async with running(source) as heard:
            answer = await source.request("seek", {"tick": 50}, "me")
            assert answer.tick == 50 and answer.text == "paused at tick 50, realtime"
            await source.request("step", {"count": 10}, "me")
            await heard.until(lambda: heard.tick == 60)
            spare = [link["name"] for link in heard.scenes[0]["links"]].index("ball-2")
            assert np.isnan(heard.moments[-1].poses[spare]).all()
            await source.request("seek", {"tick": 200}, "me")
            await source.request("step", {"count": 10}, "me")
            await heard.until(lambda: heard.tick == 210)
            assert len(heard.scenes) == 1 and np.isfinite(heard.moments[-1].poses).all(), "the ball was added"
            assert any(moment.jump for moment in heard.moments) and heard.moments[-1].paused
            assert (heard.moments[-1].poses[:, :3] != 0).any()
            await heard.until(lambda: heard.of("status")[-1]["status"]["ticks"] == 210)
            assert heard.of("status")[-1]["status"]["state"] == "paused"
            with pytest.raises(Refused, match="not a time that is played, 0 s to 600 ms"):
                await source.request("seek", {"tick": TICKS + 1}, "me")
            with pytest.raises(Refused, match="a recording has no request"):
                await source.request("loop", {"on": True}, "me")

    with playing(run, paused=True) as played:
        asyncio.run(look(played.address))


def test_a_recording_follows_a_replay_on_its_plane(
    run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    csv = tmp_path / "poses.csv"
    assert replay("export", run, "--what", "poses", "-o", csv).code == 0

    async def look(address: str) -> None:
        one, other = open_sources(Path(address), csv, 40_000_000)
        assert capsys.readouterr().out == "", "the first line is the address of the page"
        for source in (one, other):
            source.want(Wanted(1, 50.0))
        async with running(one) as played, running(other) as real:
            await one.request("seek", {"tick": 40}, "me")
            await one.request("step", {"count": 10}, "me")
            await played.until(lambda: played.tick == 50)
            await real.until(lambda: real.tick == 50 and real.moments[-1].paused)
            await real.until(lambda: bool(real.of("compared")) and real.of("compared")[-1]["at"] == 50)
            told = real.of("compared")[-1]
            assert told["covers"] == (-20, TICKS - 20) and told["entities"][0]["distance_m"] > 1e-4
            names = [link["name"] for link in real.scenes[0]["links"]]
            assert {entity["name"] for entity in told["entities"]} <= {*names}
            with pytest.raises(Refused, match="send the request to that one"):
                await other.request("play", {}, "me")

    with playing(run, paused=True) as play:
        strangers = tmp_path / "strangers.csv"
        strangers.write_text("time,entity,x,y\n0,tiger,0,0\n")
        with pytest.raises(BadValue, match="nothing that the table has"):
            open_sources(Path(play.address), strangers)
        asyncio.run(look(play.address))


def test_a_replay_that_ends_is_told(run: Path) -> None:
    def connect_to(address: str, streams: Sequence[str]) -> Replay:
        """Connect so that everything up to the end is heard while `resume` is asked."""
        connection = hear_replay(address, streams)

        def ask(verb: str, **arguments: Any) -> dict[str, Any]:
            status = Replay.request(connection, verb, **arguments)
            while verb == "resume" and not connection.ended:
                connection._read(None)
            return status

        connection.request = ask  # type: ignore[method-assign, assignment]
        return connection

    async def look(address: str) -> Heard:
        source = PlayedSource(lambda streams: connect_to(address, streams))
        async with running(source) as heard:
            await source.request("rate", {"pace": "fast"}, "me")
            await source.request("play", {}, "me")
            await heard.until(lambda: bool(heard.of("note")))
            with pytest.raises(Refused, match="has ended"):
                await source.request("pause", {}, "me")
            return heard

    with playing(run, paused=True) as played:
        heard = asyncio.run(look(played.address))
    assert heard.of("note")[0]["text"] == "the replay has ended"
    kinds = {mark["kind"] for message in heard.of("marks") for mark in message["marks"]}
    assert "epoch" in kinds and heard.moments[-1].tick == TICKS
