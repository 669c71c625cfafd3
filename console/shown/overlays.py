"""Overlays of a world on request: contacts, and the rays of proximity sensors."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np

from foosim.deployment.schema import Deployment
from foosim.world.components.view import Mounting
from foosim.world.frame import Frame
from foosim.world.layout import Layout
from foosim.world.sensors.proximity import Proximity, ProximitySettings, ways_of


class Overlays:
    """Makes overlays of the frames of one layout."""

    def __init__(self, deployment: Deployment, layout: Layout) -> None:
        self._layout = layout
        self._groups: dict[int, list[Proximity]] = {}
        """Sensors by their number of rays."""
        self._ranges: dict[int, list[tuple[int, float, int]]] = {}
        """Of each of them: the slot of the rover's position, the range, the slot of the heading."""
        for name, robot in deployment.robots.items():
            for channel, settings in robot.sensors.items():
                if isinstance(settings, ProximitySettings):
                    self._add(deployment, name, channel, settings)

    def _add(self, deployment: Deployment, name: str, channel: str, settings: ProximitySettings) -> None:
        entity = self._layout[name]
        rover = deployment.hall.rover
        self._radius_m, self._height_m = rover.radius, rover.height
        sensor = Proximity(settings, Mounting(deployment, self._layout, entity, channel, b""))
        self._groups.setdefault(settings.rays, []).append(sensor)
        place = entity.offsets["position"], settings.range, entity.offsets["heading"]
        self._ranges.setdefault(settings.rays, []).append(place)

    def content(self, frame: Frame, wanted: Collection[str]) -> dict[str, Any]:
        """Return the content of the message `overlay` but for its source and generation."""
        return {
            "type": "overlay",
            "tick": frame.tick,
            "contacts": self._contacts(frame) if "contacts" in wanted else [],
            "rays": self._rays(frame) if "rays" in wanted else [],
        }

    def _contacts(self, frame: Frame) -> list[tuple[float, ...]]:
        """Return where free bodies touched something in the tick, and the impulse (N s); a rod's are its ball's."""
        found = []
        for ball in self._layout.balls:
            count, impulse = frame.vector(ball.name, "contacts", 2)
            if count > 0.0:
                found.append((*frame.vector(ball.name, "position", 3), impulse))
        return found

    def _rays(self, frame: Frame) -> list[list[float]]:
        """Return both ends of each ray: from a rover's hull to what it meets, or as far as the sensor reaches."""
        found: list[list[float]] = []
        for rays, sensors in self._groups.items():
            ways = ways_of(sensors, frame.numbers)
            turns = 2.0 * np.pi * np.arange(rays) / rays
            for row, (place, range_m, heading) in enumerate(self._ranges[rays]):
                x, y, z = frame.numbers[place : place + 3]
                angles = frame.numbers[heading] + turns
                ends = np.clip(ways[row], self._radius_m, self._radius_m + range_m)
                east, north, height = np.cos(angles), np.sin(angles), np.full(rays, z + self._height_m / 2)
                radius = self._radius_m
                lines = [x + radius * east, y + radius * north, height, x + ends * east, y + ends * north, height]
                found += np.round(np.stack(lines, axis=1), 4).tolist()
        return found
