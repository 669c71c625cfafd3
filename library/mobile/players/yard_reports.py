"""Payloads of the radio messages in a yard: reports of scouts, and the reports that the watch overhead passes on.

A damaged payload, or a foreign one on the same channel, decodes to None. Numbers are little-endian.
"""

from __future__ import annotations

import struct
from math import isfinite
from typing import Final, NamedTuple

from foosim.client.player import Samples

REPORT: Final = "report"
WATCH: Final = "watch"
"""Channels: from each scout to all, and from the quadrotor to all."""

CRATES_MAX: Final = 8
REPORTS_MAX: Final = 8
_HEAD = struct.Struct("<BBBfff")
_CRATE = struct.Struct("<ff")


class Report(NamedTuple):
    """The report of a scout: its number, the time (s), where it is (m), the number of crates that it is done with, and
    their places (m), in the order in which it put them there."""

    number: int
    time: float
    x: float
    y: float
    done: int
    crates: tuple[tuple[float, float], ...] = ()


def encode_report(report: Report) -> bytes:
    """Return a report's bytes: 15, and 8 a crate."""
    crates = report.crates[-CRATES_MAX:]
    head = _HEAD.pack(report.number, report.done, len(crates), report.time, report.x, report.y)
    return head + b"".join(_CRATE.pack(x, y) for x, y in crates)


def decode_report(payload: object) -> Report | None:
    """Return the report that a payload holds; None for none."""
    found = _report_at(payload, 0) if isinstance(payload, bytes) else None
    return found[0] if found is not None and isinstance(payload, bytes) and found[1] == len(payload) else None


def encode_watch(reports: list[Report]) -> bytes:
    """Return the bytes of reports that are passed on."""
    return b"".join(encode_report(report) for report in reports[:REPORTS_MAX])


def decode_watch(payload: object) -> list[Report]:
    """Return the reports in a payload; none of one that is damaged."""
    found: list[Report] = []
    at = 0
    while isinstance(payload, bytes) and at < len(payload):
        one = _report_at(payload, at)
        if one is None or len(found) == REPORTS_MAX:
            return []
        found.append(one[0])
        at = one[1]
    return found


def _report_at(payload: bytes, at: int) -> tuple[Report, int] | None:
    if len(payload) < at + _HEAD.size:
        return None
    number, done, count, time, x, y = _HEAD.unpack_from(payload, at)
    at += _HEAD.size
    if count > CRATES_MAX or len(payload) < at + count * _CRATE.size:
        return None
    crates = tuple(_CRATE.unpack_from(payload, at + number * _CRATE.size) for number in range(count))
    values = [time, x, y, *(part for crate in crates for part in crate)]
    if not all(map(isfinite, values)):
        return None
    return Report(number, time, x, y, done, crates), at + count * _CRATE.size


class Heard:
    """The newest report of each scout, by any way."""

    def __init__(self) -> None:
        self.reports: dict[int, Report] = {}
        """By the number of the scout."""

    def take(self, samples: Samples) -> None:
        """Take arrived reports."""
        for (_, channel), sample in samples.items():
            if channel == REPORT:
                report = decode_report(sample.value)
                self._keep([] if report is None else [report])
            elif channel == WATCH:
                self._keep(decode_watch(sample.value))

    def _keep(self, reports: list[Report]) -> None:
        for report in reports:
            known = self.reports.get(report.number)
            if known is None or known.time < report.time:
                self.reports[report.number] = report
