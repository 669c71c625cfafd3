"""The poses that a page draws are those of the one forward kinematics, in the order of the scene's links."""

from collections.abc import Callable

import numpy as np
import pytest

from foosim.console.shown.drawing import Drawing, Poser
from foosim.console.shown.scene_json import scene_content
from foosim.deployment.assets import pin_assets
from foosim.deployment.loader import load_deployment
from foosim.deployment.schema import Deployment
from foosim.world.assembly.initial_state import initial_frame
from foosim.world.assembly.world import build_scene
from foosim.world.component_types.descriptions import ABSENT
from foosim.world.frame import Frame
from foosim.world.kinematics import forward_kinematics
from foosim.world.layout import build_layout
from tests.console.memory import table, table_with_spares
from tests.whole_worlds import assets, yard


def yard_with_files() -> Deployment:
    text, files = pin_assets(yard(), "yard.yaml", assets())
    return load_deployment(text, "yard.yaml").with_assets(files)


@pytest.mark.parametrize("world", ["table", "hall", "yard"])
def test_poses_are_those_of_forward_kinematics(world: str, fleet_text: Callable[..., str]) -> None:
    """Of two balls, of a hall, of bodies whose centre of mass is beside their origin."""
    made: dict[str, Callable[[], Deployment]] = {
        "table": table_with_spares,
        "hall": lambda: load_deployment(fleet_text(4), "hall"),
        "yard": yard_with_files,
    }
    deployment = made[world]()
    layout = build_layout(deployment)
    scene = build_scene(deployment, layout)
    values = np.linspace(-3.0, 3.0, layout.size)
    for entity in layout.entities:
        if entity.can_leave:
            values[entity.offsets[ABSENT]] = 0.0
    expected = [
        (name, [*position, *turned])
        for body in scene.bodies
        for name, position, turned in forward_kinematics(scene.bodies[body], layout[body], values.tolist())
    ]
    links = scene_content(deployment, layout, scene)["links"]
    assert [link["name"] for link in links] == [name for name, _ in expected]
    poses = Poser(layout, scene).poses(values)
    assert poses.tolist() == np.array([pose for _, pose in expected], np.float32).tolist()


def test_what_is_absent_has_neither_poses_nor_numbers(fleet_text: Callable[..., str]) -> None:
    for deployment, spare in (
        (table_with_spares(2), "ball-3"),
        (load_deployment(fleet_text(3, "robots.rover02.spare=true"), "hall"), "rover02"),
    ):
        drawing = Drawing(deployment)
        there = initial_frame(deployment)
        moment, entity = drawing.moment(there), drawing.layout[spare]
        absent = {name for name, place in drawing.entities.items() if np.isnan(moment.poses[place]).all()}
        assert absent == drawing.layout.spares and spare in absent
        its = slice(entity.start, entity.stop)
        assert moment.values[entity.offsets[ABSENT]] == 1.0
        assert np.isnan(moment.values[its]).sum() == entity.stop - entity.start - 1
        assert np.isfinite(moment.values).sum() >= sum(e.stop - e.start for e in drawing.layout.present(there.numbers))
        values = there.values.copy()
        values[entity.offsets[ABSENT]] = 0.0
        assert np.isfinite(drawing.moment(Frame(1, drawing.layout, values)).values[its]).all()


def test_every_number_of_a_frame_belongs_to_one_field() -> None:
    deployment = table()
    layout = build_layout(deployment)
    content = scene_content(deployment, layout, build_scene(deployment, layout))
    fields = content["fields"]
    numbers = [place for run in fields for place in range(run["index"], run["index"] + run["count"])]
    assert numbers == list(range(layout.size))
    rod = [(run["unit"], run["count"]) for run in fields if run["field"] == "joint_positions"]
    assert rod[:2] == [("m", 1), ("rad", 1)]


def test_the_commands_of_a_world_are_the_set_points_of_its_actuators(fleet_text: Callable[..., str]) -> None:
    for deployment, channel, told in (
        (table(), "position", [("slide", "m"), ("spin", "rad")]),
        (load_deployment(fleet_text(2), "hall"), "drive", [("left", "m/s"), ("right", "m/s")]),
    ):
        layout = build_layout(deployment)
        commands = scene_content(deployment, layout, build_scene(deployment, layout))["commands"]
        assert {command["channel"] for command in commands} == {channel}
        slot = f"{channel}.set_point"
        robot = next(entity for entity in layout.robots if slot in entity.offsets)
        mine = [command for command in commands if command["robot"] == robot.name]
        assert [(command["number"], command["unit"]) for command in mine] == told
        assert [command["index"] - robot.offsets[slot] for command in mine] == [0, 1]
        assert len(commands) == 2 * sum(slot in entity.offsets for entity in layout.robots)


def test_models_and_rules_say_what_a_world_shows(fleet_text: Callable[..., str]) -> None:
    """Units of fields, what can leave, and how marks of the rules look."""
    football, hall = table_with_spares(), load_deployment(fleet_text(2), "hall")
    layout = build_layout(football)
    shown = scene_content(football, layout, build_scene(football, layout))
    units = {(run["entity"], run["field"]): run["unit"] for run in shown["fields"]}
    assert units["ball", "football.wait_ticks"] == "ticks" and units["ball", "position"] == "m"
    assert units["world", "football.score"] == ""
    bodies = {body["name"]: (body["pushable"], body["removable"]) for body in shown["bodies"]}
    assert (bodies["ball"], bodies["ball-2"], bodies["red.goal"]) == ((True, False), (True, True), (False, False))
    assert shown["marks"]["goal"] == {"look": "score", "text": "goals", "cut": True}
    assert {name for name, mark in shown["marks"].items() if mark["cut"]} == {
        *("goal", "own_goal", "kickoff", "out", "dead", "end")
    }
    layout = build_layout(hall)
    shown = scene_content(hall, layout, build_scene(hall, layout))
    units = {(run["entity"], run["field"]): run["unit"] for run in shown["fields"]}
    rover = [units["rover01", field] for field in ("heading", "wheel_speeds", "wheel_travel", "charge")]
    assert rover == ["rad", "m/s", "m", "J"]
    can = {body["name"]: (body["robot"], body["pushable"], body["removable"]) for body in shown["bodies"]}
    assert can == {"base": (True, False, False), **dict.fromkeys(("rover01", "rover02"), (True, False, True))}
    assert shown["marks"] == {
        "empty": {"look": "lost", "text": "empty batteries", "cut": False},
        "failed": {"look": "lost", "text": "components that failed", "cut": False},
    }
