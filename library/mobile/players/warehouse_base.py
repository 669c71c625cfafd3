"""Dispatch: the software of a base station. It collects telemetry of rovers and broadcasts all positions.

So a rover without a neighbour in radio range still has the others' positions, with their age.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from mypy_extensions import mypyc_attr

from foosim.client.player import Packet, Player, Samples, Turn
from foosim.common.errors import BadValue
from foosim.deployment.schema import Deployment
from foosim.library.mobile.players.beacons import FLEET, TELEMETRY, Entry, Telemetry, decode_telemetry, encode_fleet
from foosim.library.mobile.players.roadmap import roadmap_of
from foosim.library.mobile.rover import RoverRobot

FLEET_S: Final = 1.0
FORGOTTEN_S: Final = 60.0
ENTRIES_MAX: Final = 30
"""210 bytes, which the smallest packets of the usual radios hold; the newest are sent."""


@mypyc_attr(allow_interpreted_subclasses=True)
class Dispatch(Player):
    """The player. Its one parameter is `cell_m`, the patrols' own: both number the spots of the same roadmap."""

    def __init__(self, deployment: Deployment, parameters: Mapping[str, Any]) -> None:
        cell_m = {"cell_m": 2.5, **parameters}.pop("cell_m")
        if set(parameters) - {"cell_m"}:
            raise BadValue("a dispatch has only the parameter cell_m", ", ".join(sorted(set(parameters) - {"cell_m"})))
        if isinstance(cell_m, bool) or not isinstance(cell_m, int | float) or not 0.0 < cell_m < 1000.0:
            raise BadValue("parameter cell_m is not a number above 0", cell_m)
        self.fleet: dict[int, tuple[float, Telemetry]] = {}
        """The last telemetry of each rover, and its time (s), by number."""
        self._rovers = sum(isinstance(robot, RoverRobot) for robot in deployment.robots.values())
        self._spots = len(roadmap_of(deployment, cell_m).spots)
        self._tick_s = deployment.tick_ns / 1e9
        self._due_s = 0.0

    def act(self, tick: int, samples: Samples) -> Turn:
        """Take new telemetry; once a second, broadcast the fleet."""
        now_s = tick * self._tick_s
        for (_, channel), sample in samples.items():
            if channel != TELEMETRY:
                continue
            telemetry = decode_telemetry(sample.value, self._rovers, self._spots)
            sent_s = sample.sent_ns / 1e9
            if telemetry is not None and sent_s > self.fleet.get(telemetry.number, (-1.0, telemetry))[0]:
                self.fleet[telemetry.number] = sent_s, telemetry
        if now_s < self._due_s:
            return Turn({})
        self._due_s = now_s + FLEET_S
        known = sorted((now_s - sent_s, number) for number, (sent_s, _) in self.fleet.items())
        newest = [(age, self.fleet[number][1]) for age, number in known if age <= FORGOTTEN_S][:ENTRIES_MAX]
        entries = [Entry(telemetry.number, telemetry.here, telemetry.goal, age) for age, telemetry in newest]
        turn = Turn({}, [Packet("", FLEET, encode_fleet(entries))] if entries else [])
        turn.report("rovers_heard", len(newest))
        return turn
