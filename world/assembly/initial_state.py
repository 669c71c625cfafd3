"""The start of a run: the world at tick 0, or a frame of another run.

Tick 0 is a pure function of the deployment. A run that begins with a frame of another one keeps that
frame's tick and the chain up to it, so that equal inputs give equal digests.
"""

from __future__ import annotations

import numpy as np

from foosim.common.errors import BadValue, Malformed
from foosim.world.assembly.world import initial_numbers
from foosim.world.frame import CHAIN_START, Frame, frame_from_bytes
from foosim.world.layout import build_layout
from foosim.world.spec import WorldSpec
from foosim.world.start import Origin, Start


def initial_frame(spec: WorldSpec) -> Frame:
    """Return frame 0."""
    layout = build_layout(spec)
    return Frame(0, layout, np.array(initial_numbers(spec, layout)))


def start_with(frame: Frame, source: str, chain: bytes) -> Start:
    """Return the start with a frame of `source`; `chain` is over all frames up to it."""
    origin = Origin(frame.tick, source, frame.digest, chain)
    return Start(origin, frame.values.tobytes(), frame.outbox_items)


def first_frame(spec: WorldSpec, start: Start | None) -> Frame:
    """Return the frame that a run begins with.

    Raises BadValue for a start whose frame does not fit the deployment.
    """
    if start is None:
        return initial_frame(spec)
    try:
        frame = frame_from_bytes(start.origin.tick, build_layout(spec), start.values, start.outboxes)
    except Malformed as error:
        raise BadValue(f"the frame to begin with does not fit the deployment: {error}", start.origin.source) from None
    if frame.digest != start.origin.digest:
        raise BadValue("the frame to begin with has another digest in this deployment's layout", start.origin.source)
    return frame


def first_chain(origin: Origin | None) -> bytes:
    """Return the chain over the frames up to the one that a run begins with."""
    return CHAIN_START if origin is None else origin.chain
