"""Random access to a capture's world: its state at any tick, as exactly as the capture has it.

At a tick there may be a captured frame, which is the world to the last bit, or captured poses alone; else what was
captured last before it holds. `Look.kind` says which.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Final, Literal

import msgspec
import numpy as np
from numpy.typing import NDArray

from foosim.capture.columns import frame_of
from foosim.capture.foxglove import POSES
from foosim.capture.foxglove_reader import read_poses
from foosim.capture.mcap.checks import CaptureError
from foosim.capture.mcap.format import Message
from foosim.capture.reader import DECODERS, CapturedTick, captured_tick, deployment_of, layout_of, read_about, row_of
from foosim.capture.rows import EPOCHS, FRAME, LAYOUT, RECOVERIES, TICK, EpochRow, FrameRow, RecoveryRow
from foosim.console.recorded.capture_index import CaptureIndex
from foosim.console.shown.drawing import Drawing
from foosim.deployment.schema import Deployment
from foosim.world.frame import Frame
from foosim.world.layout import Layout

TOPICS: Final = (EPOCHS, FRAME, LAYOUT, RECOVERIES, TICK, POSES)
Kind = Literal["frame", "poses", "computed", "held"]
"""What is seen at a tick: its captured frame, its captured poses, its frame computed again from the captured inputs and
equal in its digest, or what was captured last before it."""


@dataclass(frozen=True)
class World:
    """A layout, as it is drawn, in force from a tick on."""

    tick: int
    drawing: Drawing

    @property
    def layout(self) -> Layout:
        return self.drawing.layout

    @cached_property
    def links(self) -> dict[str, int]:
        """The place of each link in the order of the scene, by name."""
        names = [link.name for body in self.drawing.scene.bodies.values() for link in body.links]
        return {name: place for place, name in enumerate(names)}

    @cached_property
    def entities(self) -> dict[str, int]:
        """The place of each entity's last link, by the entity's name."""
        return {name: self.links[body.links[-1].name] for name, body in self.drawing.scene.bodies.items()}


@dataclass(frozen=True, slots=True)
class Look:
    """What is seen at a tick that was asked for. `tick` is that of what is shown, `frame` the newest up to it."""

    asked: int
    tick: int
    kind: Kind
    world: int
    """Number of the present world."""
    poses: NDArray[np.float32]
    frame: Frame | None
    values: NDArray[np.float64]
    """The numbers of that frame; not a number where the layout has no captured frame yet."""


class Recording:
    """An opened capture, also an unfinished one and one that grows. It belongs to one thread."""

    def __init__(self, path: Path, topics: tuple[str, ...] = ()) -> None:
        """`topics` are indexed beside those that are needed. Raises CaptureError."""
        self.about: Final = read_about(path)
        self.deployment: Final[Deployment] = deployment_of(self.about)
        self.tick_ns: Final = self.deployment.tick_ns
        self.index: Final = CaptureIndex(path, (*TOPICS, *topics))
        self.worlds: list[World] = []
        self.epochs: list[EpochRow] = []
        self.recoveries: list[RecoveryRow] = []
        self._generation = self.index.generation
        self._take()

    @property
    def path(self) -> Path:
        return self.about.path

    @property
    def span(self) -> tuple[int, int]:
        """First and last tick that it has, (0, 0) while it has none."""
        times = self.index.places[TICK].log_ns or self.index.places[FRAME].log_ns
        return (times[0] // self.tick_ns, times[-1] // self.tick_ns) if times else (0, 0)

    def refresh(self) -> bool:
        """Read rows written since the last call; return whether there is more. Raises CaptureError."""
        if not self.index.refresh():
            return False
        if self.index.generation != self._generation:
            self._generation = self.index.generation
            self.worlds, self.epochs, self.recoveries = [], [], []
        self._take()
        return True

    def _take(self) -> None:
        """Read the rows that are few: layouts, epochs, recoveries."""
        for number in range(len(self.worlds), len(self.index.places[LAYOUT])):
            row = self.row(LAYOUT, number)
            drawing = Drawing(self.deployment, layout_of(self.path, self.deployment, row))
            self.worlds.append(World(row.tick, drawing))
        for topic, rows in ((EPOCHS, self.epochs), (RECOVERIES, self.recoveries)):
            rows += [self.row(topic, number) for number in range(len(rows), len(self.index.places[topic]))]

    def row(self, topic: str, number: int) -> Any:
        """Return a row of a topic by its number. Raises CaptureError for one that is damaged."""
        return self.decoded(DECODERS[topic], self.index.read(topic, number))

    def decoded(self, decoder: msgspec.json.Decoder[Any], message: Message) -> Any:
        """Return what a decoder makes of a message. Raises CaptureError."""
        return row_of(decoder, message, f"{self.path}: ")

    def world_at(self, tick: int) -> int:
        """Return the number of the world at a tick; the first one before its beginning."""
        return max(0, bisect_right(self.worlds, tick, key=lambda world: world.tick) - 1)

    # --- the world at a tick -----------------------------------------------------------------------------------------

    def look(self, tick: int) -> Look | None:
        """Return what is seen at a tick, None while there is nothing. Raises CaptureError for what is damaged."""
        time_ns = tick * self.tick_ns
        frame = self.frame(self.index.places[FRAME].newest(time_ns))
        number = self.index.places[POSES].newest(time_ns)
        posed = self.index.places[POSES].log_ns[number] // self.tick_ns if number >= 0 else -1
        if frame is not None and frame.tick >= posed:
            return self.seen(tick, frame, "frame" if frame.tick == tick else "held")
        if number < 0 or not self.worlds:
            return None
        world = self.world_at(posed)
        poses = self._poses(self.worlds[world], number)
        layout = self.worlds[world].layout
        kind: Kind = "poses" if posed == tick else "held"
        if frame is None or frame.layout is not layout:
            return Look(tick, posed, kind, world, poses, None, np.full(layout.size, np.nan))
        return Look(tick, posed, kind, world, poses, frame, frame.values)

    def seen(self, tick: int, frame: Frame, kind: Kind) -> Look:
        """Return what is seen of a frame."""
        world = self.world_at(frame.tick)
        poses = self.worlds[world].drawing.poser.poses(frame.values)
        return Look(tick, frame.tick, kind, world, poses, frame, frame.values)

    def frame(self, number: int) -> Frame | None:
        """Return a captured frame by its number; None for a negative one. Raises CaptureError."""
        if number < 0:
            return None
        row: FrameRow = self.row(FRAME, number)
        if not self.worlds:
            raise CaptureError(f"{self.path}: a frame without a layout before it")
        layout = self.worlds[self.world_at(row.tick)].layout
        if len(row.values) != 8 * layout.size or any(box.index >= len(layout.entities) for box in row.outboxes):
            raise CaptureError(f"{self.path}: frame {row.tick} does not fit its layout of {layout.size} numbers")
        return frame_of(layout, row)

    def frame_up_to(self, tick: int) -> Frame | None:
        """Return the newest captured frame at or before a tick. Raises CaptureError."""
        return self.frame(self.index.places[FRAME].newest(tick * self.tick_ns))

    def neighbour(self, tick: int, *, later: bool) -> int | None:
        """Return the next tick behind, or before, one with a captured frame or poses; None where there is none."""
        found = []
        for topic in (FRAME, POSES):
            places = self.index.places[topic]
            number = places.newest(tick * self.tick_ns) + 1 if later else places.newest(tick * self.tick_ns - 1)
            if 0 <= number < len(places):
                found.append(places.log_ns[number] // self.tick_ns)
        return (min(found) if later else max(found)) if found else None

    def _poses(self, world: World, number: int) -> NDArray[np.float32]:
        """Return captured poses in the order of a world's links; a link of which there is none stays at the origin."""
        poses = np.zeros((len(world.links), 7), np.float32)
        poses[:, 6] = 1.0
        for pose in read_poses(self.index.read(POSES, number).data):
            place = world.links.get(pose.link)
            if place is not None:
                poses[place] = (*pose.position, *pose.orientation)
        return poses

    def inputs(self, after: int, until: int) -> Iterator[CapturedTick]:
        """Yield what led to the ticks behind one, up to another. Raises CaptureError where one is missing."""
        places = self.index.places[TICK]
        for tick in range(after + 1, until + 1):
            number = places.newest(tick * self.tick_ns)
            if number < 0 or places.log_ns[number] != tick * self.tick_ns:
                raise CaptureError(f"{self.path}: tick {tick} is not there")
            yield captured_tick(self.row(TICK, number))

    def epoch_at(self, tick: int) -> EpochRow | None:
        """Return the owners from a tick on."""
        number = bisect_right(self.epochs, tick, key=lambda epoch: epoch.tick) - 1
        return self.epochs[number] if number >= 0 else None
