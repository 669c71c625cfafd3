"""Random access to a capture's world: its state at any tick, as exactly as the capture has it.

At a tick there may be a captured frame, which is the world to the last bit, or captured poses alone; else what was
captured last before it holds. `Look.kind` is which.
"""

from __future__ import annotations

from array import array
from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass
from math import isnan
from pathlib import Path
from typing import Any, Final, Literal

import msgspec
import numpy as np
from numpy.typing import NDArray

from foosim.capture.columns import frame_of
from foosim.capture.foxglove import POSES
from foosim.capture.foxglove_reader import read_poses
from foosim.capture.index import CaptureIndex
from foosim.capture.mcap.checks import CaptureError
from foosim.capture.mcap.format import Message
from foosim.capture.reader import (
    DECODERS,
    CapturedTick,
    captured_tick,
    check_frame,
    check_layout,
    deployment_of,
    read_about,
    row_of,
)
from foosim.capture.rows import EPOCHS, FRAME, LAYOUT, METRICS, RECOVERIES, TICK, EpochRow, FrameRow, RecoveryRow
from foosim.console.shown.drawing import Drawing
from foosim.console.shown.tracks import GAP_NS, Pose, between, is_jump
from foosim.deployment.schema import Deployment
from foosim.world.frame import Frame

TOPICS: Final = (EPOCHS, FRAME, LAYOUT, METRICS, RECOVERIES, TICK, POSES)
Kind = Literal["frame", "poses", "computed", "held"]
"""What is seen at a tick: its captured frame, its captured poses, its frame computed again from the captured inputs and
equal in its digest, or the last captured one before it."""


@dataclass(frozen=True, slots=True)
class Look:
    """The view at a requested tick. `tick` is the one shown, `frame` the newest up to it."""

    requested: int
    tick: int
    kind: Kind
    poses: NDArray[np.float32]
    frame: Frame | None
    values: NDArray[np.float64]
    """The shown numbers of that frame; NaN before the first."""


class Recording:
    """An opened capture, also an unfinished one and one that grows. It belongs to one thread."""

    def __init__(self, path: Path, topics: tuple[str, ...] = ()) -> None:
        """`topics` are indexed beside the needed ones. Raises CaptureError."""
        self.about: Final = read_about(path)
        self.deployment: Final[Deployment] = deployment_of(self.about)
        self.tick_ns: Final = self.deployment.tick_ns
        self.index: Final = CaptureIndex(path, (*TOPICS, *topics))
        self.drawing: Final = Drawing(self.deployment)
        self._is_checked = False
        """Whether the capture has named its layout, which is that of the deployment."""
        self.epochs: list[EpochRow] = []
        self.recoveries: list[RecoveryRow] = []
        self._metrics: dict[str, tuple[array[int], array[float]]] = {}
        self._metrics_read = 0
        self._generation = self.index.generation
        self._take()

    @property
    def path(self) -> Path:
        return self.about.path

    @property
    def span(self) -> tuple[int, int]:
        """First and last tick, (0, 0) while it is empty."""
        times = self.index.places[TICK].log_ns or self.index.places[FRAME].log_ns
        return (times[0] // self.tick_ns, times[-1] // self.tick_ns) if times else (0, 0)

    def refresh(self) -> bool:
        """Read rows written since the last call; return whether there is more. Raises CaptureError."""
        if not self.index.refresh():
            return False
        if self.index.generation != self._generation:
            self._generation = self.index.generation
            self._is_checked = False
            self.epochs, self.recoveries = [], []
            self._metrics, self._metrics_read = {}, 0
        self._take()
        return True

    def _take(self) -> None:
        """Read the rows that are few: layout, epochs, recoveries."""
        if not self._is_checked and len(self.index.places[LAYOUT]):
            check_layout(self.path, self.drawing.layout, self.row(LAYOUT, 0))
            self._is_checked = True
        for topic, rows in ((EPOCHS, self.epochs), (RECOVERIES, self.recoveries)):
            rows += [self.row(topic, number) for number in range(len(rows), len(self.index.places[topic]))]

    def row(self, topic: str, number: int) -> Any:
        """Return a row of a topic by its number. Raises CaptureError for one that is damaged."""
        return self.decoded(DECODERS[topic], self.index.read(topic, number))

    def decoded(self, decoder: msgspec.json.Decoder[Any], message: Message) -> Any:
        """Return a message decoded. Raises CaptureError."""
        return row_of(decoder, message, f"{self.path}: ")

    def metrics_at(self, tick: int) -> dict[str, float]:
        """Return the metrics in rows up to a tick, by name. Raises CaptureError."""
        self._read_metrics()
        found = ((name, self.metric_at(name, tick)) for name in sorted(self._metrics))
        return {name: value for name, value in found if value is not None}

    def metric_at(self, name: str, tick: int) -> float | None:
        """Return a metric by the rows up to a tick; None without one. Raises CaptureError."""
        self._read_metrics()
        if name not in self._metrics:
            return None
        ticks, values = self._metrics[name]
        number = bisect_right(ticks, tick)
        return values[number - 1] if number else None

    def _read_metrics(self) -> None:
        """Read the rows of metrics that were written since the last call."""
        for number in range(self._metrics_read, len(self.index.places[METRICS])):
            row = self.row(METRICS, number)
            ticks, values = self._metrics.setdefault(row.name, (array("q"), array("d")))
            ticks.append(row.tick)
            values.append(row.value)
            self._metrics_read = number + 1

    # --- the world at a tick -----------------------------------------------------------------------------------------

    def look(self, tick: int) -> Look | None:
        """Return the view at a tick, None while the capture is empty. Raises CaptureError for damaged records."""
        time_ns = tick * self.tick_ns
        frame = self.frame(self.index.places[FRAME].newest(time_ns))
        number = self.index.places[POSES].newest(time_ns)
        posed = self.index.places[POSES].log_ns[number] // self.tick_ns if number >= 0 else -1
        if frame is not None and frame.tick >= posed:
            return self.seen(tick, frame, "frame" if frame.tick == tick else "held")
        if number < 0:
            return None
        values = np.full(self.drawing.layout.size, np.nan) if frame is None else self.shown(frame)
        return Look(tick, posed, "poses" if posed == tick else "held", self._poses(number), frame, values)

    def seen(self, tick: int, frame: Frame, kind: Kind) -> Look:
        """Return the view of a frame."""
        return Look(tick, frame.tick, kind, self.drawing.poser.poses(frame.values), frame, self.shown(frame))

    def shown(self, frame: Frame) -> NDArray[np.float64]:
        """Return the numbers of a frame that are shown."""
        return self.drawing.poser.numbers(frame.values)

    def frame(self, number: int) -> Frame | None:
        """Return a captured frame by its number; None for a negative one. Raises CaptureError."""
        if number < 0:
            return None
        row: FrameRow = self.row(FRAME, number)
        if not self._is_checked:
            raise CaptureError(f"{self.path}: a frame without a layout before it")
        check_frame(self.path, self.drawing.layout, row)
        return frame_of(self.drawing.layout, row)

    def frame_up_to(self, tick: int) -> Frame | None:
        """Return the newest captured frame at or before a tick. Raises CaptureError."""
        return self.frame(self.index.places[FRAME].newest(tick * self.tick_ns))

    def neighbour(self, tick: int, *, later: bool) -> int | None:
        """Return the next tick after or before one with a captured frame or poses; None beyond the last."""
        found = []
        for topic in (FRAME, POSES):
            places = self.index.places[topic]
            number = places.newest(tick * self.tick_ns) + 1 if later else places.newest(tick * self.tick_ns - 1)
            if 0 <= number < len(places):
                found.append(places.log_ns[number] // self.tick_ns)
        return (min(found) if later else max(found)) if found else None

    def poses_at(self, time_ns: int, *, links: bool = False) -> dict[str, Pose]:
        """Return the known pose of each entity (that of its last link), for comparisons; with `links` of links, too.

        Positions between two captured moments that are close are interpolated, but not over a jump. Raises
        CaptureError.
        """
        tick, rest_ns = divmod(time_ns, self.tick_ns)
        first, last = self.span
        look = self.look(tick) if first <= tick <= last else None
        if look is None:
            return {}
        drawing = self.drawing
        places = {**drawing.links, **drawing.entities} if links else drawing.entities

        def known(look: Look) -> dict[str, Pose]:
            rows = look.poses.tolist()
            found = ((name, rows[place]) for name, place in places.items())
            return {name: (tuple(row[:3]), tuple(row[3:])) for name, row in found if not isnan(row[0])}

        if look.tick == tick and not rest_ns:
            return known(look)
        later = self.neighbour(tick, later=True)
        after = None if later is None else self.look(later)
        passed_ns = (after.tick - look.tick) * self.tick_ns if after is not None else 0
        if after is None or not 0 < passed_ns <= GAP_NS:
            return {}
        share, ends = (time_ns - look.tick * self.tick_ns) / passed_ns, known(after)
        return {
            name: between(pose, ends[name], share)
            for name, pose in known(look).items()
            if name in ends and not is_jump(pose[0], ends[name][0], passed_ns)
        }

    def _poses(self, number: int) -> NDArray[np.float32]:
        """Return captured poses in the order of the scene's links."""
        poses = read_poses(self.index.read(POSES, number).data)
        return self.drawing.known({pose.link: (pose.position, pose.orientation) for pose in poses})

    def inputs(self, after: int, until: int) -> Iterator[CapturedTick]:
        """Yield the inputs of the ticks after one, up to another. Raises CaptureError where one is missing."""
        places = self.index.places[TICK]
        for tick in range(after + 1, until + 1):
            number = places.newest(tick * self.tick_ns)
            if number < 0 or places.log_ns[number] != tick * self.tick_ns:
                raise CaptureError(f"{self.path}: tick {tick} is missing")
            yield captured_tick(self.row(TICK, number))
