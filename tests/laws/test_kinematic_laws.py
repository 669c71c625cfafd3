"""Law 1 for robots of all kinds that move by kinematics, among boxes: any number of nodes, any moves, one world."""

from __future__ import annotations

from typing import Any, Final

from foosim.simulation.run import rehearse
from foosim.simulation.system import Settings
from foosim.world.frame import Frame
from tests.forms.worlds import driver
from tests.frames import broken_laws
from tests.kinematic_yard import yard_text

TICKS: Final = 150
NAME: Final = "yard.yaml"
DRIVES, BASES, CRAFT, MOVERS = (tuple(f"{kind}{n}" for n in range(3)) for kind in ("drive", "base", "craft", "mover"))


def deployment() -> str:
    """Twelve robots with little room: three of each kind."""
    robots: dict[str, Any] = {}
    for n in range(3):
        at = {"x": f"{n - 1} m"}
        robots[f"drive{n}"] = {"model": "differential_drive", "at": at, "slip": "3 %"}
        robots[f"base{n}"] = {"model": "holonomic", "at": at | {"y": "1 m"}}
        robots[f"craft{n}"] = {"model": "rotorcraft", "at": at | {"y": "-1 m"}}
        path = [at | {"y": "2 m"}, at | {"y": "-2 m"}]
        robots[f"mover{n}"] = {"model": "mover", "shape": "sphere", "radius": "15 cm", "path": path, "speed": "1 m/s"}
    sensors = {"velocity": {"kind": "velocity", "rate": "20 Hz"}, "pose": {"kind": "pose", "rate": "50 Hz"}}
    boxes = {
        f"b{n}": {"at": {"x": f"{n - 1.5} m", "y": "500 mm"}, "length": "10 cm", "width": "30 cm", "height": "50 cm"}
        for n in range(4)
    }
    players = {
        **driver(DRIVES, "v_w", (0.9, 3.0), "10 Hz"),
        "bases": driver(BASES, "x_y_w", (0.7, 0.7, 3.0), "10 Hz")["driver"],
        "flight": driver(CRAFT, "waypoint", (2.0, 2.0, 0.0, 3.0), "5 Hz")["driver"],
    }
    return yard_text(
        {name: {**robot, "sensors": sensors} for name, robot in robots.items()},
        scene={"kind": "boxes", "boxes": boxes},
        rules={"middle": {"kind": "zone", "shape": "circle", "radius": "1 m", "tag": "vehicle"}},
        players=players,
    )


def test_nodes_and_moves_change_nothing() -> None:
    assert list(broken_laws(deployment(), NAME, TICKS)) == []


def test_all_of_them_move_and_meet() -> None:
    frames: list[Frame] = []
    assert not rehearse(deployment(), NAME, TICKS, 2, settings=Settings(on_commit=frames.append)).json["failed"]
    first, last = frames[0], frames[-1]
    for name in (*DRIVES, *BASES, *CRAFT, *MOVERS):
        assert first.vector(name, "position", 3) != last.vector(name, "position", 3), name
    blocked = {name for frame in frames for name in (*DRIVES, *BASES, *CRAFT, *MOVERS) if frame.at(name, "blocked")}
    assert len(blocked) >= 6, "and they stop one another"
