"""The proxy itself: each thing that it does to a connection, as plain sockets see it."""

from __future__ import annotations

import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from tests.wire.proxy import Proxy, Weather

LIMIT_S = 900.0


@contextmanager
def connected(
    seed: int = 1, up: Weather | None = None, down: Weather | None = None
) -> Iterator[tuple[Proxy, socket.socket, socket.socket, socket.socket]]:
    """A proxy, and both ends of a connection through it (who dialled, who was dialled), and who listens."""
    with socket.create_server(("127.0.0.1", 0)) as server, Proxy(server.getsockname()[1], seed, up, down) as proxy:
        host, port = proxy.address.removeprefix("tcp/").split(":")
        near = socket.create_connection((host, int(port)))
        server.settimeout(LIMIT_S)
        far, _ = server.accept()
        for end in (near, far):
            end.settimeout(LIMIT_S)
        with near, far:
            near.sendall(b"!")
            assert read(far, 1) == b"!", "the proxy has dialled"
            yield proxy, near, far, server


def read(end: socket.socket, count: int) -> bytes:
    """So many bytes, or what comes before the end."""
    found = b""
    while len(found) < count and (chunk := end.recv(count - len(found))):
        found += chunk
    return found


def assert_reset(host: str, port: int) -> None:
    """Who dials here is reset: at once, or when it reads."""
    with pytest.raises(ConnectionResetError), socket.create_connection((host, port), timeout=LIMIT_S) as end:
        end.recv(1)


def test_bytes_pass_in_order_and_not_before_they_are_due() -> None:
    sent = bytes(range(256)) * 2000
    with connected(up=Weather(0.05, 0.02, 4e6, 0.2, 0.02)) as (_, near, far, _):
        begun_s = time.monotonic()
        threading.Thread(target=near.sendall, args=(sent,)).start()
        assert read(far, len(sent)) == sent
        assert time.monotonic() - begun_s >= 0.05 + len(sent) / 4e6 - 0.001
        far.sendall(b"back")
        assert read(near, 4) == b"back"


def test_silence_holds_back_and_healing_lets_all_of_it_come() -> None:
    with connected() as (proxy, near, far, _):
        proxy.silence(["up"])
        near.sendall(b"held")
        far.sendall(b"down")
        assert read(near, 4) == b"down", "the other way is open"
        far.setblocking(False)
        with pytest.raises(BlockingIOError):
            far.recv(1)
        far.settimeout(LIMIT_S)
        near.shutdown(socket.SHUT_WR)
        proxy.heal()
        assert read(far, 5) == b"held", "and then the end"


def test_half_closed_is_an_end_in_one_direction() -> None:
    with connected() as (proxy, near, far, _):
        proxy.half_close("down")
        assert read(near, 1) == b""
        near.sendall(b"on")
        assert read(far, 2) == b"on"


def test_a_cut_resets_both_sides_and_lasts_when_it_is_to() -> None:
    with connected() as (proxy, near, far, server):
        proxy.cut(lasting=True)
        for end in (near, far):
            with pytest.raises(ConnectionResetError):
                end.recv(1)
        host, port = proxy.address.removeprefix("tcp/").split(":")
        assert_reset(host, int(port))
        proxy.heal()
        with socket.create_connection((host, int(port)), timeout=LIMIT_S) as again:
            again.sendall(b"x")
            reached, _ = server.accept()
            with reached:
                assert read(reached, 1) == b"x"
        assert proxy.accepted == 2


def test_who_cannot_be_dialled_resets_the_connection() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    with Proxy(port) as proxy:
        host, own = proxy.address.removeprefix("tcp/").split(":")
        assert_reset(host, int(own))
