"""Verify a capture: simulate it again from orders and deliveries, compare the digest of every tick.

The function behind `foosim capture verify`. It starts with the frame that the run began with, which is frame 0 but
for a branch, on any number of nodes, and names the first tick and the entities that differ. With a later one it starts
only where that is asked for, of a cut. Frames between the captured ones are computed in the same way.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from foosim.capture.contents import library_versions
from foosim.capture.mcap.checks import CaptureError
from foosim.capture.reader import About, CaptureData, CapturedTick, beginning_of, check_whole, open_capture, read_about
from foosim.deployment.loader import load_deployment
from foosim.node.physics.mesh_trial import check_shapes
from foosim.simulation.resimulation import Replica
from foosim.simulation.run import with_nodes
from foosim.world.assembly.initial_state import first_chain, start_with
from foosim.world.frame import CHAIN_START, Frame, chain_next
from foosim.world.start import Start

COMPUTING: Final = ("mujoco-core", "numpy", "pybullet")
"""Libraries of which another version may compute another world."""


@dataclass(frozen=True, slots=True)
class Verified:
    """What a verification found. `tick` is the first that differs, -1 if none does; `entities` are those that do.

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
    """Whether the capture has its end: ticks of the run may follow one that has none."""

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
    text, name = about.deployment_text, about.deployment_name
    found = verify(text, name, capture.captured_ticks(), nodes, start, about.files)
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


def verify(
    text: str,
    name: str,
    ticks: Iterable[CapturedTick],
    nodes: int = 1,
    start: Start | None = None,
    files: Mapping[str, bytes] | None = None,
) -> Verified:
    """Simulate again the run of `ticks` (from 0, or from that of `start` on, in order) on `nodes` nodes, and compare.

    `files` are those that the deployment refers to, by path. Raises AssetError for one that is not acceptable.
    """
    replica = replica_of(text, name, files or {}, start, nodes)
    chain = first_chain(None if start is None else start.origin)
    try:
        first = replica.frame.tick
        found = _compare(replica, ticks, nodes, chain)
        return replace(found, arithmetic=replica.arithmetic.hex(), first_tick=first)
    finally:
        replica.close()


def replica_of(text: str, name: str, files: Mapping[str, bytes], start: Start | None, nodes: int = 1) -> Replica:
    """Return a deployment's world on so many nodes, at its start. Raises AssetError for a file of an unfit model."""
    text = with_nodes(text, name, nodes)
    deployment = load_deployment(text, name).with_assets(files)
    check_shapes(deployment, name, text)
    return Replica(text, name, deployment, start=start)


def _compare(replica: Replica, ticks: Iterable[CapturedTick], nodes: int, chain: bytes) -> Verified:
    first = expected = replica.frame.tick
    for captured in ticks:
        if captured.tick != expected:
            return Verified(replica.frame.tick, nodes, chain, missing_tick=expected)
        frame = replica.frame if expected == first else replica.step(captured.edits, captured.delivered)
        if frame.digest != captured.digest:
            return Verified(frame.tick, nodes, chain, frame.tick, _differing(frame, captured))
        if expected > first:
            chain = chain_next(chain, frame.digest)
        expected += 1
    return Verified(replica.frame.tick, nodes, chain)


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
        self._replica: Replica | None = None

    def __call__(self, frame: Frame, inputs: Iterable[CapturedTick]) -> Frame | None:
        """Return the frame that inputs lead to from a captured one; None where it is not what the capture had.

        Raises Refused where the capture cannot be computed again: its files do not fit.
        """
        replica = self._at(frame)
        for captured in inputs:
            found = replica.step(captured.edits, captured.delivered)
            if found.digest != captured.digest:
                self.close()
                return None
        return replica.frame

    def _at(self, frame: Frame) -> Replica:
        """Return the node, standing at a frame."""
        if self._replica is not None:
            if self._replica.frame.digest != frame.digest or self._replica.frame.tick != frame.tick:
                self._replica.set_back(frame)
            return self._replica
        about = self._about
        start = start_with(frame, about.path.name, CHAIN_START)
        self._replica = replica_of(about.deployment_text, about.deployment_name, about.files, start)
        return self._replica

    def close(self) -> None:
        """Give the node up; it is made again when it is needed."""
        if self._replica is not None:
            self._replica.close()
            self._replica = None
