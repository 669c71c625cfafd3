"""What people look at goes over the wire without anybody waiting for them."""

from __future__ import annotations

import select
import signal
import subprocess
import sys
from typing import Final

from foosim.protocol import channels
from foosim.protocol.channels import SUPERVISOR, Plane
from foosim.runtime.roles.wire import Wire
from foosim.runtime.transport.inbox import Inbox
from foosim.runtime.transport.session import Session

FRAME_BYTES: Final = 180_000
"""Of a thousand rovers."""
FRAMES: Final = 100
LONG_S: Final = 900.0

# Its link would end by its lease, in a second: what is seen here is what a put does to it.
LOOK: Final = """
import sys
from foosim.runtime.transport import settings
settings.LEASE_MS = 900_000
from foosim.runtime.transport.inbox import Inbox
from foosim.client.control import Control
inbox = Inbox(10_000)
with Control(sys.argv[1], role="viewer") as control:
    control.view(inbox)
    control._session.declare_alive("w/alive/viewer")
    numbers = []
    while True:
        for key, _, frame in inbox.take(900.0):
            if not numbers:
                print("looks", flush=True)
            numbers.append(frame[0])
            if frame[0] == 255:
                print(len(set(numbers)), flush=True)
                sys.exit(0)
"""


def test_a_viewer_that_does_not_read_holds_nobody_and_sees_what_comes_when_it_reads_again() -> None:
    """A put that waited for it would end its link, as it does on the other channels."""
    with Session.router("tcp/127.0.0.1:0") as router, Session.client(router.locator, LONG_S) as other:
        wire = Wire(router, Plane.SIMULATION, Inbox(10), SUPERVISOR)
        orders, presence = Inbox(1000), Inbox(10)
        router.watch_alive("w/alive/*", "alive", presence)
        other.subscribe(channels.ORDER.key_for_all, channels.ORDER.key, orders)
        with subprocess.Popen(
            [sys.executable, "-c", LOOK, router.locator], stdout=subprocess.PIPE, text=True
        ) as viewer:
            try:
                assert viewer.stdout is not None
                assert presence.take(LONG_S) == [("alive", "viewer", b"+")]
                while not orders.take(0.02):
                    wire.put(channels.ORDER, SUPERVISOR, b"order")
                while not select.select([viewer.stdout], [], [], 0.02)[0]:
                    wire.put(channels.VIEW, SUPERVISOR, bytes(FRAME_BYTES))
                assert viewer.stdout.readline() == "looks\n"
                viewer.send_signal(signal.SIGSTOP)
                for number in range(1, FRAMES + 1):
                    wire.put(channels.VIEW, SUPERVISOR, bytes([number]) * FRAME_BYTES)
                    wire.put(channels.ORDER, SUPERVISOR, bytes([number]))
                heard: list[bytes] = []
                while not heard or heard[-1] != bytes([FRAMES]):
                    heard += [payload for _, _, payload in orders.take(LONG_S)]
                assert [order for order in heard if order != b"order"] == [bytes([n]) for n in range(1, FRAMES + 1)]
                viewer.send_signal(signal.SIGCONT)
                while viewer.poll() is None:
                    wire.put(channels.VIEW, SUPERVISOR, bytes([255]) * FRAME_BYTES)
                    orders.take(0.02)
                assert 2 <= int(viewer.stdout.readline()) < FRAMES, "the others were lost"
                while router.alive("w/alive/*"):
                    pass
                assert presence.take(LONG_S) == [("alive", "viewer", b"-")], "nobody had waited for it before"
            finally:
                viewer.kill()
