"""deploy/table_sensors.yaml: all sensors of the table, which change nothing of each other and nothing of the world."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

from foosim.deployment.loader import load_deployment
from foosim.simulation.run import rehearse
from foosim.simulation.system import Settings
from tests.frames import broken_laws

PATH: Final = Path(__file__).parents[2] / "deploy" / "table_sensors.yaml"
TEXT: Final = PATH.read_text()
KINDS: Final = {"ball", "ball_state", "encoder", "figure_contact", "joint_state", "motor_current"}
FURTHER: Final = {"camera": ("exact", "tracked", "late")}
"""What nobody hears, beside that of rods."""
BODIES: Final = ("joint_positions", "joint_velocities", "contacts", "position", "linear_velocity", "angular_velocity")


def test_it_has_all_of_them() -> None:
    robots = load_deployment(TEXT, PATH.name).robots
    kinds = {name: {sensor.kind for sensor in robot.sensors.values()} for name, robot in robots.items()}
    assert {kind for its in kinds.values() for kind in its} == KINDS
    assert len({tuple(sorted(its)) for name, its in kinds.items() if name != "camera"}) == 1


def test_it_obeys_the_laws() -> None:
    assert list(broken_laws(TEXT, PATH.name, 60)) == []


def test_sensors_change_nothing_of_the_world() -> None:
    """Bodies go the same way without them, all but what players hear taken away."""
    robots = load_deployment(TEXT, PATH.name).robots
    further = {name: FURTHER.get(name, ("state", "counts", "current", "touch")) for name in robots}
    bare = [f"robots.{name}.sensors.{its}=null" for name, channels in further.items() for its in channels]
    seen: list[list[list[float]]] = []
    for sets in ([], bare):
        frames: list[list[float]] = []

        def keep(frame: Any, frames: list[list[float]] = frames) -> None:
            frames.append(
                [
                    number
                    for entity in frame.layout.entities
                    for field in BODIES
                    if field in entity.offsets
                    for number in frame.vector(entity.name, field, entity.counts[field])
                ]
            )

        result = rehearse(TEXT, PATH.name, 300, 1, ["engine=pure", *sets], Settings(on_commit=keep))
        assert not result.json["failed"], result.json["reason"]
        seen.append(frames)
    assert seen[0] == seen[1] and seen[0][0] != seen[0][-1]
