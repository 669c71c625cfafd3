"""Deployments in which all that another one has is as it is there: in another order, with a robot or sensors more."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Final

from foosim.deployment.loader import expanded_text, load_deployment
from foosim.deployment.text.yaml import locate_in, plain, read_tree, write_yaml
from foosim.world.component_types.registry import model
from foosim.world.component_types.settings import RobotSettings
from foosim.world.components.base import Model
from foosim.world.layout import build_layout

COMING_MAX: Final = 64
"""Entities that leave and come back in a check."""


class BystanderRobot(RobotSettings):
    """A robot that does nothing."""


@model("bystander", BystanderRobot, slots={"down": 1, "refused": 1}, has_body=False)
class Bystander(Model):
    """A robot without a body, for the check of components."""


def changed(text: str, name: str) -> Iterator[tuple[str, str]]:
    """Yield deployments in which all that this one has is as it is here, and in words how they differ."""
    tree, _ = read_tree(expanded_text(text, name), locate_in(name))
    assert tree is not None, "checked"
    data: Any = {**plain(tree), "nodes": {"n1": {"robots": ["*"]}}}
    players = {key: data[key] for key in ("players",) if key in data}  # what these make of an order is their affair
    yield "named in another order,", write_yaml({**_reversed(data), **players})
    robots = data["robots"]
    path = f"{Bystander.__module__}:{Bystander.__qualname__}"
    beside = {**robots, _first_of_all(robots): {"model": path, "sensors": {}}}
    yield "beside a robot that does nothing and comes first", write_yaml({**data, "robots": beside})
    twice = {robot: about | {"sensors": _twice(about.get("sensors") or {})} for robot, about in robots.items()}
    if any(about["sensors"] for about in twice.values()):
        yield "beside a second one of each sensor", write_yaml({**data, "robots": twice})


def with_comings(text: str, name: str, ticks: int, files: Mapping[str, bytes]) -> str | None:
    """Return the deployment with events that remove what can leave, one after the other, and add it again; None where
    nothing can. `files` are the contents of the files that it names, by path."""
    deployment = load_deployment(text, name).with_assets(files)
    layout = build_layout(deployment)
    leaving = [entity.name for entity in layout.entities if entity.can_leave][:COMING_MAX]
    tree, _ = read_tree(expanded_text(text, name), locate_in(name))
    assert tree is not None, "checked"
    data: Any = plain(tree)
    events = []
    for number, entity in enumerate(leaving):
        gone = 1 + ticks // 4 + number % max(1, ticks // 4)
        for tick, verb in ((gone, "remove"), (gone + 1 + ticks // 4, "add")):
            at = f"{tick * deployment.tick_ns / 1e6:.4f} ms"
            events.append({"at": at, "entity": entity, verb: True})
    return write_yaml({**data, "events": [*data.get("events", []), *events]}) if events else None


def _reversed(data: Any) -> Any:
    if isinstance(data, dict):
        return {key: _reversed(value) for key, value in reversed(data.items())}
    return [_reversed(value) for value in data] if isinstance(data, list) else data


def _twice(sensors: dict[str, Any]) -> dict[str, Any]:
    found = dict(sensors)
    for channel, settings in sensors.items():
        found[_first_of_all(found)] = {"kind": channel, **settings}
    return found


def _first_of_all(names: dict[str, Any]) -> str:
    """Return a free name that comes before nearly all others."""
    return next(name for name in ("a", *(f"a-{number}" for number in range(len(names)))) if name not in names)
