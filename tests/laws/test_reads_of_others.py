"""What a component reads of another entity is that of the start of the tick, whichever nodes compute the two.

Law 1 for components that read others in every part of a tick, and that a name that is free again is another entity's.
"""

from __future__ import annotations

import sys
from importlib import invalidate_caches
from pathlib import Path
from typing import Any, Final

import numpy as np
import pytest

from foosim.deployment.loader import load_deployment
from foosim.node.edited_frame import edit
from foosim.simulation.run import rehearse
from foosim.simulation.system import Settings
from foosim.world.assembly.initial_state import initial_frame
from foosim.world.component_types.descriptions import NO_ENTITY
from foosim.world.edits import Remove
from foosim.world.frame import Frame
from tests.components.worlds import HALL, TABLE, World, driver
from tests.frames import Frames, broken_laws
from tests.placing import added_ball

NAME: Final = "others.yaml"
READERS: Final = """
from foosim.library.mobile.wheel_speeds import Drive, DriveActuator
from msgspec import Struct
from foosim.world.components.surroundings import Surroundings
from foosim.world.component_types.quantities import Metres
from foosim.world.components.base import EntityRule, Sensor, need, slot
from foosim.world.component_types.registry import actuator, rule, sensor
from foosim.world.component_types.settings import ActuatorSettings, EntityRuleSettings, SensorSettings


@rule("follows", EntityRuleSettings)
class Follows(EntityRule):
    seen, set_point, near = slot(), slot(2), slot()
    own = need("position")

    def __init__(self, settings, at):
        self.around = Surroundings(at.spec, at.layout)
        rovers = at.layout.of("rover")
        other = rovers[(rovers.index(at.robot) + 1) % len(rovers)]
        self.others = [at.of(other, field) for field in ("position", "drive.set_point", "drive.asked")]

    def apply(self, view):
        position, set_point, asked = map(view.read, self.others)
        view.write(self.seen, position[0] - view.read(self.own)[0] + asked[0])
        view.write(self.set_point, *set_point)
        near = self.around.near(view, tuple(view.read(self.own)), 1.8, "vehicle")
        view.write(self.near, sum(self.around.position(view, entity)[1] for entity in near))


class Near(Struct, frozen=True):
    x: Metres


@sensor("neighbours", SensorSettings, Near)
class Neighbours(Sensor):
    own = need("position")

    def __init__(self, settings, at):
        self.around = Surroundings(at.spec, at.layout)

    def sample(self, view):
        near = self.around.near(view, tuple(view.read(self.own)), 1.8, "vehicle")
        return Near(sum(self.around.position(view, entity)[0] for entity in near))


@actuator("asks", ActuatorSettings, Drive, needs=("wheel_speeds",), kit="hall")
class Asks(DriveActuator):
    asked = slot()

    def __init__(self, settings, at):
        super().__init__(settings, at)
        rovers = at.layout.of("rover")
        other = rovers[(rovers.index(at.robot) + 1) % len(rovers)]
        self.others = at.of(other, "drive.set_point")

    def accept(self, command, view):
        view.write(self.asked, view.read(self.others)[0] + view.count)
        return super().accept(command, view)

    def command(self, view):
        return tuple((speed, force / (2.0 + view.read(self.others)[0])) for speed, force in super().command(view))
"""


@pytest.fixture
def readers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    (tmp_path / "own_readers.py").write_text(READERS)
    monkeypatch.syspath_prepend(str(tmp_path))
    sys.modules.pop("own_readers", None)
    invalidate_caches()
    world: World = HALL
    rovers = [name for name, robot in HALL.data["robots"].items() if robot["model"] == "rover"]
    for rover in rovers:
        world = world.with_(("robots", rover, "actuators"), {"drive": {"kind": "own_readers:Asks"}}, ())
        rules = {"battery": {"kind": "battery"}, "follows": {"kind": "own_readers:Follows"}}
        world = world.with_(("robots", rover, "rules"), rules, ())
        sensors = {"neighbours": {"kind": "own_readers:Neighbours", "rate": "50 Hz"}}
        world = world.with_(("robots", rover, "sensors"), sensors, ())
    return World(world.data | {"players": driver(rovers, "own_readers:Asks", (1.2, 1.2), "10 Hz")}).text()


def test_entity_rules_and_actuators_see_others_as_they_were(readers: str) -> None:
    """On any number of nodes, with moved robots; and all that they see changes."""
    assert list(broken_laws(readers, NAME, 150)) == []
    frames = Frames()
    rehearse(readers, NAME, 150, 1, settings=Settings(on_commit=frames))
    for field in ("follows.seen", "follows.set_point", "follows.near", "drive.asked"):
        assert len({frame.at("rover-1", field) for frame in frames.frames}) > 5, field


def test_what_comes_under_the_name_of_what_went_in_one_order_is_new() -> None:
    """Its memory, that of rules about it, and references to the old one are gone."""
    deployment = load_deployment(TABLE.text(), NAME)
    start = initial_frame(deployment)
    layout = start.layout
    spare, other = layout["ball-2"], layout["ball"].offsets["football.touched_by"]
    numbers, _ = edit(start, [added_ball(layout, "ball-2", (0.2, 0.0, 0.02))], deployment)
    waits = spare.offsets["football.still_ticks"]
    numbers[waits], numbers[other] = 17.0, float(spare.index)
    frame = Frame(1, layout, np.array(numbers))
    again: list[Any] = [Remove("ball-2"), added_ball(layout, "ball-2", (0.1, 0.1, 0.02))]
    after, moved = edit(frame, again, deployment)
    assert moved == [spare, spare] and after[waits] == 0.0 and after[other] == NO_ENTITY
    assert after[spare.offsets["position"]] == 0.1
    numbers[other] = NO_ENTITY
    assert after[: spare.start] == numbers[: spare.start] and after[spare.stop :] == numbers[spare.stop :]
