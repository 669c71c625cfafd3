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

from websockets.asyncio.client import connect

from tests.console.memory import Browser
from tests.wire.test_run import last_json

if TYPE_CHECKING:
    from tests.wire.conftest import House


async def answered(browser: Browser, number: int, verb: str, **arguments: Any) -> dict[str, Any]:
    await browser.say(type="ask", id=number, verb=verb, arguments=arguments)
    return await browser.hear("answer")


async def status_with(browser: Browser, is_so: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
    """The first status of which something is so."""
    while True:
        status: dict[str, Any] = (await browser.hear("status"))["status"]
        if is_so(status):
            return status


async def look(addresses: dict[str, str], kill: Callable[[str], None]) -> None:
    """What a page does while the run goes on."""
    page, _, token = addresses["operate"].partition("#operate=")
    async with connect(f"{page.replace('http', 'ws')}ws", origin=page.rstrip("/"), max_size=None) as connection:  # type: ignore[arg-type]
        browser = Browser(connection)
        await browser.say(type="hello", token=token)
        assert (await browser.hear("welcome"))["role"] == "operator"
        scene = await browser.hear("scene")
        head, poses, _ = await browser.moment()
        assert len(poses) == len(scene["links"])
        while (await browser.moment())[0][5] == head[5]:
            pass
        await browser.say(type="plot", series=[{"id": "x", "reading": ["camera", "ball"], "index": 0}])
        await browser.say(type="watch", link=["camera", "red.goal"])
        assert (await browser.hear("plotted"))["series"][0]["id"] == "x"
        assert (await browser.hear("watched"))["drops"] == []
        added = await answered(browser, 1, "add", position=[0.1, 0.0, 0.05])
        assert added["accepted"], added
        scene = await browser.hear("scene")
        assert [body["name"] for body in scene["bodies"] if body["removable"]] == ["ball2"]
        assert (await answered(browser, 2, "step", count=0))["accepted"] is False
        paused = await answered(browser, 3, "pause")
        status = await status_with(browser, lambda status: bool(status["state"] == "paused"))
        asked = {entry["verb"]: entry["who"] for entry in status["requests"]}
        assert asked["add"] == asked["pause"] == "browser 1"
        kill("supervisor")
        status = await status_with(browser, lambda status: bool(status["recoveries"]) and status["state"] == "paused")
        assert (await answered(browser, 4, "resume"))["tick"] == paused["tick"]
        while (await browser.moment())[0][5] <= paused["tick"] + 1:
            pass
        links = await browser.hear("links")
        assert links["at"] >= paused["tick"]


def addresses_of(house: House) -> dict[str, str]:
    """The addresses of the live run's page, once its console serves it."""
    path = house.live().path / "console.json"

    def told() -> dict[str, str] | None:
        return json.loads(path.read_text()) if path.exists() else None

    return house.wait_for("the console's addresses", told)


def test_a_page_sees_and_moves_a_run_and_neither_end_harms_the_other(house: House) -> None:
    up = house.up("--console", "--json", "--engine", "pure", "--no-capture", "--pace", "0.5x")
    house.ticking()
    path = house.live().path / "console.json"
    addresses = addresses_of(house)
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert house.read_until(up.stderr, "console: ").strip() == addresses["text"]
    assert addresses["operate"] not in (house.live().logs / "console.log").read_text()
    asyncio.run(look(addresses, house.kill))
    ((console, _),) = house.processes_with(f"--announce {path}").items()
    os.kill(console, signal.SIGKILL)
    assert f"foosim-console {house.live().name}" in house.read_until(up.stderr, "console was killed by SIGKILL")
    tick = house.ticking()["ticks"]
    house.ticking(tick + 20)
    house.ask("foosim-supervisor", "down")
    code, out, err = house.end(up)
    assert code == 0, err
    assert [entry["what"] for entry in last_json(out)["recoveries"]] == ["supervisor"]
    assert not Path(path).exists()
