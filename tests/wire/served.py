"""Sources served to browsers from this process, as `foosim view` serves them."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future
from contextlib import contextmanager
from threading import Thread

from foosim.console.server.server import ConsoleServer, Tokens
from foosim.console.shown.source import Source

TOKENS = Tokens("look", "touch")


@contextmanager
def served(make: Callable[[], Sequence[Source]]) -> Iterator[str]:
    """Serve sources in a thread of their own; the block gets the address for who operates them."""
    told: Future[tuple[int, Callable[[], None]]] = Future()

    async def serve() -> None:
        server = ConsoleServer(make(), TOKENS, "1")
        loop, ended = asyncio.get_running_loop(), asyncio.Event()
        async with server.listening("127.0.0.1", 0) as port:
            running = asyncio.create_task(server.run_sources())

            def end() -> None:
                loop.call_soon_threadsafe(ended.set)

            told.set_result((port, end))
            await ended.wait()
            running.cancel()
            await asyncio.wait((running,))

    def run() -> None:
        try:
            asyncio.run(serve())
        except BaseException as error:  # told to whoever waits for the address
            if told.done():
                raise
            told.set_exception(error)

    thread = Thread(target=run)
    thread.start()
    port, end = told.result()
    try:
        yield f"http://127.0.0.1:{port}/#operate={TOKENS.operate}"
    finally:
        end()
        thread.join()
