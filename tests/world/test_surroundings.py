"""What forms see around them: poses of links, who is near, tags, contacts; and references to entities in slots."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np
import pytest

from foosim.deployment.loader import apply_sets, load_deployment
from foosim.node.edited_frame import edit, moved_reference
from foosim.world.assembly.world import initial_numbers
from foosim.world.components.surroundings import Surroundings
from foosim.world.components.view import View
from foosim.world.edits import Add, Remove
from foosim.world.forms.forms import ENTITY, NO_ENTITY
from foosim.world.frame import Frame
from foosim.world.layout import Declared, Layout, build_layout
from foosim.world.parameters.table import table_of

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
DEPLOYMENT: Final = load_deployment(
    apply_sets(TABLE.read_text(), TABLE.name, ["robots.red.goal.tags=[keeper]", "robots.blue.goal.tags=[keeper]"]),
    TABLE.name,
)
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
    memory = {**declared.memory, "ball": {**declared.memory["ball"], "own.target": ENTITY, "own.index": 1}}
    return Layout(LAYOUT.models, Declared(declared.names, declared.carried, memory, declared.addable))


def test_a_reference_follows_its_entity_and_is_none_when_that_is_gone() -> None:
    layout = referring()
    assert layout.digest != LAYOUT.digest
    numbers = initial_numbers(DEPLOYMENT, layout)
    target, index = (layout["ball"].offsets[f"own.{slot}"] for slot in ("target", "index"))
    own = layout["ball"].offsets["football.touched_by"]
    assert layout.references == (own, target) and numbers[target] == NO_ENTITY and numbers[index] == 0.0
    numbers[target] = numbers[index] = float(layout["red.goal"].index)
    frame = Frame(0, layout, np.array(numbers))
    more, added = edit(frame, [Add("a1", "ball", (0.1, 0.0, 0.02), STILL)], DEPLOYMENT)
    ball = more["ball"].offsets
    assert added[ball["own.target"]] == more["red.goal"].index == layout["red.goal"].index + 1
    assert added[ball["own.index"]] == layout["red.goal"].index, "a plain number now means another entity"
    assert added[more["a1"].offsets["own.target"]] == NO_ENTITY
    added[ball["own.target"]] = float(more["a1"].index)
    less, left = edit(Frame(1, more, np.array(added)), [Remove("a1")], DEPLOYMENT)
    assert left[less["ball"].offsets["own.target"]] == NO_ENTITY


@pytest.mark.parametrize("reference", [-1.0, -5.0, 1e6])
def test_what_refers_to_nobody_stays_so(reference: float) -> None:
    assert moved_reference(reference, LAYOUT, LAYOUT, set()) == NO_ENTITY
