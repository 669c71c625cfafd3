"""Serves sources until a signal ends the process; the shell of `foosim view`.

By default only this machine reaches the page. Another address needs a certificate, which browsers have to trust:
without encryption each host on the way reads the token.
"""

from __future__ import annotations

import asyncio
import os
import ssl
import webbrowser
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

from foosim.common.addresses import LOOPBACK, Address, Insecure, parse_address
from foosim.common.errors import BadValue, Failed
from foosim.common.json_text import encode_json
from foosim.console.server.server import ConsoleServer, Tokens, new_tokens
from foosim.console.shown.source import Source
from foosim.runtime.process import Stop


@dataclass(frozen=True, slots=True)
class ServeOptions:
    """Address and access of the page."""

    listen: str = LOOPBACK
    certificate: Path | None = None
    key: Path | None = None
    view_only: bool = False
    open: bool = False
    """Have the browser of this machine show it."""
    announce: Path | None = None
    """A file for the addresses, readable by its owner only: the operator's address permits requests."""


def serve_sources(sources: Sequence[Source], options: ServeOptions) -> None:
    """Serve until a signal ends it; the first line on standard output is the address.

    Raises BadValue, Insecure, and Failed if the address cannot be used.
    """
    address, tls = listening_at(options)
    asyncio.run(_serve(sources, options, address, tls))


def listening_at(options: ServeOptions) -> tuple[Address, ssl.SSLContext | None]:
    """Return where to listen, and the certificate where there is one. Raises BadValue, and Insecure without one."""
    address = parse_address(options.listen)
    if (options.certificate is None) != (options.key is None):
        raise BadValue("--certificate and --key belong together")
    if options.certificate is None:
        if not address.is_loopback:
            raise Insecure(
                f"{address.host} is reached by other machines; give --certificate and --key, or leave --listen out and "
                "reach the page by ssh -L PORT:127.0.0.1:PORT"
            )
        return address, None
    context = ssl.create_default_context(ssl.Purpose.CLIENT_AUTH)
    try:
        context.load_cert_chain(options.certificate, options.key)
    except (OSError, ssl.SSLError) as error:
        raise BadValue(f"--certificate: cannot be used, {error}", str(options.certificate)) from None
    return address, context


async def _serve(
    sources: Sequence[Source],
    options: ServeOptions,
    address: Address,
    tls: ssl.SSLContext | None,
) -> None:
    loop, ended = asyncio.get_running_loop(), asyncio.Event()

    def end() -> None:
        loop.call_soon_threadsafe(ended.set)

    Stop().then(end)
    tokens = new_tokens()
    server = ConsoleServer(sources, tokens, version("foosim"))
    try:
        async with server.listening(address.host.strip("[]"), address.port, tls) as port:
            stem = f"{'http' if tls is None else 'https'}://{address.host}:{port}/"
            _announce(options, stem, tokens)
            running = asyncio.create_task(server.run_sources())
            waiting = asyncio.create_task(ended.wait())
            await asyncio.wait((running, waiting), return_when=asyncio.FIRST_COMPLETED)
            if not ended.is_set():
                running.result()  # raises what ended it
                await waiting
            running.cancel()
            await asyncio.wait((running,))
            waiting.cancel()
    except OSError as error:
        raise Failed(f"{address}: cannot be listened on, {error.strerror}") from None


def _announce(options: ServeOptions, stem: str, tokens: Tokens) -> None:
    """Report the addresses of the page."""
    view = f"{stem}#view={tokens.view}"
    operate = "" if options.view_only else f"{stem}#operate={tokens.operate}"
    text = f"console: {operate} (to look only: {view} )" if operate else f"console: {view}"
    if options.announce is not None:
        write_private(options.announce, encode_json({"view": view, "operate": operate, "text": text}))
        text = f"console: {stem}"  # others may read the log
    print(text, flush=True)
    if options.open:
        webbrowser.open(operate or view)


def write_private(path: Path, content: bytes) -> None:
    """Write a file that only its owner can read, at once."""
    fresh = path.with_name(path.name + ".new")
    fresh.unlink(missing_ok=True)
    with os.fdopen(os.open(fresh, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as file:
        file.write(content)
    fresh.replace(path)
