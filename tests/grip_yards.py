"""Worlds with grippers: the cranes and the porter of the workshop, and crates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import yaml

from foosim.client.player import Player, Samples
from foosim.deployment.schema import Deployment
from foosim.library.rigid.gripper import Grip
from foosim.library.rigid.players.workshop import HAND_M as FRONT_M
from tests.components.worlds import DEPLOY

__all__ = ["FRONT_M"]
NAME: Final = "cranes.yaml"
SIDE_M: Final = 0.2
LIFT_M: Final = 0.1
"""The height of the middle of the hand at a column of 0."""
TEMPLATES: Final = yaml.safe_load((DEPLOY / "workshop.yaml").read_text())["templates"]
Step = tuple[int, str, str, Sequence[float]]
"""From which tick on, whom, which actuator, and what it is told."""


class _Plain(yaml.SafeDumper):
    """Writes equal values each time: a deployment has no anchors."""

    def ignore_aliases(self, data: Any) -> bool:
        return True


def solids_text(**sections: Any) -> str:
    """Return a deployment of rigid bodies in an empty yard, on a node."""
    whole = {
        "format": 2,
        "world": "solids",
        "seed": 1,
        "tick": "10 ms",
        "substeps": 4,
        "engine": "mujoco",
        "pace": "fast",
        "assets": "models",
        "scene": {"kind": "empty"},
        "nodes": {"n": {"robots": ["*"]}},
        "network": {"links": [{"id": "all", "from": "*", "to": "*", "delay": "3 ms", "order": "fifo"}]},
        **sections,
    }
    return yaml.dump(whole, Dumper=_Plain, sort_keys=False)


class Script(Player):
    """Tells robots what its parameter `steps` says, once at each tick that it names."""

    def __init__(self, deployment: Deployment, parameters: Mapping[str, Any]) -> None:
        self._steps: list[Step] = [tuple(step) for step in parameters["steps"]]

    def act(self, tick: int, samples: Samples) -> dict[str, Any]:
        """Return the commands of a tick."""
        found: dict[str, dict[str, Any]] = {}
        for at, robot, actuator, values in self._steps:
            if at == tick:
                found.setdefault(robot, {})[actuator] = Grip(*values) if actuator == "gripper" else tuple(values)
        return found


def crane(x: float, *, y: float = 0.0, yaw_deg: float = 0.0, **gripper: Any) -> dict[str, Any]:
    """Return a crane on the floor whose boom points along x, turned by an angle."""
    its = TEMPLATES["crane"]
    actuators = {**its["actuators"], "gripper": {**its["actuators"]["gripper"], **gripper}}
    sensors = {**its["sensors"], "grip": {"kind": "gripper_state", "rate": "50 Hz"}}
    at = {"x": f"{x} m", "y": f"{y} m", "yaw": f"{yaw_deg} deg"}
    return {**its, "at": at, "actuators": actuators, "sensors": sensors}


def porter(x: float, **more: Any) -> dict[str, Any]:
    """Return a robot on four wheels whose fork, 32 cm ahead of its middle, lifts what its gripper holds."""
    return {**TEMPLATES["porter"], "at": {"x": f"{x} m", "z": "15 cm"}, **more}


def crate(x: float, *, y: float = 0.0, z: float = SIDE_M / 2, mass: float = 4.0, **more: Any) -> dict[str, Any]:
    """Return a crate whose middle is there."""
    at = {"x": f"{x} m", "y": f"{y} m", "z": f"{z} m"}
    return {"model": "box", "size": [f"{SIDE_M} m"] * 3, "mass": f"{mass} kg", "speed_limit": "4 m/s", "at": at, **more}


def world(robots: Mapping[str, Any], objects: Mapping[str, Any], steps: Sequence[Step] = (), **more: Any) -> str:
    """Return a deployment; its player tells robots what steps say."""
    script = {
        "class": f"{Script.__module__}:Script",
        "rate": "100 Hz",
        "lockstep": True,
        "robots": {name: list(robot.get("sensors", ())) for name, robot in robots.items() if robot.get("actuators")},
        "parameters": {"steps": [list(step) for step in steps]},
    }
    surfaces = {"floor": {"friction": 0.7}}
    return solids_text(
        surfaces=surfaces, objects=dict(objects), robots=dict(robots), players={"script": script}, **more
    )
