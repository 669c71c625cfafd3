"""The console's server as raw WebSocket readers see it, over a source in memory."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable

import pytest
from websockets.exceptions import ConnectionClosed, ConnectionClosedError

from foosim.console.server import server
from foosim.console.server.server import CONNECTIONS_MAX
from tests.console.memory import Console, MemorySource, console, table, table_with_spares
from tests.deployed import deployed

Part = Callable[[Console], Awaitable[None]]


def play(part: Part) -> None:
    """Run a part against a console over the table."""

    async def scene() -> None:
        async with asyncio.timeout(60), console(MemorySource(table())) as stage:
            await part(stage)

    asyncio.run(scene())


def test_a_browser_gets_scene_and_moment_at_once_and_its_numbers_behind_the_poses() -> None:
    async def part(stage: Console) -> None:
        stage.source.show(5)
        async with stage.browser() as browser:
            welcome = await browser.hear("welcome")
            assert welcome["role"] == "operator"
            assert welcome["sources"][0]["verbs"] == ["pause", "push"]
            scene = await browser.hear("scene")
            assert len(scene["links"]) == 19
            assert scene["generation"] == 1
            head, poses, values = await browser.moment()
            assert head[0] == 1
            assert (head[4], head[5]) == (1, 5.0)
            assert len(poses) == 19
            assert len(values) == 0
            ball = next(run for run in scene["fields"] if run["entity"] == "ball" and run["field"] == "position")
            await browser.say(type="plot", series=[{"id": "z", "field": ball["index"] + 2}], generation=1)
            head, poses, values = await browser.moment()
            assert values.tolist() == [5.0 + ball["index"] + 2]
            stage.source.describe()
            stage.source.show(6, jump=True)
            head, poses, values = await browser.moment()
            assert (head[4], head[5], len(values)) == (1, 6.0, 1), "the same scene is said once"
            stage.source.turn_to(table_with_spares())
            stage.source.show(7, jump=True)
            scene = await browser.hear("scene")
            assert [body["name"] for body in scene["bodies"] if body["removable"]] == ["ball-2"]
            head, poses, values = await browser.moment()
            assert (head[4], len(poses), len(values)) == (2, 18, 0)

    play(part)


@pytest.mark.parametrize("has_ended", [True, False])
def test_a_console_that_ends_says_why_and_last_that_its_run_has_ended(has_ended: bool) -> None:
    async def scene() -> None:
        async with asyncio.timeout(60):
            async with console(MemorySource(table())) as stage:
                opened = stage.browser()
                browser = await opened.__aenter__()
                await browser.hear("scene")
                if has_ended:
                    text = "The run has ended: done. " + "x" * 200
                    stage.source.publish(type="presence", state="ended", text=text)
            if has_ended:
                assert (await browser.hear("presence"))["text"] == text
            with pytest.raises(ConnectionClosed) as closed:
                await browser.hear("nothing")
            rcvd = closed.value.rcvd
            assert rcvd is not None
            found = rcvd.code, rcvd.reason[:25]
            assert found == ((4410, "The run has ended: done. ") if has_ended else (1001, "the console was ended"))
            await opened.__aexit__(None, None, None)

    asyncio.run(scene())


def test_what_is_asked_is_answered_to_the_one_who_asked() -> None:
    async def part(stage: Console) -> None:
        async with stage.browser() as operator, stage.browser("look") as viewer:
            await operator.say(type="request", id=3, verb="pause", arguments={"deep": [1]})
            answer = await operator.hear("answer")
            assert answer == {
                "type": "answer", "id": 3, "accepted": True, "text": "pause done", "tick": 7, "verb": "pause",
                "who": "browser 1",
            }  # fmt: skip
            await operator.say(type="request", id=4, verb="push")
            assert (await operator.hear("answer"))["text"] == "ball cannot be pushed"
            await operator.say(type="request", id=5, verb="explode")
            assert "pause, push" in (await operator.hear("answer"))["text"]
            assert (await viewer.hear("welcome"))["sources"][0]["verbs"] == []
            await viewer.say(type="request", id=6, verb="pause")
            assert "only views" in (await viewer.hear("answer"))["text"]
            assert stage.source.asked == [("pause", {"deep": [1]}), ("push", {})]

    play(part)


def test_curves_of_status_links_and_readings_are_told_as_points() -> None:
    async def part(stage: Console) -> None:
        async with stage.browser() as browser:
            series = [
                {"id": "lag", "status": "lag_ms.p99"},
                {"id": "loss", "link": ["a", "b"], "figure": "loss"},
                {"id": "x", "reading": ["camera", "ball"], "index": 1},
                {"id": "known", "field": 3},
            ]
            await browser.say(type="plot", series=series)
            told = await browser.hear("plotted")
            assert told["series"] == [{"id": "known", "name": "the ball", "unit": "m", "points": [[1.0, 2.0]]}]
            stage.source.publish(type="status", status={"ticks": 9, "lag_ms": {"p99": 1.5}})
            assert (await browser.hear("plotted"))["series"][0]["points"] == [[9, 1.5]]
            row = {"from": "a", "to": "b", "offered": 4, "loss": 0.25}
            stage.source.publish(type="links", at=10, links=[row, {**row, "loss": None, "offered": 0}])
            assert (await browser.hear("plotted"))["series"][0]["points"] == [[10, 0.25]]
            stage.source.publish(type="readings", robot="camera", channel="ball", points=[[11, [0.5, 0.75]]])
            assert (await browser.hear("plotted"))["series"][0]["points"] == [[11, 0.75]]
            assert stage.source.wanted[-1].readings == (("camera", "ball"),)

    play(part)


def test_who_looks_at_what_is_told_to_the_source_until_nobody_does() -> None:
    async def part(stage: Console) -> None:
        async with stage.browser() as one:
            await one.hear("scene")
            async with stage.browser("look") as other:
                await other.say(type="show", overlays=["rays"], hz=10)
                await other.say(type="watch", link=["a", "b"])
                await one.say(type="show", hz=25)
                await until(lambda: stage.source.wanted[-1].hz == 25 and bool(stage.source.wanted[-1].links))
                assert stage.source.wanted[-1].overlays == {"rays"}
                stage.source.publish(type="watched", link=["a", "b"], drops=[])
                assert (await other.hear("watched"))["link"] == ["a", "b"]
                await one.say(type="watch", link=["a", "b"])  # who comes later gets what was told
                assert (await one.hear("watched"))["drops"] == []
                await one.say(type="watch", link=None)
            await until(lambda: stage.source.wanted[-1].links == ())
        await until(lambda: stage.source.wanted[-1].hz == 0.0)

    play(part)


async def until(is_so: Callable[[], bool]) -> None:
    """Let the loop run until something is so."""
    while not is_so():
        await asyncio.sleep(0)


@pytest.mark.parametrize(
    ("said", "code", "reason"),
    [
        ({"token": "guess"}, 4401, "no valid token"),
        ({"origin": "http://elsewhere.example"}, 4403, "another page"),
    ],
)
def test_who_may_not_look_is_told_why(said: dict[str, str], code: int, reason: str) -> None:
    async def part(stage: Console) -> None:
        with pytest.raises(ConnectionClosedError) as ended:
            async with stage.browser(**said) as browser:
                await browser.hear("welcome")
        assert ended.value.rcvd is not None
        assert ended.value.rcvd.code == code
        assert reason in ended.value.rcvd.reason

    play(part)


def test_a_right_token_that_comes_late_is_not_called_invalid(monkeypatch: pytest.MonkeyPatch) -> None:
    async def part(stage: Console) -> None:
        monkeypatch.setattr(server, "HELLO_S", 0.0)
        with pytest.raises(ConnectionClosedError) as ended:
            async with stage.browser() as browser:
                await browser.hear("welcome")
        assert ended.value.rcvd is not None
        assert (ended.value.rcvd.code, ended.value.rcvd.reason) == (server.NO_HELLO, "no token came within 0 s")

    play(part)


GARBAGE = [
    ('{"type": "hello", "token": "touch"}', "a second hello"),
    ("{", "not a message of a page"),
    ('{"type": "explode"}', "explode"),
    ('{"type": "request", "id": 1, "verb": "pause", "source": 3}', "no source 3"),
    ('{"type": "show", "hz": 1e9}', "hz"),
    ('{"type": "plot", "series": [{"id": "a", "field": 1000000}]}', "field 1000000"),
    ('{"type": "plot", "series": [{"id": "a", "field": 1, "status": "ticks"}]}', "exactly one"),
    ("[" * 5000, "not a message of a page"),
    (b"\0\1", "binary"),
]


@pytest.mark.parametrize(("said", "reason"), GARBAGE, ids=[str(place) for place in range(len(GARBAGE))])
def test_garbage_ends_one_connection_with_a_reason(said: str | bytes, reason: str) -> None:
    async def part(stage: Console) -> None:
        async with stage.browser() as other:
            with pytest.raises(ConnectionClosedError) as ended:
                async with stage.browser() as browser:
                    await browser.connection.send(said)
                    await browser.hear("answer")
            assert ended.value.rcvd is not None
            assert ended.value.rcvd.code == 1008
            assert reason in ended.value.rcvd.reason
            stage.source.show(1)
            assert (await other.moment())[0][5] == 1.0

    play(part)


def test_a_browser_that_never_reads_costs_bounded_memory_and_nobody_waits_for_it() -> None:
    async def part(stage: Console) -> None:
        async with stage.browser() as good, stage.browser() as stuck:
            await stuck.hear("scene")
            await good.hear("scene")
            stuck.connection.transport.pause_reading()
            board = stage.server.board
            for tick in range(1, 4001):
                board.readers["browser 1"].follows[0].next_s = 0.0
                last = stage.source.show(tick)
                stage.source.publish(type="status", status={"ticks": tick, "text": "x" * 2000})
                if tick % 20 == 0:
                    await asyncio.sleep(0)
            head = (await good.moment())[0]
            while head[5] < last.tick:
                head = (await good.moment())[0]
            waiting = board.readers["browser 2"]
            assert len(waiting._newest) <= 2
            for _ in range(1000):  # what nothing replaces: it is cut off
                stage.source.publish(type="note", level="info", text="x" * 20_000)
                await good.hear("note")
            assert "browser 2" not in board.readers
            assert "browser 1" in board.readers
            stuck.connection.transport.abort()

    play(part)


def test_a_thousand_connections_leave_the_others_alone() -> None:
    async def part(stage: Console) -> None:
        async with stage.browser() as good:
            await good.hear("scene")
            opened = []
            for _ in range(1000):
                opened.append(await asyncio.open_connection("127.0.0.1", stage.port))
                if len(opened) % 50 == 0:
                    stage.source.show(len(opened))
                    stage.server.board.readers["browser 1"].follows[0].next_s = 0.0
                    assert (await good.moment())[0][5] <= len(opened)
                    assert stage.server.connections <= CONNECTIONS_MAX + 50
            ended = 0
            for reader, _ in opened[300:310]:  # those that are too many are ended at once
                with pytest.raises((asyncio.IncompleteReadError, ConnectionResetError)):
                    await reader.readexactly(1)
                ended += 1
            assert ended == 10
            for _, writer in opened:
                writer.close()

    play(part)


async def get(stage: Console, path: str, *headers: str) -> tuple[str, str]:
    """Head and body of an HTTP answer."""
    reader, writer = await asyncio.open_connection("127.0.0.1", stage.port)
    writer.write("\r\n".join([f"GET {path} HTTP/1.1", *headers, "", ""]).encode())
    answer = (await reader.read()).decode()
    writer.close()
    head, _, body = answer.partition("\r\n\r\n")
    return head, body


def test_the_page_is_served_with_a_policy_and_nothing_else_is() -> None:
    async def part(stage: Console) -> None:
        local = f"Host: 127.0.0.1:{stage.port}"
        head, body = await get(stage, "/", local)
        assert head.startswith("HTTP/1.1 200 ")
        assert "Content-Security-Policy: default-src 'self';" in head
        assert body.startswith("<!doctype html>")
        for path in ("/../server.py", "/server.py", "/%2e%2e/server.py", "/etc/passwd"):
            assert (await get(stage, path, local))[0].startswith("HTTP/1.1 404 ")
        assert (await get(stage, "/", "Host: elsewhere.example"))[0].startswith("HTTP/1.1 421 ")
        for path in ("/", "/ws"):
            assert (await get(stage, path, local, local))[0].startswith("HTTP/1.1 400 "), "RFC 9112, 3.2"

    play(part)


def test_viewers_look_through_a_camera_and_a_wrong_one_is_refused() -> None:
    eye = "{kind: rgbd, rate: 50 Hz, at: {z: 1.2 m}, look_at: {entity: ball}, width: 32, height: 18}"

    async def scene() -> None:
        deployment = deployed(f"robots.camera.sensors.eye={eye}")
        async with asyncio.timeout(60), console(MemorySource(deployment)) as stage, stage.browser("look") as viewer:
            assert (await viewer.hear("scene"))["cameras"] == [
                {"robot": "camera", "channel": "eye", "pictures": ["image", "depth"]}
            ]
            pictures = []
            for number, kind in enumerate(("image", "depth", "segmentation")):
                wanted = {"robot": "camera", "channel": "eye", "kind": kind}
                await viewer.say(type="request", id=number, verb="look", arguments=wanted)
                answer = await viewer.hear("answer")
                pictures.append(answer.get("picture", answer["text"]))
            assert pictures[0] != pictures[1] and all(one.startswith("data:image/png;base64,") for one in pictures[:2])
            assert "has image() and depth() alone" in pictures[2]
            await viewer.say(
                type="request", id=9, verb="look", arguments={"robot": "camera", "channel": "ear", "kind": "image"}
            )
            assert "nearest is 'camera/eye'" in (await viewer.hear("answer"))["text"]

    asyncio.run(scene())
