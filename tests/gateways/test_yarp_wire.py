"""YARP's wire: against bytes that its own programs sent, as properties, and with garbage."""

import asyncio
import random
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from foosim.common.errors import Failed, Malformed
from foosim.common.limits import YARP_BEHIND_MESSAGES_MAX
from foosim.gateways.yarp import wire
from foosim.gateways.yarp.ports import CARRIERS, Link, NameClient, Port
from tests.gateways.yarp_peers import SESSIONS, Rig, plain, replay, run, until

SENT: list[list[Any]] = [
    [1, -2.5, "hello", "two words", [1, 2, 3], ["a", 1], [1.5, 2.5], [], b"\1\2\xff", wire.Vocab("set"),
     wire.Vocab("1"), wire.Vocab(""), None, 5_000_000_000, 'quo"te', [1, [2, [3, "x"]]]],
    [1, 2],
    [2.0, 3.0],
]  # fmt: skip
"""The bottles of the recorded sessions of data."""
HEARD = [[wire.Vocab("null") if item is None else item for item in bottle] for bottle in SENT]

ITEMS = st.recursive(
    st.one_of(
        st.integers(-(10**18) + 1, 10**18 - 1), st.floats(allow_nan=False), st.binary(max_size=9),
        st.text(st.characters(exclude_categories=["Cs"]), max_size=9).filter(lambda text: not text.endswith("\0")),
        st.sampled_from(["set", "1", "", "null", "mat"]).map(wire.Vocab),
    ),
    lambda items: st.lists(items, max_size=4),
    max_leaves=12,
)  # fmt: skip


@given(st.lists(ITEMS, max_size=5))
def test_a_bottle_is_read_as_it_was_written_in_bytes_and_in_text(values: list[Any]) -> None:
    for again in (wire.decode(wire.encode(values)), wire.from_text(wire.to_text(values))):
        assert again == values
        assert list(map(type, again)) == list(map(type, values))


@pytest.mark.parametrize("carrier", list(CARRIERS))
def test_a_port_hears_a_writer_of_yarp_and_answers_as_yarp_does(carrier: str) -> None:
    async def work(rig: Rig) -> None:
        heard: list[Any] = []
        port = await rig.port("/r", heard.append)
        got, recorded = await replay(f"data {carrier}", port.number)
        await until(lambda: len(heard) == len(HEARD))
        assert heard == HEARD
        assert plain(got) == plain(recorded)

    run(work)


@pytest.mark.parametrize("carrier", list(CARRIERS))
def test_a_port_writes_the_bytes_that_yarp_writes(carrier: str) -> None:
    session = SESSIONS[f"data {carrier}"]
    recorded = "".join(text for who, text in session if who == "c").encode("latin-1")

    async def work(rig: Rig) -> None:
        got = bytearray()

        async def reader(stream: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            got.extend(await stream.readexactly(len(session[0][1])))
            writer.write(session[1][1].encode("latin-1"))
            got.extend(await stream.read(-1))
            writer.close()

        port = await rig.port("/w")
        server = await asyncio.start_server(reader, "127.0.0.1", 0)
        async with server:
            number = server.sockets[0].getsockname()[1]
            await rig.names.request(f"register /r tcp 127.0.0.1 {number}")
            await port.connect(f"{carrier}://r")
            for bottle in SENT:
                port.write(bottle)
            assert port.disconnect("/r")
            await until(lambda: len(got) >= len(recorded))
        assert bytes(got) == recorded

    run(work)


def test_a_picture_is_an_image_of_yarp() -> None:
    theirs = SESSIONS["image"][2][1].encode("latin-1")[42:]  # after magic, sizes of three blocks, and command
    pixels = b"".join(bytes([x, y, x + y, 255]) for y in range(2) for x in range(4))
    assert wire.encode(wire.image(4, 2, pixels)) == theirs
    assert wire.decode(theirs) == ["mat", "rgba", [4, 32, 8, 4, 2], pixels]


@pytest.mark.parametrize("session", [name for name in SESSIONS if name.startswith("admin")])
def test_a_port_is_connected_and_disconnected_by_yarp_connect(session: str) -> None:
    async def work(rig: Rig) -> None:
        port = await rig.port("/w")
        reader = await rig.port("/r", lambda _: None)
        if session in ("admin list tcp 2", "admin del tcp"):
            await port.connect("tcp://r")
        got, recorded = await replay(session, port.number)
        assert plain(got) == plain(recorded)
        assert list(port.links) == (["/r"] if session.startswith("admin add") or session == "admin list tcp 2" else [])
        await until(lambda: list(reader.sources.values()) == ["/w"] * len(port.links))

    run(work)


def test_a_request_is_answered_on_its_connection() -> None:
    async def work(rig: Rig) -> None:
        port = await rig.port("/s", lambda values: ["ok", [1, 2], "fine"] if values == ["set", 1, 2.5] else [])
        got, recorded = await replay("rpc", port.number)
        assert plain(got) == plain(recorded)

    run(work)


def test_the_name_server_answers_as_yarpserver_does() -> None:
    async def work(rig: Rig) -> None:
        for session in ("names register", "names announce", "names query", "names unregister"):
            got, recorded = await replay(session, rig.names.number)
            assert plain(got) == plain(recorded)
        got, recorded = await replay("names list", rig.names.number)
        assert set(plain(got).split(b"\r\n")) == set(plain(recorded).split(b"\r\n")) - {
            b"registration name fallback ip port type mcast"
        }
        assert (await rig.names.request("query /r"))[:3] == ["registration", "name", "/r"]
        await rig.names.request("unregister /r")
        assert await rig.names.request("query /r") == []
        assert "register NAME" in " ".join(await rig.names.request("dance"))

    run(work)


@asynccontextmanager
async def hanging(rig: Rig, port: Port) -> AsyncIterator[list[Link]]:
    """Have two readers of a port that read nothing, by tcp, which acknowledges, and by fast_tcp."""
    hung: list[asyncio.StreamWriter] = []

    def hang(stream: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        writer.write(wire.magic(0))
        hung.append(writer)

    async with await asyncio.start_server(hang, "127.0.0.1", 0) as server:
        for carrier in ("tcp", "fast_tcp"):
            number = server.sockets[0].getsockname()[1]
            await rig.names.request(f"register /{carrier} tcp 127.0.0.1 {number}")
            await port.connect(f"{carrier}://{carrier}")
        links = [port.links["/tcp"], port.links["/fast_tcp"]]
        yield links
        for writer in (*hung, *(link.writer for link in links)):
            writer.transport.abort()


def test_a_reader_that_hangs_loses_messages_and_another_one_none() -> None:
    async def work(rig: Rig) -> None:
        port = await rig.port("/w")
        heard: list[Any] = []
        await rig.port("/good", heard.append)
        await port.connect("/good")
        async with hanging(rig, port) as links:
            for index in range(400):
                port.write([index, b"x" * 30_000])
                await until(lambda: len(heard) == index + 1)  # noqa: B023  # awaited here
            assert [bottle[0] for bottle in heard] == list(range(400))
            assert port.links["/good"].dropped == 0
            assert all(link.dropped > 0 for link in links)

    run(work)


def test_what_is_not_acknowledged_is_bounded() -> None:
    async def work(rig: Rig) -> None:
        port = await rig.port("/w")
        async with hanging(rig, port) as links:
            for _ in range(YARP_BEHIND_MESSAGES_MAX + 10):
                port.write([0.5])
            assert [link.dropped for link in links] == [10, 0]

    run(work)


def test_what_is_not_yarp_closes_its_connection_alone(caplog: pytest.LogCaptureFixture) -> None:
    good = wire.message("D", [1])
    greeting = CARRIERS["fast_tcp"] + b"\3\0\0\0/x\0"
    garbage = {
        b"GET / HTTP/1.1\r\n": "it starts with b'GET / HT'",
        CARRIERS["tcp"] + b"\xff\xff\xff\x7f": "a name of 2147483647 bytes",
        greeting + good[:10] + good[10:18] + b"\xff\xff\xff\x7f" * 3: "262144 in all are valid",
        greeting + b"YA\x0b\0\0\0RP" + good[8:]: "where a message starts with",
        greeting + good[:-4]: "ended within a message",
        greeting + wire.message("D", [1.0]).replace(b"\x0a\1\0\0", b"\7\0\0\0"): "no item of a bottle has the tag 7",
        b"CONNECT /x\r\nD\r\n(1 2\r\n": "'(' and without ')'",
        b"CONNECT /x\r\n" + b"x" * (1 << 20): "limit",
    }

    async def work(rig: Rig) -> None:
        heard: list[Any] = []
        port = await rig.port("/r", heard.append)
        writer = await rig.port("/w")
        await writer.connect("/r")
        for index, data in enumerate(garbage):
            stream, bad = await asyncio.open_connection("127.0.0.1", port.number)
            bad.write(data)
            bad.write_eof()
            with suppress(ConnectionError):  # it was closed before all of it was read
                await stream.read(-1)
            bad.close()
            writer.write([index])
            await until(lambda: len(heard) == index + 1)  # noqa: B023  # awaited here

    run(work)
    for expected in garbage.values():
        assert expected in caplog.text


def test_mutated_sessions_do_not_harm_a_port() -> None:
    chosen = random.Random(39)
    recorded = ["".join(text for who, text in log if who == "c").encode("latin-1") for log in SESSIONS.values()]

    async def work(rig: Rig) -> None:
        heard: list[Any] = []
        port = await rig.port("/r", heard.append)
        writer = await rig.port("/w")
        await writer.connect("/r")
        for index in range(300):
            data = bytearray(chosen.choice(recorded))
            for _ in range(chosen.randint(1, 6)):
                data[chosen.randrange(len(data))] = chosen.choice((0, 1, 255, 127, chosen.randrange(256)))
            for number in (port.number, rig.names.number):
                stream, bad = await asyncio.open_connection("127.0.0.1", number)
                bad.write(data[: chosen.randint(1, len(data))])
                bad.write_eof()
                with suppress(ConnectionError):
                    await stream.read(-1)
                bad.close()
            if port.sources:
                writer.links or await writer.connect("/r")  # a mutant may have disconnected it
            writer.write(["good", index])
            await until(lambda: ["good", index] in heard or not writer.links)  # noqa: B023  # awaited here

    run(work)


@given(st.binary(max_size=60))
def test_garbage_is_no_bottle_and_says_so(data: bytes) -> None:
    for garbage in (data, b"\0\1\0\0" + data):
        try:
            assert isinstance(wire.decode(garbage), list)
        except Malformed as bad:
            assert bad.what


@given(st.text('()[]{}"\\ ,1.-ex\n', max_size=30))
def test_a_line_of_garbage_is_a_bottle_or_says_so(line: str) -> None:
    try:
        assert isinstance(wire.from_text(line), list)
    except Malformed as bad:
        assert bad.what


def test_lists_in_lists_have_a_limit() -> None:
    with pytest.raises(Malformed):
        wire.from_text("(" * 5000)
    with pytest.raises(Malformed):
        wire.decode(b"\0\1\0\0\1\0\0\0" * 5000)


def test_without_a_name_server_a_port_says_so() -> None:
    async def work(rig: Rig) -> None:
        await rig.server.close()
        with pytest.raises(Failed, match=r"name server of YARP at 127\.0\.0\.1:\d+.*Connect call failed"):
            await rig.port("/x")

    run(work)
    assert NameClient("127.0.0.1", 1).number == 1
