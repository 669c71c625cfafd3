"""Worlds with grippers: cranes of two slides, a column and a boom that ends in a hand, and crates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from tempfile import mkdtemp
from typing import Any, Final

import yaml

from foosim.client.player import Player, Samples
from foosim.deployment.schema import Deployment

NAME: Final = "cranes.yaml"
SIDE_M: Final = 0.2
FRONT_M: Final = 0.23
"""How far the front of the hand is from the axis of the column at a boom of 0."""
LIFT_M: Final = 0.1
"""The height of the middle of the hand at a column of 0."""
CRANE: Final = """<robot name="crane">
  <link name="base"><inertial><mass value="50"/><inertia ixx="1" iyy="1" izz="1"/></inertial></link>
  <link name="carriage">
    <inertial><mass value="5"/><inertia ixx="0.1" iyy="0.1" izz="0.1"/></inertial>
    <collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision>
  </link>
  <link name="hand">
    <inertial><origin xyz="0.2 0 0"/><mass value="2"/><inertia ixx="0.01" iyy="0.01" izz="0.01"/></inertial>
    <collision><origin xyz="0.2 0 0"/><geometry><box size="0.06 0.1 0.1"/></geometry></collision>
  </link>
  <link name="grip"/>
  <joint name="column" type="prismatic">
    <parent link="base"/><child link="carriage"/><origin xyz="0 0 0.1"/><axis xyz="0 0 1"/>
    <limit lower="0" upper="1.2" effort="600" velocity="1"/>
  </joint>
  <joint name="boom" type="prismatic">
    <parent link="carriage"/><child link="hand"/><axis xyz="1 0 0"/>
    <limit lower="0" upper="1.2" effort="300" velocity="1"/>
  </joint>
  <joint name="front" type="fixed"><parent link="hand"/><child link="grip"/><origin xyz="0.23 0 0"/></joint>
</robot>
"""
WHEELS: Final = ("front-left", "front-right", "rear-left", "rear-right")
_WHEEL: Final = """
  <link name="{name}">
    <inertial><mass value="1"/><inertia ixx="0.002" iyy="0.0032" izz="0.002"/></inertial>
    <collision><origin rpy="1.5707963 0 0"/><geometry><cylinder radius="0.08" length="0.03"/></geometry></collision>
  </link>
  <joint name="axle-{name}" type="continuous">
    <parent link="hull"/><child link="{name}"/><origin xyz="{x} {y} -0.07"/><axis xyz="0 1 0"/>
    <limit effort="10" velocity="20"/>
  </joint>"""
PORTER: Final = f"""<robot name="porter">
  <link name="hull">
    <inertial><mass value="30"/><inertia ixx="0.3" iyy="0.5" izz="0.7"/></inertial>
    <collision><geometry><box size="0.5 0.3 0.1"/></geometry></collision>
  </link>
  {"".join([_WHEEL.format(name=name, x=x, y=y) for name, x, y in zip(
      WHEELS, (0.2, 0.2, -0.2, -0.2), (0.18, -0.18, 0.18, -0.18), strict=True)])}
  <link name="fork">
    <inertial><mass value="2"/><inertia ixx="0.01" iyy="0.01" izz="0.01"/></inertial>
    <collision><geometry><box size="0.04 0.1 0.1"/></geometry></collision>
  </link>
  <joint name="lift" type="prismatic">
    <parent link="hull"/><child link="fork"/><origin xyz="0.3 0 0"/><axis xyz="0 0 1"/>
    <limit lower="0" upper="0.5" effort="200" velocity="0.5"/>
  </joint>
</robot>
"""  # fmt: skip
HULL_M: Final = 0.15
"""The height of the middle of its hull."""
Step = tuple[int, str, str, Sequence[float]]
"""From which tick on, whom, which actuator, and what it is told."""


class Script(Player):
    """Tells robots what its parameter `steps` says, once at each tick that it names."""

    def __init__(self, deployment: Deployment, parameters: Mapping[str, Any]) -> None:
        self._steps: list[Step] = [tuple(step) for step in parameters["steps"]]

    def act(self, tick: int, samples: Samples) -> dict[str, Any]:
        """Return the commands of a tick."""
        found: dict[str, dict[str, Any]] = {}
        for at, robot, actuator, values in self._steps:
            if at == tick:
                found.setdefault(robot, {})[actuator] = tuple(values)
        return found


@cache
def folder() -> Path:
    """Return a folder with the URDF files of a crane and a porter in its folder `models`."""
    made = Path(mkdtemp())
    (made / "models").mkdir()
    (made / "models" / "crane.urdf").write_text(CRANE)
    (made / "models" / "porter.urdf").write_text(PORTER)
    return made


def crane(x: float, *, y: float = 0.0, yaw_deg: float = 0.0, **gripper: Any) -> dict[str, Any]:
    """Return a crane on the floor whose boom points along x, turned by an angle."""
    return {
        "model": "urdf",
        "file": "crane.urdf",
        "fixed": True,
        "at": {"x": f"{x} m", "y": f"{y} m", "yaw": f"{yaw_deg} deg"},
        "actuators": {
            "gripper": {"kind": "gripper", "at": {"link": "grip"}, "reach": "3 cm", **gripper},
            "joints": {"kind": "joint_position", "gain": "5 Hz"},
        },
        "sensors": {
            "grip": {"kind": "gripper_state", "rate": "50 Hz"},
            "state": {"kind": "joint_state", "rate": "50 Hz"},
        },
    }


def porter(x: float, **more: Any) -> dict[str, Any]:
    """Return a robot on four wheels whose fork, 32 cm ahead of its middle, lifts what its gripper holds."""
    return {
        "model": "urdf",
        "file": "porter.urdf",
        "fixed": False,
        "speed_limit": "4 m/s",
        "at": {"x": f"{x} m", "z": f"{HULL_M} m"},
        "actuators": {
            "gripper": {"kind": "gripper", "at": {"link": "fork", "x": "2 cm"}, "reach": "3 cm"},
            "lift": {"kind": "joint_position", "joints": ["fork"], "gain": "5 Hz"},
            "wheels": {"kind": "joint_velocity", "joints": list(WHEELS)},
        },
        "sensors": {"grip": {"kind": "gripper_state", "rate": "50 Hz"}},
        **more,
    }


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
    whole = {
        "format": 2,
        "world": "cranes",
        "seed": 1,
        "tick": "10 ms",
        "substeps": 4,
        "engine": "mujoco",
        "pace": "fast",
        "assets": "models",
        "scene": {"kind": "empty"},
        "surfaces": {"floor": {"friction": 0.7}},
        "objects": dict(objects),
        "robots": dict(robots),
        "players": {"script": script},
        "nodes": {"n": {"robots": ["*"]}},
        "network": {"links": [{"id": "all", "from": "*", "to": "*", "delay": "3 ms", "order": "fifo"}]},
        **more,
    }
    return yaml.safe_dump(json_of(whole), sort_keys=False)


def json_of(data: Any) -> Any:
    """Return plain data without anchors: equal values are written each time."""
    if isinstance(data, Mapping):
        return {key: json_of(value) for key, value in data.items()}
    return [json_of(one) for one in data] if isinstance(data, list | tuple) else data
