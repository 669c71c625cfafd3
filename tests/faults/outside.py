"""Faults that come from outside: a client that says too much, commands and pushes that no body can take.

What others do must cost a run nothing but what it counts; the world that comes of it is computed again from its
capture.
"""

from __future__ import annotations

import struct
import time
from contextlib import suppress
from math import inf, nan
from statistics import median
from typing import Any, Final

from foosim.client.client import Client, connect
from foosim.client.control import RequestRefused
from foosim.client.errors import ConnectionRefused
from foosim.common import limits
from foosim.common.names import CHANNEL_ECHO
from tests.faults.cluster import Cluster, FaultError
from tests.faults.kinds import Figures, Kind, Trial

CLIENT: Final = "flooder"
SETS: Final = (f"clients={{{CLIENT}: {{}}}}",)
ROBOT: Final = "red.attack"
AT_ONCE: Final = 16
TURNS: Final = 50
TURN_S: Final = 0.01
LAG_MS: Final = 20.0
"""By how much later ticks may be with a flood than without."""
BIG: Final = bytes(32_000)
TOO_MANY: Final = 2 * limits.CLIENT_INBOX_BYTES_MAX // len(BIG)
"""Big packets, of which an inbox takes half."""
IMPULSE: Final = 0.8
"""N s: what a person may ask for at most is 0.84, which makes the ball as fast as it may be."""


def client_floods(trial: Trial) -> Figures:
    """One client says 1,600 packets a second, then more at once than an inbox takes: it is refused, and counted."""
    cluster = trial.cluster
    trial.calm()
    known = cluster.status()
    with entered(cluster) as client:
        calm_ms = lag_ms(cluster, client, 0)
        more_ms = lag_ms(cluster, client, AT_ONCE) - calm_ms
        cluster.control.request("pause")
        cluster.wait("the pause", lambda: (now := cluster.status())["ticks"] == now["released"])
        for number in range(TOO_MANY):
            client.send((ROBOT, "player-red")[number % 2], CHANNEL_ECHO, BIG)
        cluster.control.request("resume")
        before = known["refusals"].get("inbox_full", 0)
        cluster.wait("what is refused", lambda: heard(cluster, client)["refusals"].get("inbox_full", 0) > before)
    unharmed(cluster, known)
    return {"more lag": max(0.0, more_ms)}


def lag_ms(cluster: Cluster, client: Client, packets: int) -> float:
    """Log so many packets a hundred times a second; return the median lag of the ticks that are seen meanwhile."""
    seen = []
    begun_s = time.monotonic()
    for turn in range(1, TURNS + 1):
        for _ in range(packets):
            client.send(ROBOT, CHANNEL_ECHO, b"flood")
        seen.append(float(heard(cluster, client)["late"]["lag_ms"]))
        time.sleep(max(0.0, begun_s + turn * TURN_S - time.monotonic()))
    return median(seen)


def robot_explodes(trial: Trial) -> Figures:
    """Commands that are no numbers, a push that is none, and two at one tick that make the ball too fast."""
    cluster = trial.cluster
    trial.calm()
    known = cluster.status()
    with entered(cluster) as client:
        for slide in (nan, inf, -inf, 1e300):
            for payload in (struct.pack("<dd", slide, 0.0), struct.pack("<dd", 0.0, slide), b"\xff" * 16):
                client.send(ROBOT, "position", payload)
        cluster.advance(5)
    with suppress(RequestRefused):
        cluster.control.request("push", impulse=[1e300, 0.0, 0.0])
        raise FaultError("a push of 1e300 N s is accepted")
    cluster.control.request("pause")
    for _ in range(2):
        cluster.control.request("push", impulse=[IMPULSE, 0.0, 0.0])
    cluster.control.request("resume")
    cluster.advance()
    stands = cluster.status()["ball"]["position"]
    cluster.wait("the kick-off", lambda: cluster.status()["ball"]["position"] != stands)
    unharmed(cluster, known)
    return {}


def entered(cluster: Cluster) -> Client:
    """Return the client, let in and taking part; the one before it may still be on its way out."""

    def enter() -> Client | None:
        with suppress(ConnectionRefused):
            return connect(cluster.radio, CLIENT)
        return None

    client = cluster.wait("a client that is let in", enter)
    client.listen()
    cluster.wait("its part in the run", lambda: CLIENT in cluster.status()["clients"])
    return client


def heard(cluster: Cluster, client: Client) -> dict[str, Any]:
    """Return the status; meanwhile the client takes what it is told, and sends again what is not recorded."""
    client.receive(0.001)
    return cluster.status()


def unharmed(cluster: Cluster, known: dict[str, Any]) -> None:
    """Raise FaultError when it has cost the run more than packets."""
    cluster.advance(50)
    now = cluster.status()
    if now["recoveries"] != known["recoveries"]:
        raise FaultError(f"it cost the run {now['recoveries'][len(known['recoveries']) :]}")
    packets = now["packets"]
    if packets["offered"] != packets["delivered"] + packets["dropped"] + packets["in_flight"]:
        raise FaultError(f"packets without a fate: {packets}")


OUTSIDE: Final = (
    Kind("client_floods", "a client says too much", client_floods, {"more lag": LAG_MS}, sets=SETS, altered=True),
    Kind("robot_explodes", "commands and pushes of no number", robot_explodes, sets=SETS, altered=True),
)
