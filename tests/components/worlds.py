"""A small table and a small hall, and players that give random commands to any actuator."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from functools import cache
from math import inf
from pathlib import Path
from typing import Any, Final, NamedTuple

import yaml
from msgspec import Struct

from foosim.client.player import Player, Samples, Turn
from foosim.common.keyed_random import draw_key, draw_words
from foosim.deployment.schema import Deployment
from foosim.deployment.text.yaml import write_yaml
from foosim.world.component_types import registry
from foosim.world.component_types.descriptions import SAMPLES
from foosim.world.component_types.payloads import PayloadCodec
from foosim.world.components.fitted import actuators_of
from foosim.world.frame import Frame
from foosim.world.layout import build_layout

DEPLOY: Final = Path(__file__).parents[2] / "deploy"
Place = tuple[str | int, ...]
RODS: Final = ("red.goal", "red.attack", "blue.goal", "blue.attack")
ROVERS: Final = ("rover-1", "rover-2", "rover-3")
SCENE: Final = ("field", "floor", "walls", "goal", "ramps")
MOTIONS: Final = ("position", "joint_positions", "wheel_travel")
LINK: Final = {"id": "all", "from": "*", "to": "*", "delay": "2 ms", "loss": "10 %", "order": "fifo"}


class Driver(Player):
    """Gives each of its robots another command in each of its turns, drawn within a range and its actuator's limits."""

    def __init__(self, deployment: Deployment, parameters: Mapping[str, Any]) -> None:
        kind = registry.find_component("actuator", parameters["kind"])
        assert kind.value is not None
        self._value: type[Struct] = kind.value
        self._robots = parameters["robots"]
        fields = PayloadCodec(kind.value, kind.name).fields
        self._is_several = fields[-1].is_several
        bounds = parameters["bounds"]
        names = [fields[-1].name] * len(bounds) if self._is_several else [field.name for field in fields]
        layout = None if deployment.lacks_files else build_layout(deployment)  # players have no URDF files
        self._bounds: dict[str, list[float]] = {}
        for robot in self._robots:
            its = () if layout is None else actuators_of(deployment, layout, layout[robot])
            limits = next((found for one in its if (found := one.actuator.limits())), {})
            most = [max(map(abs, limits[name])) if name in limits else inf for name in names]
            self._bounds[robot] = list(map(min, bounds, most))
        self._has_jobs, self._in_time = kind.jobs, kind.name == "joint_trajectory"
        self._least = 0.0 if kind.name == "rotor_speeds" else -1.0

    def act(self, tick: int, samples: Samples) -> Turn:
        """Return commands for all, whatever was heard."""
        return Turn({robot: self._command(robot, tick) for robot in self._robots})

    def _command(self, robot: str, tick: int) -> Struct:
        words = draw_words(draw_key(3, "driver", robot), tick)
        more = draw_words(draw_key(4, "driver", robot), tick)
        shares = [self._least + (1.0 - self._least) * word / 2.0**64 for word in (*words, *more)]
        numbers = [bound * share for bound, share in zip(self._bounds[robot], shares, strict=False)]
        if self._in_time:
            return self._value((0.2, 0.5), (numbers, numbers[::-1]), 0.0 if tick % 3 == 2 else tick + 1.0)
        if self._has_jobs:
            numbers.append(0.0 if tick % 3 == 2 else tick + 1.0)
        return self._value(tuple(numbers)) if self._is_several else self._value(*numbers)


def driver(robots: Sequence[str], kind: str, bounds: Sequence[float], rate: str) -> dict[str, Any]:
    """Return the deployment's section of players with a driver of these robots."""
    parameters = {"robots": list(robots), "kind": kind, "bounds": list(bounds)}
    path = f"{Driver.__module__}:{Driver.__qualname__}"
    about = {"class": path, "rate": rate, "lockstep": True, "parameters": parameters}
    return {"driver": about | {"robots": {robot: [] for robot in robots}}}


@cache
def _table() -> dict[str, Any]:
    data: dict[str, Any] = yaml.safe_load((DEPLOY / "table.yaml").read_text())
    data["robots"] = {rod: {**data["robots"][rod], "sensors": {}} for rod in RODS} | {"camera": {"model": "camera"}}
    data["players"] = driver(RODS, "rod_position", (0.1, 20.0), "50 Hz")
    data["table"]["rules"] |= {"kickoff_delay": "20 ms", "kickoff_speed": "4 m/s"}
    return data | {"engine": "pure", "substeps": 1, "nodes": {"n": {"robots": ["*"]}}, "network": {"links": [LINK]}}


@cache
def _hall() -> dict[str, Any]:
    data = yaml.safe_load((DEPLOY / "warehouse.yaml").read_text())
    shelf = {"shape": "box", "x": "2 m", "y": "1 m", "z": "1 m", "length": "1 m", "width": "1 m", "height": "2 m"}
    places = {"rover-1": ("0 m", "0 m"), "rover-2": ("1.5 m", "-1 m"), "rover-3": ("-1 m", "1 m")}
    robots: dict[str, Any] = {
        rover: {"model": "rover", "x": x, "y": y, "heading": "30 deg", "charge": "50 %", "sensors": {}}
        for rover, (x, y) in places.items()
    }
    robots["station"] = {"model": "station", "x": "1 m", "y": "2 m", "sensors": {}}
    return {
        **{
            key: value
            for key, value in data.items()
            if key not in ("templates", "scenery", "network", "players", "clients")
        },
        "hall": data["hall"] | {"length": "8 m", "width": "6 m"},
        "robots": robots,
        "scenery": {"shelf": shelf},
        "players": driver(ROVERS, "wheel_speeds", (1.2, 1.2), "10 Hz"),
        "nodes": {"n": {"robots": ["*"]}},
        "network": {"links": [LINK]},
    }


def changed_slots(first: Frame, last: Frame) -> set[str]:
    """Return the slots that differ between two frames, each after its entity."""
    return {
        f"{entity.name} {slot}"
        for entity in first.layout.entities
        for slot, at in entity.offsets.items()
        if first.numbers[at : at + entity.counts[slot]] != last.numbers[at : at + entity.counts[slot]]
    }


def still(deployment: Deployment, frames: Sequence[Frame]) -> set[str]:
    """Return the robots and objects that do not move from a first frame to a last, and sensors that do not measure."""
    changed = changed_slots(frames[0], frames[-1])
    moving = {
        entity.name: {f"{entity.name} {slot}" for slot in MOTIONS if slot in entity.offsets}
        for entity in frames[0].layout.present(frames[0].numbers)
    }
    measuring = {
        f"{robot} {channel}": {f"{robot} {channel}.{SAMPLES}"}
        for robot, about in deployment.robots.items()
        for channel in about.sensors
    }
    return {name for name, slots in {**moving, **measuring}.items() if slots and not slots & changed}


class World(NamedTuple):
    """The plain data of a deployment, and the place of the component's settings in it; no place: it has none."""

    data: dict[str, Any]
    place: Place = ()

    def text(self, *changes: tuple[Place, Any]) -> str:
        """Return the deployment's text, with settings changed below the place of the component's."""
        return write_yaml(_with(self.data, [((*self.place, *path), value) for path, value in changes]))

    def with_(self, path: Place, value: Any, place: Place | None = None) -> World:
        """Return the world with a value at a path from its root, the place of the component's settings."""
        return World(_with(self.data, [(path, value)]), path if place is None else place)


def _with(data: dict[str, Any], changes: Sequence[tuple[Place, Any]]) -> dict[str, Any]:
    """Return a copy of plain data with other values at some paths."""
    copy: dict[str, Any] = json.loads(json.dumps(data))
    for (*way, last), value in changes:
        section: Any = copy
        for key in way:
            section = section.setdefault(key, {}) if isinstance(section, dict) else section[key]
        section[last] = json.loads(json.dumps(value))
    return copy


TABLE: Final = World(_table())
HALL: Final = World(_hall())


def scene(world: World, kind: str, settings: Mapping[str, Any]) -> World:
    """Return a world with a scene."""
    return world.with_(("scene",), {"kind": kind, **settings})
