"""Worlds of rigid bodies whose islands go from owner to owner: a box that is pushed past three arms, with a base that
drives between them, and a stack that stands and is then pushed over."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, Final

import yaml

from foosim.simulation.check.component_check import _shuffle as shuffle
from foosim.simulation.run import Rehearsed, rehearse
from foosim.simulation.system import Settings, System
from foosim.world.frame import Frame
from tests.forms.worlds import DEPLOY, driver

NAME: Final = "solids.yaml"
ARMS: Final = ("arm-a", "arm-b", "arm-c")
ARMS_X_M: Final = (0.0, 2.6, 5.2)
"""An arm reaches 1.2 m: no two reach each other."""
SIDE_M: Final = 0.2
STACK: Final = tuple(f"box-{number:02d}" for number in range(10))
BOX: Final = {"model": "box", "size": [f"{SIDE_M} m"] * 3, "mass": "1 kg", "speed_limit": "6 m/s"}

Push = tuple[int, str, tuple[float, float, float]]
"""At which tick, whom, and by which impulse (N s)."""


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


def three_arms() -> str:
    """Three arms that wave, a box and a ram behind it, a crate beside each arm, and a base that drives between two."""
    arm = {"model": "urdf", "file": "arm.urdf", "fixed": True, "actuators": {"joints": {"kind": "joint_position"}}}
    robots: dict[str, Any] = {name: {**arm, "at": {"x": f"{x} m"}} for name, x in zip(ARMS, ARMS_X_M, strict=True)}
    robots["base"] = {"model": "holonomic", "at": {"x": "3.9 m", "y": "-50 cm"}}
    crates = {"at": {"x": "25 cm", "y": "-20 cm", "z": "1.3 m"}, "count": 3, "spacing": {"x": "2.6 m"}}
    fallen = {"at": {"x": "3.9 m", "y": "-45 cm", "z": "60 cm"}}
    return solids_text(
        surfaces={"floor": {"friction": 0.05, "restitution": 0.1}},
        objects={
            "box": {**BOX, "at": {"x": "-1.6 m", "y": "60 cm", "z": "10 cm"}},
            "ram": {**BOX, "mass": "5 kg", "at": {"x": "-1.85 m", "y": "60 cm", "z": "10 cm"}},
            "crate": {**BOX, **crates},
            "fallen": {**BOX, **fallen},
        },
        robots=robots,
        players={
            **driver(ARMS, "joint_position", (2.5, 1.8, 2.5, 2.0, 2.5, 1.5, 2.5), "5 Hz"),
            "drive": driver(("base",), "x_y_w", (0.0, 0.6, 1.0), "5 Hz")["driver"],
        },
    )


PUSHED: Final[tuple[Push, ...]] = (
    (5, "ram", (20.0, 0.0, 0.0)),
    (60, "ram", (5.0, 0.0, 0.0)),
    (90, "ram", (5.0, 0.0, 0.0)),
    (120, "ram", (5.0, 0.0, 0.0)),
    (135, "ram", (0.6, 0.0, 0.0)),
    (150, "ram", (0.6, 0.0, 0.0)),
    (165, "ram", (0.6, 0.0, 0.0)),
    (180, "ram", (0.6, 0.0, 0.0)),
)
"""The ram is thrown at the box, and pushes it on."""


def stack() -> str:
    """Ten boxes on one another, nearly upright, between two quadrotors on the floor."""
    objects = {
        name: {**BOX, "at": {"x": f"{(-1) ** n * 2} mm", "y": f"{n % 3} mm", "z": f"{SIDE_M * (n + 0.5)} m"}}
        for n, name in enumerate(STACK)
    }
    quad = {"model": "quadrotor"}
    robots: dict[str, Any] = {
        f"quad-{n}": {**quad, "at": {"x": "1 m", "y": f"{80 * (n - 1)} cm", "z": "50 mm"}} for n in range(3)
    }
    return solids_text(objects=objects, robots=robots)


def run(
    text: str,
    ticks: int,
    nodes: int,
    pushes: Sequence[Push] = (),
    *,
    on_commit: Callable[[Frame], None] | None = None,
    is_shuffled: bool = False,
) -> Rehearsed:
    """Rehearse a world on some nodes, with pushes at their ticks.

    `is_shuffled`: robots are moved between nodes, and all objects of nodes are made anew, at drawn ticks.
    """

    def prepare(system: System) -> None:
        for tick, name, impulse in pushes:
            system.at_tick(tick, partial(system.request, "push", name=name, impulse=list(impulse)))
        if is_shuffled:
            shuffle(system, seed=1, ticks=ticks)

    settings = Settings(on_commit=on_commit)
    found = rehearse(text, NAME, ticks, nodes, settings=settings, prepare=prepare, folder=DEPLOY)
    assert not found.json["failed"] and found.json["ticks"] == ticks, found.json["reason"]
    return found
