"""The status of a captured run at a tick, and curves over the run: numbers of frames, figures of links, values of the
status, readings of sensors. The status has the keys of a running one (`supervisor.status`) that a capture has.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Mapping
from typing import Any, Final

from foosim.capture.rows import FRAME, PACKETS
from foosim.common.errors import Malformed, UnknownName
from foosim.console.recorded.capture_history import CaptureHistory
from foosim.console.recorded.link_history import PACKET_MARKS
from foosim.console.recorded.recording import Look, Recording
from foosim.console.shown.curves import link_figure, value_at
from foosim.console.shown.source import Curve
from foosim.deployment.channel_kinds import channel_codec
from foosim.world.assembly.world import status_numbers, world_status, world_texts
from foosim.world.component_types.payloads import PayloadCodec


def status_at(recording: Recording, account: Mapping[str, Any], tick: int, look: Look | None) -> dict[str, Any]:
    """Return the status at a tick with the view `look`; `account` is the state of the clock."""
    about, deployment = recording.about, recording.deployment
    first, last = recording.span
    epoch = next((epoch for epoch in reversed(recording.epochs) if epoch.tick <= tick), None)
    owners = {} if epoch is None else {owner.robot: owner.node for owner in epoch.owners}
    roster = sorted(deployment.nodes) if epoch is None else epoch.roster
    frame = None if look is None else look.frame
    shown = {} if frame is None else world_status(deployment, frame)
    return {
        "run": about.metadata.get("run", ""),
        "world": deployment.world,
        "seed": deployment.seed,
        "ticks": tick,
        "first_tick": first,
        "last_tick": last,
        "tick_ns": recording.tick_ns,
        "epoch": 0 if epoch is None else epoch.epoch,
        **account,
        "finished": recording.index.finished,
        "shown": None if look is None else {"kind": look.kind, "tick": look.tick},
        "digest": {"frame": frame.digest.hex()} if frame is not None and frame.tick == tick else None,
        **shown,
        "metrics": {**status_numbers(shown), **recording.metrics_at(tick)},
        "summary": [] if frame is None else world_texts(deployment, shown),
        "nodes": {node: {"owned": sorted(robot for robot in owners if owners[robot] == node)} for node in roster},
        "recoveries": [
            {
                "what": row.what,
                "name": row.name,
                "reason": row.reason,
                "tick": row.tick,
                "epoch": row.epoch,
                "outage_ms": row.wall_outage_ns / 1e6,
            }
            for row in recording.recoveries
            if row.tick <= tick
        ],
    }


POINTS: Final = 600
STATUS_POINTS: Final = 200
WINDOW_NS: Final = 5_000_000_000
READING_NS: Final = 30_000_000_000
"""How far back readings are looked for."""
SPREAD_NS: Final = 1_000_000_000
"""By how much rows of packets may be out of order: packets that were longer in flight are not found."""

Points = list[tuple[float, float]]


def curve_points(history: CaptureHistory, curve: Curve, tick: int) -> Points:
    """Return the points of a curve, of the whole run or, of a reading, of the last time before a tick.

    Raises CaptureError.
    """
    recording = history.recording
    if curve.field is not None:
        return _field(history, curve.field)
    if curve.reading is not None:
        at_ns = tick * recording.tick_ns
        found = reading_points(history, *curve.reading, at_ns - READING_NS, at_ns)
        return [(at, numbers[curve.index]) for at, numbers in found if curve.index < len(numbers)]
    first, last = recording.span
    count = POINTS if curve.link is not None else STATUS_POINTS
    ticks = range(first, last + 1, max(1, (last - first) // count))
    values = [
        (at, _link(history, curve, at) if curve.link is not None else _status(history, curve, at)) for at in ticks
    ]
    return [(at, value) for at, value in values if value is not None]


def _field(history: CaptureHistory, field: int) -> Points:
    recording = history.recording
    numbers = range(len(recording.index.places[FRAME]))
    points: Points = []
    for number in numbers[:: max(1, len(numbers) // POINTS)]:
        frame = recording.frame(number)
        if frame is not None and field < frame.layout.size:
            points.append((frame.tick, float(recording.shown(frame)[field])))
    return points


def _link(history: CaptureHistory, curve: Curve, tick: int) -> float | None:
    rows: list[Mapping[str, Any]] = [*history.links.windows(tick * history.recording.tick_ns, WINDOW_NS, curve.link)]
    return link_figure(rows, curve.figure)


def _status(history: CaptureHistory, curve: Curve, tick: int) -> float | None:
    recording = history.recording
    if curve.status.startswith("packets."):
        return value_at({"packets": history.links.totals(tick * recording.tick_ns)}, curve.status)
    kind, _, metric = curve.status.partition(".")
    if kind == "metrics" and (value := recording.metric_at(metric, tick)) is not None:
        return value
    return value_at(status_at(recording, {}, tick, recording.look(tick)), curve.status)


def reading_points(
    history: CaptureHistory, robot: str, channel: str, after_ns: int, until_ns: int
) -> list[tuple[int, list[float]]]:
    """Return the readings of a robot on a channel in a time: tick and numbers of each. Raises CaptureError."""
    recording = history.recording
    try:
        codec = channel_codec(recording.deployment, robot, channel)
    except UnknownName:
        return []
    found = sorted(_packets(history, robot, channel, after_ns, until_ns).items())
    return [(sent_ns // recording.tick_ns, _numbers(codec, payload)) for sent_ns, payload in found]


def reading_at(history: CaptureHistory, robot: str, channel: str, tick: int) -> bytes:
    """Return the payload that a robot sent on a channel at a tick, empty without one. Raises CaptureError."""
    at_ns = tick * history.recording.tick_ns
    return _packets(history, robot, channel, at_ns - 1, at_ns).get(at_ns, b"")


def _packets(history: CaptureHistory, robot: str, channel: str, after_ns: int, until_ns: int) -> dict[int, bytes]:
    """Return the payloads that a robot sent on a channel in a time, by the time of sending."""
    recording = history.recording
    times = recording.index.places[PACKETS].log_ns
    found: dict[int, bytes] = {}
    first = bisect_right(times, after_ns)
    for number in range(first, min(len(times), bisect_left(times, until_ns + SPREAD_NS))):
        if not after_ns < times[number] <= until_ns:
            continue
        mark = recording.decoded(PACKET_MARKS, recording.index.read(PACKETS, number))
        if mark.source != robot or mark.sent_ns in found:
            continue
        row = history.packet(number)
        if row.channel == channel and row.payload:
            found[row.sent_ns] = row.payload
    return found


def _numbers(codec: PayloadCodec | None, payload: bytes) -> list[float]:
    if codec is None:
        return []
    try:
        return codec.numbers(codec.decode(payload))
    except Malformed:
        return []
