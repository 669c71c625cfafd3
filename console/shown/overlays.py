"""Overlays of a world on request: contacts, and the rays of sensors that send some."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any

import numpy as np

from foosim.deployment.schema import Deployment
from foosim.world.component_types.descriptions import overrides
from foosim.world.component_types.failures import ContractError
from foosim.world.components.fitted import BoundSensor, sensors_of
from foosim.world.components.view import ComponentError, called
from foosim.world.frame import Frame
from foosim.world.layout import Entity, Layout


class Overlays:
    """Makes overlays of the frames of one deployment."""

    def __init__(self, deployment: Deployment, layout: Layout) -> None:
        self._layout = layout
        self._groups: dict[tuple[Any, int], list[BoundSensor]] = {}
        """Sensors that send rays, by their class and the length of their readings."""
        self._failures: list[str] = []
        for robot in layout.robots:
            sensors = deployment.robots[robot.name].sensors.values()
            if any(overrides(its.component_type.factory, "rays") for its in sensors):
                for fitted in self._sensors_of(deployment, layout, robot):
                    if overrides(type(fitted.sensor), "rays"):
                        self._groups.setdefault((type(fitted.sensor), fitted.size), []).append(fitted)

    def content(self, frame: Frame, wanted: Collection[str]) -> dict[str, Any]:
        """Return the content of the message `overlay` but for its source and generation."""
        return {
            "type": "overlay",
            "tick": frame.tick,
            "contacts": self._contacts(frame) if "contacts" in wanted else [],
            "rays": self._rays(frame) if "rays" in wanted else [],
        }

    def failures(self) -> list[str]:
        """Return which sensors have no rays from here on, and why; each once."""
        found, self._failures = self._failures, []
        return found

    def _sensors_of(self, deployment: Deployment, layout: Layout, robot: Entity) -> Sequence[BoundSensor]:
        try:
            return sensors_of(deployment, layout, robot)
        except ComponentError as error:
            self._failures.append(str(error))
            return ()

    def _contacts(self, frame: Frame) -> list[tuple[float, ...]]:
        """Return where free bodies touched something in the tick, and the impulse (N s)."""
        found = []
        for body in self._layout.free:
            count, impulse = frame.vector(body.name, "contacts", 2)
            if count > 0.0:
                found.append((*frame.vector(body.name, "position", 3), impulse))
        return found

    def _rays(self, frame: Frame) -> list[list[float]]:
        """Return both ends of each ray (m)."""
        found: list[list[float]] = []
        for sensors in self._groups.values():
            try:
                found += _rays_of(sensors, frame)
            except ComponentError:
                found += self._rays_of_each(sensors, frame)
        return found

    def _rays_of_each(self, sensors: list[BoundSensor], frame: Frame) -> list[list[float]]:
        """Return the rays of sensors that have some; the others are left out from here on."""
        found: list[list[float]] = []
        for fitted in [*sensors]:
            try:
                found += _rays_of([fitted], frame)
            except ComponentError as error:
                sensors.remove(fitted)
                self._failures.append(str(error))
        return found


def _rays_of(sensors: Sequence[BoundSensor], frame: Frame) -> list[list[float]]:
    """Return both ends of each ray (m); absent robots send none. Raises ComponentError, of the first of several."""
    sensors = [fitted for fitted in sensors if not frame.layout[fitted.robot].is_absent(frame.numbers)]
    if not sensors:
        return []
    first = sensors[0]
    return called(f"rays of sensor {first.channel}", first.robot, frame.tick, _drawn, sensors, frame.numbers)


def _drawn(sensors: Sequence[BoundSensor], numbers: list[float]) -> list[list[float]]:
    rays = type(sensors[0].sensor).rays
    given = rays([fitted.sensor for fitted in sensors], numbers)
    is_fit = isinstance(given, np.ndarray) and given.dtype.kind == "f" and given.ndim == 2 and given.shape[1] == 6
    if not (is_fit and np.isfinite(given).all()):
        raise ContractError(rays, "an array of finite numbers of shape (rays, 6)", given)
    ends: list[list[float]] = np.round(given, 4).tolist()
    return ends
