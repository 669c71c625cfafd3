"""A capture as the page sees it: what its source tells, and what it does when it is asked."""

from __future__ import annotations

import asyncio
import shlex
from pathlib import Path

import numpy as np
import pytest

from foosim.capture.start_frame import read_branch
from foosim.common.errors import BadValue, Refused
from foosim.console.recorded.capture_source import FileSource
from foosim.console.recorded.poses_source import PosesSource
from foosim.console.recorded.recording import Recording
from foosim.console.shown.source import Curve, Wanted
from foosim.deployment.loader import apply_sets
from foosim.simulation.verify import Between
from tests.console.memory import running
from tests.simulation.conftest import SETS, TABLE, TICK_NS, TICKS, added_tick, damaged, replay


def test_a_capture_tells_its_scene_marks_links_and_status_and_is_sought_and_stepped(run: Path) -> None:
    async def look() -> None:
        about = Recording(run).about
        between = Between(about)
        source = FileSource(run, recompute=between)
        source.want(Wanted(1, 50.0, frozenset({"contacts"}), (("camera", "player-red"),), (("camera", "ball"),)))
        async with running(source) as heard:
            await heard.until(lambda: bool(heard.moments and heard.of("marks") and heard.of("links")))
            assert source.about.span == (0, TICKS) and heard.abouts[0].kind == "capture"
            assert heard.moments[0].tick == 0 and heard.moments[0].paused
            kinds = {mark["kind"] for message in heard.of("marks") for mark in message["marks"]}
            assert {"push", "add", "kickoff"} <= kinds

            answer = await source.request("seek", {"tick": 237}, "me")
            assert (answer.tick, answer.accepted) == (237, True)
            await heard.until(lambda: heard.tick == 237)
            seen = [(moment.tick, moment.jump) for moment in heard.moments[-2:]]
            assert seen == [(230, True), (237, False)], "first what was captured, then the tick itself"
            exact = Recording(run).look(240)
            assert exact is not None and len(heard.scenes) == 1, "also with a ball that was added meanwhile"
            await heard.until(lambda: heard.of("status")[-1]["status"]["shown"] == {"kind": "computed", "tick": 237})
            status = heard.of("status")[-1]["status"]
            assert status["ticks"] == 237 and status["score"] == {"red": 0, "blue": 0} and status["state"] == "paused"
            assert status["nodes"].keys() == {"n1", "n2"} and status["packets"]["offered"] > 100

            await source.request("step", {"count": 3}, "me")
            await heard.until(lambda: heard.tick == 240)
            assert np.array_equal(heard.moments[-1].poses, exact.poses)
            assert (await source.request("step", {"count": -1, "unit": "frames"}, "me")).tick == 230
            await heard.until(lambda: heard.tick == 230 and heard.of("links")[-1]["at"] == 230)
            links = {(link["from"], link["to"]): link for link in heard.of("links")[-1]["links"]}
            assert links["camera", "player-red"]["offered"] > 10 and not links["camera", "player-red"]["radio"]
            assert heard.of("overlay")[-1]["tick"] == 230
            assert heard.of("watched")[-1]["link"] == ["camera", "player-red"]
            assert heard.of("readings")[-1]["points"]
            assert heard.of("links")[-1]["drops"], "it was sought: those of the window"
            told = len(heard.of("links"))
            source.want(Wanted(1, 50.0, frozenset(), (("camera", "player-blue"),), ()))
            await heard.until(lambda: len(heard.of("links")) > told)
            assert heard.of("links")[-1]["drops"] == [], "told already"
            name, unit, points = await source.history(Curve("a", status="score.red"))
            assert name == "score.red" and unit == "" and len(points) > 100
        between.close()

    asyncio.run(look())


def test_it_plays_round_and_refuses_what_it_cannot_do(run: Path) -> None:
    async def play() -> None:
        source = FileSource(run)
        source.want(Wanted(1, 200.0))
        async with running(source) as heard:
            await source.request("loop", {"on": True}, "me")
            await source.request("rate", {"pace": "8x"}, "me")
            assert (await source.request("play", {}, "me")).text == "plays at tick 0, 0 s"
            await heard.until(lambda: sum(moment.jump for moment in heard.moments) > 1)
            ticks = [moment.tick for moment in heard.moments]
            assert source.clock.jumps > 1
            assert all(tick % 10 == 0 or tick == added_tick(run) for tick in ticks)
            await source.request("pause", {}, "me")
            with pytest.raises(Refused, match=r"a recording has no request 'pase': .* nearest is pause"):
                await source.request("pase", {}, "me")
            for verb, arguments, said in (
                ("seek", {}, "seek needs tick"),
                ("seek", {"tick": 1.5}, "seek: tick is not a whole number"),
                ("step", {"count": True}, "step: count is not a whole number"),
                ("step", {"unit": "hours"}, "a unit is ticks or frames"),
                ("loop", {"on": 1}, "loop: on is not true or false"),
                ("pause", {"now": 1}, "pause has no argument, not"),
                ("branch", {"tick": "1"}, "branch: tick is not a whole number"),
            ):
                with pytest.raises(BadValue, match=said):
                    await source.request(verb, arguments, "me")

    asyncio.run(play())


def test_without_a_machine_that_computes_the_last_capture_holds(run: Path) -> None:
    async def look() -> None:
        source = FileSource(run, recompute=lambda frame, inputs: None)
        async with running(source) as heard:
            await source.request("seek", {"tick": 237}, "me")
            await heard.until(lambda: bool(heard.of("note")))
            assert "results differ from the capture" in heard.of("note")[0]["text"]
            assert heard.moments[-1].tick == 230
            await heard.until(lambda: heard.of("status")[-1]["status"]["shown"] == {"kind": "held", "tick": 230})

    asyncio.run(look())


def test_what_a_branch_says_is_what_up_takes(run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async def ask(tick: int) -> tuple[str, int]:
        answer = await FileSource(run).request("branch", {"tick": tick}, "me")
        return answer.text, answer.tick

    monkeypatch.chdir(run.parent)
    text, tick = asyncio.run(ask(237))
    assert tick == 230 and text.endswith("  # table.yaml is not here: name the file that the run was started with")
    words = shlex.split(text, comments=True)
    assert words == ["foosim", "up", "table.yaml", "--from", "run.mcap@460ms"]
    branch = read_branch(words[-1], Recording(run).deployment)
    assert branch.start.origin.tick == 230
    monkeypatch.chdir(tmp_path)
    (tmp_path / "table.yaml").write_text(TABLE.read_text())
    text, _ = asyncio.run(ask(0))
    assert str(run) in text and "is not what the run had" in text, f"it had {SETS}"
    (tmp_path / "table.yaml").write_text(Recording(run).about.deployment_text)
    text, _ = asyncio.run(ask(0))
    assert "#" not in text
    for one in ("robots.camera.sensors.ball.modifiers=[]", "robots.red.goal.actuators={loop: {kind: rod_position}}"):
        (tmp_path / "table.yaml").write_text(apply_sets(Recording(run).about.deployment_text, "table.yaml", [one]))
        text, _ = asyncio.run(ask(0))
        assert "is not what the run had" in text, one


def test_a_damaged_file_is_told_and_the_rest_is_shown(run: Path, tmp_path: Path) -> None:
    async def look() -> None:
        source = FileSource(damaged(run, tmp_path / "damaged.mcap"))
        async with running(source) as heard:
            await heard.until(lambda: bool(heard.of("note") and heard.of("marks")))
            assert "damaged.mcap: byte" in heard.of("note")[0]["text"] and heard.of("note")[0]["level"] == "error"
            await source.request("seek", {"tick": TICKS}, "me")
            await heard.until(lambda: heard.tick == TICKS)

    asyncio.run(look())


def test_a_capture_that_grows_moves_the_end_of_the_slider(
    run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def look() -> None:
        whole = run.read_bytes()
        path = tmp_path / "growing.mcap"
        path.write_bytes(whole[: len(whole) // 2])
        source = FileSource(path)
        first = source.about.span
        async with running(source) as heard:
            await heard.until(lambda: bool(heard.of("marks")))
            path.write_bytes(whole)
            await heard.until(lambda: source.about.span == (0, TICKS))
            assert heard.abouts[-1].span == (0, TICKS) != first
            await source.request("seek", {"tick": TICKS}, "me")
            await heard.until(lambda: heard.tick == TICKS)

    monkeypatch.setattr("foosim.console.recorded.capture_source.REFRESH_S", 0.01)
    asyncio.run(look())


def test_two_sources_have_one_clock_and_a_distance(run: Path, tmp_path: Path) -> None:
    table = tmp_path / "poses.csv"
    assert replay("export", run, "--what", "poses", "-o", table).code == 0
    lines = table.read_text().splitlines()
    some = [line for line in lines[1:] if line.split(",")[1] in ("ball", "red.goal/slide")]
    table.write_text("\n".join([lines[0], *some, "0,stranger,1,1,1,0,0,0,1"]) + "\n")

    async def look() -> None:
        one = FileSource(run)
        other = FileSource(run, one.clock, 40_000_000, compare=one.opened())
        csv = PosesSource(table, one.clock, deployment=one.recording.deployment, compare=one.opened(links=True))
        assert csv.about.kind == "poses" and csv.about.verbs == () and other.about.verbs == ("branch",)
        async with running(one) as ours, running(other) as theirs, running(csv) as real:
            await one.request("seek", {"tick": 100}, "me")
            await theirs.until(lambda: theirs.tick == 120)
            await ours.until(lambda: ours.tick == 100)
            await real.until(lambda: real.tick == 100)
            names = [link["name"] for link in real.scenes[0]["links"]]
            assert names == ["ball", "red.goal/slide", "stranger"]
            ball = [link["name"] for link in ours.scenes[-1]["links"]].index("ball")
            assert np.allclose(real.moments[-1].poses[0], ours.moments[-1].poses[ball], atol=1e-6)
            assert np.isnan(real.moments[-1].poses[2]).all(), "it is not known at this time"
            await real.until(lambda: bool(real.of("compared")) and real.of("compared")[-1]["complete"])
            await theirs.until(lambda: bool(theirs.of("compared")) and theirs.of("compared")[-1]["complete"])
            near, far = real.of("compared")[-1], theirs.of("compared")[-1]
            assert {entity["name"] for entity in near["entities"]} == {"ball", "red.goal/slide"}
            assert max(metres for _, metres in near["series"] if metres is not None) < 1e-5
            assert far["series"][100][1] > 1e-3 and [tick for tick, _ in far["series"]] == [*range(TICKS + 1)]
            with pytest.raises(Refused, match="send the request to that one"):
                await csv.request("play", {}, "me")
            with pytest.raises(Refused, match="valid are branch"):
                await other.request("play", {}, "me")
            assert one.clock.time_ns() == 100 * TICK_NS

    asyncio.run(look())


def test_a_table_alone_is_played_as_well(tmp_path: Path) -> None:
    table = tmp_path / "walk.csv"
    table.write_text("time,entity,x,y,yaw\n1,rover1,0,0,0\n1.5,rover1,0.5,0,0\n2,rover1,1,0,1\n")

    async def look() -> None:
        source = PosesSource(table)
        assert source.about.span == (1000, 2000) and "play" in source.about.verbs
        async with running(source) as heard:
            await source.request("seek", {"tick": 1250}, "me")
            await heard.until(lambda: heard.tick == 1250)
            assert heard.moments[-1].poses[0].tolist() == [0.25, 0, 0, 0, 0, 0, 1]
            assert heard.scenes[0]["links"][0]["shapes"][0]["kind"] == "sphere"

    asyncio.run(look())
