"""The console beside a real run: what a browser sees and does, through the loss of the supervisor, and its own."""

from __future__ import annotations

import asyncio
import json
import os
import signal
import stat
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from websockets.asyncio.client import connect

from tests.console.memory import Browser
from tests.wire.conftest import in_process
from tests.wire.test_run import last_json

if TYPE_CHECKING:
    from tests.wire.conftest import House


PORTER = (
    "--set", "robots.porter={model: holonomic, at: {x: 3 m}, actuators: {drive: {kind: go_to}}, "
    "sensors: {jobs: {kind: job, actuator: drive, rate: 5 Hz}}}",
    "--set", "nodes.blue.robots=[rest]", "--set", "clients={desk: {console: true}}",
)  # fmt: skip
"""A robot beside the table that the console can send."""
DEAF = "--set", "network.links=[{id: all, from: '*', to: '*', loss: 100 %}]"
"""Links over which nothing comes, but to and from the console."""


async def answered(browser: Browser, number: int, verb: str, **arguments: Any) -> dict[str, Any]:
    await browser.say(type="ask", id=number, verb=verb, arguments=arguments)
    return await browser.hear("answer")


async def status_with(browser: Browser, is_so: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
    """The first status of which something is so."""
    while True:
        status: dict[str, Any] = (await browser.hear("status"))["status"]
        if is_so(status):
            return status


async def moment_of(browser: Browser, source: int) -> tuple[tuple[int, ...], np.ndarray[Any, Any]]:
    """Head and poses of the next moment of a source."""
    while True:
        head, poses, _ = await browser.moment()
        if head[1] == source:
            return head, poses


async def add_the_spare(browser: Browser, scene: dict[str, Any], poses: np.ndarray[Any, Any]) -> None:
    """A ball that is absent in a moment is added; a place that it cannot have is refused."""
    (spare,) = [body for body in scene["bodies"] if body["removable"] and not body["robot"]]
    assert spare["name"] == "ball-2" and np.isnan(poses[spare["links"]]).all()
    outside = await answered(browser, 1, "add", name="ball-2", at={"x": "9 m"})
    assert not outside["accepted"] and "outside of the table" in outside["text"]
    added = await answered(browser, 2, "add", name="ball", at={"x": "0.15 m"})
    assert added["accepted"], added
    while not np.isfinite((await moment_of(browser, 0))[1]).all():
        pass


async def job_in(browser: Browser, state: str) -> dict[str, Any]:
    """The job that is told of when it is in a state."""
    while True:
        jobs: list[dict[str, Any]] = (await browser.hear("jobs"))["jobs"]
        for job in jobs:
            if job["state"] == state:
                return job


async def send(browser: Browser, number: int, x: float) -> dict[str, Any]:
    return await answered(browser, number, "send", robot="porter", actuator="drive", numbers={"x": x, "y": 0.0})


async def send_the_porter(browser: Browser, scene: dict[str, Any]) -> None:
    """A robot goes where it is sent, over links that others would get nothing over; one that is absent does not."""
    (porter,) = [body for body in scene["bodies"] if body["jobs"]]
    assert (porter["name"], porter["jobs"]) == ("porter", [{"actuator": "drive", "numbers": ["x", "y"]}])
    assert (await send(browser, 6, 3.2))["text"] == "porter/drive: x 3.2 m, y 0 m"
    assert (await job_in(browser, "done"))["ended"]
    assert (await answered(browser, 8, "remove", name="porter"))["accepted"]
    while np.isfinite((await moment_of(browser, 0))[1]).all():
        pass
    assert (await send(browser, 9, 3.0))["text"] == "an absent robot does no jobs: add it first, 'porter'"
    assert (await answered(browser, 10, "add", name="porter"))["accepted"]


async def look(addresses: dict[str, str], kill: Callable[[str], None]) -> None:
    """What a page does while the run goes on."""
    page, _, token = addresses["operate"].partition("#operate=")
    async with connect(f"{page.replace('http', 'ws')}ws", origin=page.rstrip("/"), max_size=None) as connection:  # type: ignore[arg-type]
        browser = Browser(connection)
        await browser.say(type="hello", token=token)
        welcome = await browser.hear("welcome")
        assert (welcome["role"], [source["kind"] for source in welcome["sources"]]) == ("operator", ["live", "poses"])
        scenes: dict[int, dict[str, Any]] = {}
        while len(scenes) < 2:
            scene = await browser.hear("scene")
            scenes[scene["source"]] = scene
        scene = scenes[0]
        head, poses = await moment_of(browser, 0)
        assert len(poses) == len(scene["links"])
        while (await moment_of(browser, 0))[0][5] == head[5]:
            pass
        followed, _ = await moment_of(browser, 1)
        assert followed[5] >= head[5], "what was recorded follows the run"
        compared = await browser.hear("compared")
        assert [entity["name"] for entity in compared["entities"]] == ["ball"]
        assert compared["covers"] == [-1000, 999_000]
        await browser.say(type="plot", series=[{"id": "x", "reading": ["camera", "ball"], "index": 0}])
        assert (await browser.hear("plotted"))["series"][0]["id"] == "x"
        await browser.say(type="watch", link=["camera", "red.goal"])
        assert (await browser.hear("watched"))["drops"] == []
        await add_the_spare(browser, scene, poses)
        await send_the_porter(browser, scene)
        assert (await answered(browser, 3, "step", count=0))["accepted"] is False
        paused = await answered(browser, 4, "pause")
        status = await status_with(browser, lambda status: bool(status["state"] == "paused"))
        asked = {entry["verb"]: entry["who"] for entry in status["requests"]}
        assert asked["add"] == asked["pause"] == "browser 1"
        kill("supervisor")
        status = await status_with(browser, lambda status: bool(status["recoveries"]) and status["state"] == "paused")
        assert (await answered(browser, 5, "resume"))["tick"] == paused["tick"]
        while (await moment_of(browser, 0))[0][5] <= paused["tick"] + 1:
            pass
        links = await browser.hear("links")
        assert links["at"] >= paused["tick"]
        assert (await send(browser, 7, 99.0))["accepted"]
        await job_in(browser, "running")
    await look_later(page, token, paused["tick"])


async def look_later(page: str, token: str, tick: int) -> None:
    """What a page that is opened later plots: also what was before a tick at which it was not there."""
    async with connect(f"{page.replace('http', 'ws')}ws", max_size=None) as connection:
        later = Browser(connection)
        await later.say(type="hello", token=token)
        await later.hear("scene")
        assert [job["state"] for job in (await later.hear("jobs"))["jobs"]] == ["running"]
        curves: dict[str, dict[str, Any]] = {"t": {"status": "ticks"}, "n": {"field": 0}}
        curves["x"] = {"reading": ["camera", "ball"]}
        await later.say(type="plot", series=[{"id": name, **curve} for name, curve in curves.items()])
        while len(told := {one["id"]: one["points"] for one in (await later.hear("plotted"))["series"]}) < len(curves):
            pass
        assert [name for name, points in told.items() if points[0][0] > tick] == []


def addresses_of(house: House) -> dict[str, str]:
    """The addresses of the live run's page, once its console serves it."""
    path = house.live().path / "console.json"

    def told() -> dict[str, str] | None:
        return json.loads(path.read_text()) if path.exists() else None

    return house.wait_for("the console's addresses", told)


def test_a_page_sees_and_moves_a_run_and_neither_end_harms_the_other(house: House) -> None:
    table = house.folder / "walk.csv"
    rows = [f"{at},ball,0.1,0,0" for at in range(2001)]
    table.write_text("\n".join(["time,entity,x,y,z", *rows]))
    beside = ("--second", "walk.csv", "--offset", "2 s")
    alone = *in_process("null", "supervisor"), *in_process("main", "nodes.red", "nodes.blue")
    spare = "--set", "table.spare_balls=1"
    up = house.up(
        "--console",
        *beside,
        *spare,
        *PORTER,
        *DEAF,
        "--json",
        "--engine",
        "pure",
        "--no-capture",
        "--pace",
        "0.5x",
        *alone,
    )
    house.ticking()
    path = house.live().path / "console.json"
    addresses = addresses_of(house)
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert house.read_until(up.stderr, "console: ").strip() == addresses["text"]
    assert addresses["operate"] not in (house.live().logs / "console.log").read_text()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("foosim.cli.view.serve_sources", lambda make, options: None)
        code, out, err = house.ask("foosim", "view", "--second", "walk.csv")
    assert (code, out, err) == (0, "", "second: walk.csv, compared by ball\n"), "the first line is the address"
    asyncio.run(look(addresses, house.kill))
    ((console, _),) = house.processes_with(f"--announce {path}").items()
    os.kill(console, signal.SIGKILL)
    assert f"foosim view {house.live().name}" in house.read_until(up.stderr, "console was killed by SIGKILL")
    tick = house.ticking()["ticks"]
    house.ticking(tick + 20)
    house.ask("foosim", "down")
    code, out, err = house.end(up)
    assert code == 0, err
    assert [entry["what"] for entry in last_json(out)["recoveries"]] == ["supervisor"]
    assert not Path(path).exists()
