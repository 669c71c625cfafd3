"""Verify a capture: simulate it again from orders and deliveries, compare the digest of every tick.

The typed function behind `foosim-replay verify`. It starts at frame 0, never from a later frame, on any number of
nodes, and names the first tick and entity that differ. Neighbours: `replica` computes, `vhub.capture_reader` reads.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from foosim.node.engines.probation import check_models
from foosim.protocol.deployment_file import load_deployment
from foosim.protocol.frame import CHAIN_START, Frame, chain_next
from foosim.rehearsal.rehearse import with_nodes
from foosim.rehearsal.replica import Replica
from foosim.vhub.capture_reader import CapturedTick, open_capture


@dataclass(frozen=True, slots=True)
class Verified:
    """What a verification found. `tick` is the first that differs, -1 if none does; `entities` are those that do."""

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

    @property
    def equal(self) -> bool:
        return self.tick < 0 and self.missing_tick < 0


def verify_capture(path: Path | str, nodes: int = 1) -> Verified:
    """Verify a capture file. Raises CaptureError for one that cannot be read."""
    capture = open_capture(path)
    about = capture.about
    found = verify(about.deployment_text, about.deployment_name, capture.captured_ticks(), nodes, about.files)
    kept = {epoch.arithmetic for epoch in capture.epochs}
    return replace(found, other_arithmetic=tuple(sorted(kept - {"", found.arithmetic})))


def verify(
    text: str, name: str, ticks: Iterable[CapturedTick], nodes: int = 1, files: Mapping[str, bytes] | None = None
) -> Verified:
    """Simulate again what `ticks` (from 0 on, in order) say, on `nodes` nodes, and compare.

    `files` are those that the deployment refers to, by path. Raises AssetError for one that is not acceptable.
    """
    text = with_nodes(text, name, nodes)
    deployment = load_deployment(text, name).with_assets(files or {})
    check_models(deployment, name, text)
    replica = Replica(text, name, deployment)
    try:
        return replace(_compare(replica, ticks, nodes), arithmetic=replica.arithmetic.hex())
    finally:
        replica.close()


def _compare(replica: Replica, ticks: Iterable[CapturedTick], nodes: int) -> Verified:
    chain = CHAIN_START
    for captured in ticks:
        expected = replica.frame.tick + 1 if captured.tick > 0 else 0
        if captured.tick != expected:
            return Verified(replica.frame.tick, nodes, chain, missing_tick=expected)
        frame = replica.frame if captured.tick == 0 else replica.step(captured.edits, captured.delivered)
        if frame.digest != captured.digest:
            return Verified(frame.tick, nodes, chain, frame.tick, _differing(frame, captured))
        if frame.tick > 0:
            chain = chain_next(chain, frame.digest)
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
