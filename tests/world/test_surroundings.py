"""What components see around them: poses of links, who is near, tags, contacts; and references to entities in slots."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from foosim.library.table.settings import table_of
from foosim.node.edited_frame import edit
from foosim.world.assembly.world import initial_numbers
from foosim.world.component_types.descriptions import ENTITY, NO_ENTITY
from foosim.world.components.surroundings import Surroundings
from foosim.world.components.view import View
from foosim.world.edits import Remove
from foosim.world.frame import Frame
from foosim.world.layout import Layout, build_layout
from tests.deployed import deployed
from tests.placing import added_ball

SETS: Final = ("robots.red.goal.tags=[keeper]", "robots.blue.goal.tags=[keeper]", "table.spare_balls=1")
DEPLOYMENT: Final = deployed(*SETS)
LAYOUT: Final = build_layout(DEPLOYMENT)
AROUND: Final = Surroundings(DEPLOYMENT, LAYOUT)
STILL: Final = (0.0, 0.0, 0.0)


def test_poses_are_those_of_the_links_in_the_frame() -> None:
    numbers = initial_numbers(DEPLOYMENT, LAYOUT)
    rod = LAYOUT["red.goal"]
    numbers[rod.offsets["joint_positions"]] = 0.05
    (slide, at, _), (spin, turned, _) = AROUND.poses(View(0, numbers), rod)
    height = table_of(DEPLOYMENT).rod.axis_height
    assert (slide, spin) == ("red.goal/slide", "red.goal/spin") and at == turned == (-0.522, 0.05, height)
    assert AROUND.poses(View(0, numbers), LAYOUT["camera"]) == []


def test_who_is_near_is_in_name_order_and_has_the_tag() -> None:
    view = View(0, initial_numbers(DEPLOYMENT, LAYOUT))
    assert [entity.name for entity in AROUND.tagged("keeper")] == ["blue.goal", "red.goal"]
    assert [entity.name for entity in AROUND.near(view, STILL, 0.05)] == ["ball"]
    assert [entity.name for entity in AROUND.near(view, (-0.522, 0.0, 0.08), 0.1, "keeper")] == ["red.goal"]
    assert len(AROUND.near(view, STILL, 10.0)) == 9


def test_contacts_are_those_of_the_last_tick() -> None:
    numbers = initial_numbers(DEPLOYMENT, LAYOUT)
    at = LAYOUT["ball"].offsets["contacts"]
    numbers[at : at + 3] = [2.0, 0.5, 3.0]
    assert AROUND.contacts(View(0, numbers), LAYOUT["ball"]) == (2, 0.5, 3)
    assert AROUND.contacts(View(0, numbers), LAYOUT["camera"]) == (0, 0.0, -1)


# --- references ------------------------------------------------------------------------------------------------------


def referring() -> Layout:
    """The table, with two slots on each ball: a reference to an entity, and a plain number."""
    declared = LAYOUT.declared
    rule_slots = {**declared.rule_slots, "ball": {**declared.rule_slots["ball"], "own.target": ENTITY, "own.index": 1}}
    return Layout(LAYOUT.models, replace(declared, rule_slots=rule_slots))


def test_a_reference_is_none_when_its_entity_leaves_and_stays_so() -> None:
    layout = referring()
    assert layout.digest != LAYOUT.digest
    numbers = initial_numbers(DEPLOYMENT, layout)
    target, index = (layout["ball"].offsets[f"own.{slot}"] for slot in ("target", "index"))
    spare = layout["ball-2"]
    its = spare.offsets["own.target"]
    own = [layout[name].offsets["football.touched_by"] for name in ("ball", "ball-2")]
    assert layout.references == (own[0], target, own[1], its)
    assert numbers[target] == numbers[its] == NO_ENTITY and numbers[index] == 0.0
    coming = added_ball(layout, "ball-2", (0.1, 0.0, 0.02))
    added, moved = edit(Frame(0, layout, np.array(numbers)), [coming], DEPLOYMENT)
    assert moved == [spare] and added[its] == NO_ENTITY
    added[target] = added[index] = added[its] = float(spare.index)
    left, moved = edit(Frame(1, layout, np.array(added)), [Remove("ball-2")], DEPLOYMENT)
    assert moved == [spare] and left[target] == left[its] == NO_ENTITY
    assert left[index] == spare.index, "a plain number means what it meant"
    back, _ = edit(Frame(2, layout, np.array(left)), [coming], DEPLOYMENT)
    assert back[target] == NO_ENTITY
