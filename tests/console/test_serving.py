"""Where the page may be served: this machine alone, or by a certificate; and who can read the addresses."""

from __future__ import annotations

import asyncio
import json
import ssl
import stat
from pathlib import Path

import pytest
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosedError

from foosim.common.addresses import Insecure
from foosim.common.errors import BadValue
from foosim.console.server import server as server_module
from foosim.console.server.server import ConsoleServer, new_tokens
from foosim.console.server.serving import ServeOptions, _announce, listening_at, write_private
from foosim.launcher import pki as certificates
from tests.console.memory import TOKENS, Browser, MemorySource, table


@pytest.mark.parametrize("listen", ["0.0.0.0", "192.0.2.7:8080", "example.org"])
def test_an_address_that_others_reach_takes_a_certificate(listen: str) -> None:
    with pytest.raises(Insecure, match="give --certificate and --key"):
        listening_at(ServeOptions(listen))


def test_a_certificate_has_its_key_and_can_be_read(tmp_path: Path) -> None:
    with pytest.raises(BadValue, match="belong together"):
        listening_at(ServeOptions(certificate=tmp_path / "cert.pem"))
    with pytest.raises(BadValue, match="--certificate: cannot be used"):
        listening_at(ServeOptions(certificate=tmp_path / "cert.pem", key=tmp_path / "key.pem"))


def test_addresses_are_written_for_their_owner_alone(tmp_path: Path) -> None:
    path = tmp_path / "console.json"
    for content in (b"1", b"2"):
        write_private(path, content)
        assert path.read_bytes() == content
        assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("view_only", [True, False])
def test_the_line_that_is_printed_has_the_addresses(capsys: pytest.CaptureFixture[str], view_only: bool) -> None:
    _announce(ServeOptions(view_only=view_only), "http://127.0.0.1:1/", TOKENS)
    view, operate = (f"http://127.0.0.1:1/#{what}" for what in (f"view={TOKENS.view}", f"operate={TOKENS.operate}"))
    line = f"console: {view}" if view_only else f"console: {operate} (to look only: {view} )"
    assert capsys.readouterr().out == f"{line}\n"


def test_nobody_guesses_a_token_and_each_has_its_role() -> None:
    tokens = new_tokens()
    assert len({tokens.view, tokens.operate, new_tokens().view}) == 3
    assert len(tokens.view) == 24
    assert [tokens.role(token) for token in (tokens.view, tokens.operate, "", "é")] == [
        "viewer",
        "operator",
        None,
        None,
    ]


def test_a_page_over_https_is_reached_by_its_host_and_opens_from_its_own_origin_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "pki"
    certificates.init(folder)
    certificate, *_ = [path for path in certificates.issue(folder, ["vhub"], ["127.0.0.1"]) if path.suffix == ".pem"]
    key = next(path for path in folder.glob("vhub*") if "key" in path.name)
    _, context = listening_at(ServeOptions("0.0.0.0", certificate, key))
    trusting = ssl.create_default_context(cafile=folder / "ca.pem")

    async def talk() -> None:
        """Beside browsers, one begins a handshake and ends it not: the connection is closed after `HELLO_S`."""
        source = MemorySource(table())
        server = ConsoleServer([source], TOKENS, "1")
        async with asyncio.timeout(30), server.listening("127.0.0.1", 0, context) as port:
            running = asyncio.create_task(server.run_sources())
            await source.begun.wait()
            silent, writer = await asyncio.open_connection("127.0.0.1", port)
            for scheme, is_let_in in (("https", True), ("http", False)):
                origin = f"{scheme}://127.0.0.1:{port}"
                async with connect(f"wss://127.0.0.1:{port}/ws", ssl=trusting, origin=origin) as connection:  # type: ignore[arg-type]
                    hello = json.dumps({"type": "hello", "token": TOKENS.view})
                    if is_let_in:
                        await connection.send(hello)
                        assert (await Browser(connection).hear("welcome"))["role"] == "viewer"
                    else:
                        with pytest.raises(ConnectionClosedError) as ended:
                            await connection.send(hello)
                            await connection.recv()
                        assert ended.value.rcvd is not None and ended.value.rcvd.code == 4403
            assert await silent.read() == b""
            writer.close()
            running.cancel()

    monkeypatch.setattr(server_module, "HELLO_S", 2.0)
    asyncio.run(talk())
