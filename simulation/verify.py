"""Verify a capture: simulate it again from orders and deliveries, compare the digest of every tick.

The function behind `foosim capture verify`. It starts with the frame that the run began with, which is frame 0 but
for a branch, on any number of nodes, and names the first tick and the entities that differ. It starts with a later one
only on request, of a cut. Frames between the captured ones are computed in the same way.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from foosim.capture.contents import library_versions
from foosim.capture.mcap.checks import CaptureError
from foosim.capture.reader import (
    About,
    CaptureData,
    CapturedTick,
    beginning_of,
    check_whole,
    deployment_of,
    open_capture,
    read_about,
)
from foosim.common.errors import BadValue
from foosim.common.limits import NODES_MAX
from foosim.deployment.schema import Deployment
from foosim.node.physics.mesh_trial import check_shapes
from foosim.simulation.stepped_world import SteppedWorld, deal_robots
from foosim.world.assembly.initial_state import first_chain, first_frame, start_with
from foosim.world.frame import Frame, chain_next
from foosim.world.start import Start

COMPUTING: Final = ("mujoco-core", "numpy", "pybullet")
"""Libraries of which another version may compute another world."""


@dataclass(frozen=True, slots=True)
class Verified:
    """What a verification found. `tick` is the first that differs, -1 if none does; `entities` are the differing ones.

    `first_tick` is that of the frame that the run began with, `ticks` that of the last one that was compared.
    """

    ticks: int
    nodes: int
    chain: bytes
    tick: int = -1
    entities: tuple[str, ...] = ()
    missing_tick: int = -1
    """The first tick that the capture lacks, -1 if it is whole."""
    arithmetic: str = ""
    """This machine's digest of the fixed small run of an engine, in hex."""
    other_arithmetic: tuple[str, ...] = ()
    """Those that the capture has and that are others."""
    other_versions: tuple[str, ...] = ()
    """Libraries that compute worlds and have another version here: `LIBRARY VERSION, here VERSION`."""
    first_tick: int = 0
    finished: bool = True
    """Whether the capture has its end: ticks of the run may follow an unfinished one."""

    @property
    def equal(self) -> bool:
        return self.tick < 0 and self.missing_tick < 0


def verify_capture(path: Path | str, nodes: int = 1, *, from_first_frame: bool = False) -> Verified:
    """Verify a capture file. With `from_first_frame` it may be a cut: what follows on its first frame is verified, not
    how that frame came.

    Raises CaptureError for one that cannot be read or, without that, is a cut.
    """
    if not from_first_frame:
        check_whole(read_about(Path(path)))
    capture = open_capture(path)
    about = capture.about
    capture.first_frame()  # numbers in another layout are not compared, since they mean something else
    start = start_of(capture)
    found = verify(about, capture.captured_ticks(), nodes, start)
    kept = {epoch.arithmetic for epoch in capture.epochs}
    others = tuple(sorted(kept - {"", found.arithmetic}))
    here = library_versions()
    versions = tuple(
        [
            f"{name} {about.versions.get(name)}, here {here[name]}"
            for name in COMPUTING
            if about.versions.get(name) != here[name]
        ]
    )
    return replace(found, other_arithmetic=others, other_versions=versions, finished=capture.finished)


def start_of(capture: CaptureData) -> Start | None:
    """Return the frame that a captured run, or a cut, begins with, None where that is frame 0. Raises CaptureError."""
    origin = beginning_of(capture.about)
    if origin is None:
        return None
    first = capture.first_frame()
    if first is None or first.digest != origin.digest:
        raise CaptureError(f"{capture.path}: it does not have frame {origin.tick}, with which it begins")
    return start_with(first, origin.source, origin.chain)


def verify(about: About, ticks: Iterable[CapturedTick], nodes: int = 1, start: Start | None = None) -> Verified:
    """Simulate again the run of `ticks` (from 0, or from the tick of `start`, in order) on `nodes` nodes, and compare.

    Raises CaptureError for a deployment that is invalid here, AssetError for a mesh that an engine refuses, BadValue
    for another number of nodes.
    """
    if not 1 <= nodes <= NODES_MAX:
        raise BadValue(f"the number of nodes is 1 to {NODES_MAX}", nodes)
    deployment = deployment_of(about)
    world = captured_world(about, deployment, first_frame(deployment, start), nodes)
    chain = first_chain(None if start is None else start.origin)
    try:
        first = world.frame.tick
        found = _compare(world, ticks, nodes, chain)
        return replace(found, arithmetic=world.arithmetic().hex(), first_tick=first)
    finally:
        world.close()


def captured_world(about: About, deployment: Deployment, frame: Frame, nodes: int = 1) -> SteppedWorld:
    """Return a capture's world at a frame, on `nodes` nodes.

    Raises CaptureError for an engine that this machine lacks, AssetError for a file of an unfit model.
    """
    if lack := deployment.engine_type.lack:
        raise CaptureError(f"the run cannot be computed again here: {lack}")
    check_shapes(deployment, about.deployment_name, about.deployment_text)
    return SteppedWorld(deployment, frame, deal_robots(deployment, nodes))


def simulated_again(capture: CaptureData) -> Iterator[Frame]:
    """Yield the frames of a capture from the first captured one on, computed again. Raises CaptureError."""
    first = capture.first_frame()
    if first is None:
        raise CaptureError(f"{capture.path}: no captured frame")
    world = captured_world(capture.about, capture.deployment, first)
    try:
        for captured in capture.captured_ticks():
            if captured.tick < first.tick:
                continue
            frame = frame_of(world, captured)
            if frame.digest != captured.digest:
                raise CaptureError(f"{capture.path}: tick {captured.tick} computed again differs from the captured one")
            yield frame
    finally:
        world.close()


def frame_of(world: SteppedWorld, captured: CapturedTick) -> Frame:
    """Return the present frame, or compute the next one, whichever a captured tick is of."""
    return world.frame if captured.tick == world.frame.tick else world.step(captured.delivered, captured.edits)


def _compare(world: SteppedWorld, ticks: Iterable[CapturedTick], nodes: int, chain: bytes) -> Verified:
    first = expected = world.frame.tick
    for captured in ticks:
        if captured.tick != expected:
            return Verified(world.frame.tick, nodes, chain, missing_tick=expected)
        frame = frame_of(world, captured)
        if frame.digest != captured.digest:
            return Verified(frame.tick, nodes, chain, frame.tick, _differing(frame, captured))
        if expected > first:
            chain = chain_next(chain, frame.digest)
        expected += 1
    return Verified(world.frame.tick, nodes, chain)


def _differing(frame: Frame, captured: CapturedTick) -> tuple[str, ...]:
    """Return the names of the entities whose digests differ."""
    entities = frame.layout.entities
    if len(captured.entities) != len(entities):
        return ("layout",)
    return tuple(
        entity.name
        for entity, digest in zip(entities, captured.entities, strict=True)
        if frame.entity_digest(entity) != digest
    )


class Between:
    """Computes frames of one capture on one node, which is made when it is first needed. It belongs to one thread."""

    def __init__(self, about: About) -> None:
        self._about = about
        self._world: SteppedWorld | None = None

    def __call__(self, frame: Frame, inputs: Iterable[CapturedTick]) -> Frame | None:
        """Return the frame that inputs lead to from a captured one; None where it is not what the capture had.

        Raises Refused where the capture cannot be computed again: its files do not fit.
        """
        if self._world is None:
            self._world = captured_world(self._about, deployment_of(self._about), frame)
        world = self._world
        if (world.frame.tick, world.frame.digest) != (frame.tick, frame.digest):
            world.go_to(frame)
        for captured in inputs:
            if frame_of(world, captured).digest != captured.digest:
                return None
        return world.frame

    def close(self) -> None:
        """Free the engine; it is made again when it is needed."""
        if self._world is not None:
            self._world.close()
            self._world = None
