"""The football table's own experiment: packets from a client through the vHub to a node and back, at three rates.

In 2012 YARP took 0.1161 ms between two programs at 100 Hz and lost none; it lost 2.1 % at 1 kHz and 40.1 % at 10 kHz.
Here a packet crosses four processes' links, and waits for ticks by design: it reaches a robot at the tick after the one
it was sent in, stands in the robot's outbox for one more, and is released at the one that sends it. So end to end is
some ticks; `beyond due` is how much later than its simulated due time it came, measured from the promptest packet of
the same tenth of a second, since a run that lagged far behind the clock does not make up for it (at 100 Hz these are
ten packets, and the figure is that much too good). Links are perfect, so every loss is foosim's own.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Final

from bench.echo_client import Echoed
from bench.runs import watch

RATES_HZ: Final = (100, 1_000, 10_000)
NAME: Final = "probe"
MARGIN_S: Final = 5.0
"""Simulated time for the client to start in, and for the last packets to come back."""
YARP: Final = {100: "0.1161 ms, none lost", 1_000: "0.1163 ms, 2.1 % lost", 10_000: "0.1596 ms, 40.1 % lost"}


@dataclass(frozen=True, slots=True)
class Echo:
    """One rate; `hub` is the hub's own account of the packets, which has the warm-up's, too."""

    rate_hz: int
    loss: float
    echoed: Echoed
    hub: dict[str, int]


def echo(seconds: float = 6.0) -> list[Echo]:
    """Measure each rate for so many seconds, in real time at ticks of 2 ms."""
    return [_measure(rate_hz, seconds) for rate_hz in RATES_HZ]


def _measure(rate_hz: int, seconds: float) -> Echo:
    def client(simulation: str, radio: str) -> list[list[str]]:
        options = ["--name", NAME, "--connect", radio, "--rate", str(rate_hz), "--seconds", str(seconds)]
        return [["-m", "bench.echo_client", *options]]

    sets = ["tick=2 ms", "substeps=4", "players={}", f"clients={{{NAME}: {{}}}}", "network.links=[]"]
    run = watch("realtime", seconds + MARGIN_S, sets, every_s=1.0, helpers=client)
    echoed = Echoed(**json.loads(run.printed[0].splitlines()[-1]))
    return Echo(rate_hz, 1.0 - echoed.received / echoed.sent, echoed, run.result["packets"])


def lines(rows: list[Echo]) -> list[str]:
    """Return the figures for people."""
    titles = f"{'sent':>8}{'lost':>9}{'end to end p50':>17}{'p99':>8}{'beyond due p50':>17}{'p99':>8}{'max':>8}"
    shown = [f"{'':10}{titles}  ms"]
    for row in rows:
        end, beyond = row.echoed.end_to_end_ms, row.echoed.beyond_due_ms
        shown.append(
            f"{row.rate_hz:7} Hz{row.echoed.sent:8}{row.loss:9.2%}{end[0]:17.2f}{end[1]:8.2f}"
            f"{beyond[0]:17.2f}{beyond[1]:8.2f}{beyond[2]:8.2f}  (YARP, one way: {YARP[row.rate_hz]})"
        )
    return shown
