"""What a run begins with: the world at tick 0, or a frame of another run; and the state of an entity that is added.

Tick 0 and additions are pure functions of the deployment. A run that begins with a frame of another one keeps that
frame's tick and the chain up to it, so that equal inputs give equal digests.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from foosim.common.errors import BadValue, Malformed
from foosim.world.assembly.world import initial_numbers
from foosim.world.frame import CHAIN_START, Frame, frame_from_bytes
from foosim.world.layout import Layout, build_layout
from foosim.world.spec import WorldSpec
from foosim.world.start import AddedEntity, Origin, Start


def initial_frame(spec: WorldSpec) -> Frame:
    """Return frame 0."""
    layout = build_layout(spec)
    return Frame(0, layout, np.array(initial_numbers(spec, layout)))


def start_with(frame: Frame, source: str, chain: bytes, added: Iterable[AddedEntity]) -> Start:
    """Return the start with a frame of `source`; `chain` is over all frames up to it."""
    origin = Origin(frame.tick, source, frame.digest, chain)
    return Start(origin, frame.values.tobytes(), frame.outbox_items, list(added))


def first_frame(spec: WorldSpec, start: Start | None) -> Frame:
    """Return the frame that a run begins with.

    Raises BadValue for a start whose frame does not fit the deployment.
    """
    if start is None:
        return initial_frame(spec)
    try:
        layout = build_layout(spec, [(entity.name, entity.model) for entity in start.added])
        frame = frame_from_bytes(start.origin.tick, layout, start.values, start.outboxes)
    except Malformed as error:
        raise BadValue(f"the frame to begin with does not fit the deployment: {error}", start.origin.source) from None
    if frame.digest != start.origin.digest:
        raise BadValue("the frame to begin with has another digest in this deployment's layout", start.origin.source)
    return frame


def added_to(layout: Layout) -> list[AddedEntity]:
    """Return the entities of a layout beside the deployment's."""
    return [AddedEntity(name, model) for name, model in sorted(layout.models.items()) if layout.is_added(name)]


def first_chain(origin: Origin | None) -> bytes:
    """Return the chain over the frames up to the one that a run begins with."""
    return CHAIN_START if origin is None else origin.chain
