"""The live source without a run: what it says of one that is not there, and what it lets nobody ask."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest

from foosim.client.control import Control
from foosim.common.errors import BadValue
from foosim.console.live import live_source
from foosim.console.live.live_source import LiveSource, how_ended
from foosim.console.shown.source import Curve, Wanted
from foosim.launcher.outcome import result_without_supervisor
from foosim.launcher.run_options import RunOptions, launch_of
from foosim.protocol.messages import Answer
from foosim.runtime.run_folder import NoRun, create_run
from foosim.runtime.transport.inbox import Inbox
from tests.console.memory import Heard
from tests.console.test_following import described, frame_of, status
from tests.simulation.conftest import TABLE


def presences(heard: Heard) -> list[tuple[str, str]]:
    return [(message["state"], message["text"]) for message in heard.of("presence")]


def test_a_run_that_is_not_there_is_looked_for_and_said_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(live_source, "AGAIN_S", 0.0)
    heard, tried = Heard(), [0]

    def connect(give_up: Callable[[], bool]) -> Control:
        tried[0] += 1
        raise NoRun("run mine is starting" if tried[0] < 3 else "run mine is over")

    async def scene() -> None:
        running = asyncio.create_task(LiveSource("mine", connect, None).run(heard))
        while tried[0] < 6:
            await asyncio.sleep(0)
        running.cancel()
        await asyncio.wait((running,))

    asyncio.run(scene())
    notes = [note["text"] for note in heard.of("note")]
    assert notes == [
        "mine is not reached: run mine is starting; reconnecting",
        "mine is not reached: run mine is over; reconnecting",
    ]
    assert presences(heard) == [("away", note) for note in notes], "it may be started again"


@pytest.mark.parametrize("first", ["the run", "the console"])
def test_how_a_run_has_ended_is_said_once_also_as_the_last_thing_that_a_console_says(
    monkeypatch: pytest.MonkeyPatch, first: str
) -> None:
    monkeypatch.setattr(live_source, "AGAIN_S", 0.0)
    monkeypatch.setattr(live_source, "ENDED_S", 0.0)
    heard, tried = Heard(), [0]

    def connect(give_up: Callable[[], bool]) -> Control:
        tried[0] += 1
        raise NoRun("run mine is over")

    def how_ended(stopped_by: str) -> Mapping[str, Any] | None:
        has_ended = tried[0] > 2 if first == "the run" else source._closing.is_set()
        return {"type": "presence", "state": "ended", "text": "done"} if has_ended else None

    source = LiveSource("mine", connect, None, how_ended)

    async def scene() -> None:
        running = asyncio.create_task(source.run(heard))
        while tried[0] < 6:
            await asyncio.sleep(0)
        running.cancel()
        await asyncio.wait((running,))

    asyncio.run(scene())
    assert presences(heard) == [("away", "mine is not reached: run mine is over; reconnecting"), ("ended", "done")]


@pytest.mark.parametrize("ends", ["done", "stopped", "lost vhub: it was killed"])
def test_the_end_of_a_run_names_who_stopped_it_and_what_shows_its_capture(
    ends: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, run: Path
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    folder = create_run("table", "mine")
    assert how_ended(folder, "browser 3") is None, "it may be resumed"
    folder.write_launch(launch_of(RunOptions(TABLE), run if ends != "done" else None))
    failed = ends.startswith("lost")
    folder.write_result({**result_without_supervisor({"ticks": 70}, ends), "failed": failed})
    told = how_ended(folder, "browser 3")
    assert told is not None and told["state"] == "ended"
    assert (
        told["text"]
        == {
            "done": "The run has ended at tick 70: done. It has no capture.",
            "stopped": f"The run has ended at tick 70: stopped by browser 3. Its capture is {run}; "
            f"this shows it: foosim view {run}",
            "lost vhub: it was killed": f"The run has failed at tick 70: lost vhub: it was killed."
            f" Its capture is {run}; this shows it: foosim view {run}",
        }[ends]
    )


class ResumeState(Control):
    """An idle run, without a wire: it keeps its requests."""

    def __init__(self) -> None:
        self.requested: list[str] = []

    def describe(self, timeout_s: float = 0.0, give_up: Callable[[], bool] = bool) -> dict[str, Any]:
        return described(frame_of(5))

    def status(self, timeout_s: float = 0.0, give_up: Callable[[], bool] = bool) -> dict[str, Any]:
        self.requested.append("status")
        return status("running") | {"ticks": 100 * self.requested.count("status")}

    def request(self, verb: str, timeout_s: float = 0, give_up: Callable[[], bool] = bool, **arguments: Any) -> Answer:
        self.requested.append(verb)
        return Answer("operator", "1", True, 5, "", b"")

    def view(self, inbox: Inbox) -> None:
        """No frame comes."""

    def close(self) -> None:
        """There is nothing to close."""


def test_while_nobody_looks_statuses_alone_are_asked_for_and_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(live_source, "UNSEEN_S", 0.0)
    control = ResumeState()

    async def scene() -> None:
        source = LiveSource("mine", lambda give_up: control, None)
        running = asyncio.create_task(source.run(Heard()))
        async with asyncio.timeout(30):
            while control.requested.count("status") < 4:
                await asyncio.sleep(0)
            assert {*control.requested} == {"status"}, "no frames"
            name, _, points = await source.history(Curve("t", status="ticks"))
            assert name == "ticks" and points[:3] == [(100.0, 100.0), (200.0, 200.0), (300.0, 300.0)]
            source.want(Wanted(1, 50.0))
            while "watch" not in control.requested:
                await asyncio.sleep(0)
        running.cancel()
        await asyncio.wait((running,))

    asyncio.run(scene())


@pytest.mark.parametrize("name", ["self", "timeout_s", "a b", ""])
def test_an_argument_that_is_none_of_a_request_is_refused(name: str) -> None:
    def connect(give_up: Callable[[], bool]) -> Control:
        raise AssertionError("nobody is asked")

    async def scene() -> None:
        with pytest.raises(BadValue, match="a request has no such argument"):
            await LiveSource("mine", connect, connect).request("add", {name: 1}, "browser 1")

    asyncio.run(scene())
