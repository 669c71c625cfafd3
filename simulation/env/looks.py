"""The pictures that an agent of an environment observes."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from foosim.client.vectors import Pair, chosen
from foosim.common.errors import Malformed, UnknownName
from foosim.rendering.pictures import Pictures, PictureShape
from foosim.simulation.agents import Agent

Observation = Any
"""The vector of an agent's readings; with pictures a mapping of `readings` to it and of their names to the pictures."""
READINGS: Final = "readings"


class Looks:
    """The pictures of some cameras that an agent hears, by `robot/channel.image`, `.depth` or `.segmentation`."""

    def __init__(self, agent: Agent, globs: Sequence[str]) -> None:
        """`globs` select cameras by `robot/channel`; raises UnknownName for one that selects none."""
        drawn = {pair: codec.drawn_by for pair, (codec, _) in agent.channels.items() if codec is not None}
        cameras = {pair: its for pair, its in drawn.items() if isinstance(its, Pictures)}
        if globs and not cameras:
            raise UnknownName(f"{agent.name} hears no camera", globs[0], ())
        self.shapes: dict[str, PictureShape] = {}
        self._agent = agent
        self._pairs: list[tuple[str, Pair, str]] = []
        for pair in chosen([*cameras], globs):
            for kind, shape in cameras[pair].shapes().items():
                name = f"{pair[0]}/{pair[1]}.{kind}"
                self.shapes[name] = shape
                self._pairs.append((name, pair, kind))

    def with_readings(self, readings: NDArray[np.float64]) -> Observation:
        """Return the observation: the newest pictures, all zeros before the first one and of one that the network has
        changed."""
        if not self.shapes:
            return readings
        found: dict[str, NDArray[Any]] = {READINGS: readings}
        for name, pair, kind in self._pairs:
            packet, codec = self._agent.newest.get(pair), self._agent.channels[pair].codec
            assert codec is not None
            size, form, _ = self.shapes[name]
            found[name] = np.zeros(size, form)
            if packet is not None:
                with suppress(Malformed):
                    found[name][...] = codec.decode(packet.payload).picture(kind)
        return found
