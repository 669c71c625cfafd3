"""Overlays of a world on request: contacts, and the rays of sensors that send some."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np

from foosim.deployment.schema import Deployment
from foosim.world.components.fitted import sensors_of
from foosim.world.forms import registry
from foosim.world.frame import Frame
from foosim.world.layout import Layout


class Overlays:
    """Makes overlays of the frames of one layout."""

    def __init__(self, deployment: Deployment, layout: Layout) -> None:
        self._layout = layout
        self._groups: dict[tuple[Any, int], list[Any]] = {}
        """Sensors that send rays, by their class and the length of their readings."""
        for robot in layout.robots:
            kinds = {sensor.kind for sensor in deployment.robots[robot.name].sensors.values()}
            if any(hasattr(registry.find_component("sensor", kind).made, "rays") for kind in kinds):
                for fitted in sensors_of(deployment, layout, robot):
                    if hasattr(fitted.sensor, "rays"):
                        self._groups.setdefault((type(fitted.sensor), fitted.size), []).append(fitted.sensor)

    def content(self, frame: Frame, wanted: Collection[str]) -> dict[str, Any]:
        """Return the content of the message `overlay` but for its source and generation."""
        return {
            "type": "overlay",
            "tick": frame.tick,
            "contacts": self._contacts(frame) if "contacts" in wanted else [],
            "rays": self._rays(frame) if "rays" in wanted else [],
        }

    def _contacts(self, frame: Frame) -> list[tuple[float, ...]]:
        """Return where free bodies touched something in the tick, and the impulse (N s): what is rigid meets those."""
        found = []
        for body in self._layout.free:
            count, impulse = frame.vector(body.name, "contacts", 2)
            if count > 0.0:
                found.append((*frame.vector(body.name, "position", 3), impulse))
        return found

    def _rays(self, frame: Frame) -> list[list[float]]:
        """Return both ends of each ray (m)."""
        found: list[list[float]] = []
        for (kind, _), sensors in self._groups.items():
            found += np.round(kind.rays(sensors, frame.numbers), 4).tolist()
        return found
