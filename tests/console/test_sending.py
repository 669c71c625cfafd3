"""The console's connection as a client: who can have none is told why, and may try again."""

from __future__ import annotations

import asyncio

import pytest

from foosim.client.client import Client
from foosim.client.errors import ConnectionRefused
from foosim.common.errors import BadValue, Failed
from foosim.console.live.sending import VERBS, Sending
from foosim.console.shown.drawing import Drawing
from foosim.deployment.loader import load_deployment
from tests.console.memory import Heard
from tests.console.test_desk import ROBOTS, TEXT
from tests.kinematic_yard import yard_text

GO = {"robot": "scout", "actuator": "drive", "numbers": {"x": 1.0, "y": 0.0}}
WHY = "this console cannot send robots, its client is not connected: a client desk is already here"


async def refused(sending: Sending) -> None:
    """Have a request refused for what it has, in the thread that connects: what was to be done before is done."""
    await asyncio.sleep(0)
    with pytest.raises(BadValue, match="cancel takes robot, actuator, a mapping of 3"):
        await sending.request("cancel", GO)


def test_a_second_console_says_why_it_can_send_nobody_and_tries_again_when_it_is_asked() -> None:
    tried: list[str] = []

    def join(endpoint: str) -> Client:
        tried.append(endpoint)
        raise ConnectionRefused("a client desk is already here")

    async def scene() -> None:
        sending, heard = Sending(join), Heard()
        running = asyncio.create_task(sending.run(heard))
        assert sending.turn_to(Drawing(load_deployment(TEXT, "yard.yaml"))) == VERBS
        await refused(sending)
        assert tried == [], "nobody looks"
        sending.want(2)
        while not heard.published:
            await asyncio.sleep(0)
        assert [*heard.published] == [{"type": "jobs", "problem": WHY, "jobs": []}]
        with pytest.raises(Failed, match=WHY):
            await sending.request("send", GO)
        assert tried == ["desk"] * 2
        sending.want(1)
        while len(tried) < 3:
            await asyncio.sleep(0)
        await refused(sending)
        assert len(heard.published) == 1, "it is said once"
        running.cancel()
        await asyncio.wait((running,))

    asyncio.run(scene())


def test_without_an_endpoint_of_the_console_nothing_connects() -> None:
    def join(endpoint: str) -> Client:
        raise AssertionError(f"connects as {endpoint!r}")

    async def scene() -> None:
        sending, heard = Sending(join), Heard()
        running = asyncio.create_task(sending.run(heard))
        assert sending.turn_to(Drawing(load_deployment(yard_text(ROBOTS, clients={"desk": {}}), "yard.yaml"))) == ()
        sending.want(1)
        await refused(sending)
        await asyncio.sleep(0)
        assert heard.published == [] and not running.done()
        running.cancel()
        await asyncio.wait((running,))

    asyncio.run(scene())
