"""The canonical layout: entities in name order, every slot with one name and one kind of writer."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from foosim.common.errors import Malformed
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.world.layout import ADDABLE, BALL, BODIES, ROBOTS, WORLD, Layout, build_layout

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
DEPLOYMENT: Final = load_deployment(TABLE.read_text(), TABLE.name)
LAYOUT: Final = build_layout(DEPLOYMENT)

models = st.dictionaries(
    st.text("abcdefgh.-_0123456789", min_size=1, max_size=8), st.sampled_from(["ball", "rod", "camera", "world"])
)


@settings(max_examples=100)
@given(models=models, data=st.data())
def test_slots_follow_each_other_in_name_order(models: dict[str, str], data: st.DataObject) -> None:
    channels = st.lists(st.text("abc", min_size=1, max_size=3), max_size=3, unique=True)
    sensors = {name: data.draw(channels) for name, model in models.items() if model in ROBOTS}
    layout = Layout(models, sensors)
    assert list(layout.names) == sorted(models)
    position = 0
    for index, entity in enumerate(layout.entities):
        assert (entity.index, entity.start) == (index, position)
        assert entity.start < entity.split <= entity.stop
        assert entity.stop - entity.split == len(sensors.get(entity.name, []))
        starts = list(entity.offsets.values())
        assert starts == sorted(set(starts)) and entity.start == starts[0] and starts[-1] < entity.stop
        position = entity.stop
    assert layout.size == position
    again = Layout(dict(reversed(models.items())), {name: names[::-1] for name, names in sensors.items()})
    assert again.digest == layout.digest, "the order in which things are named is nothing"


def test_the_table_has_its_entities() -> None:
    assert set(LAYOUT.names) == {BALL, WORLD, *DEPLOYMENT.robots}
    assert [entity.name for entity in LAYOUT.rods] == sorted(name for name in DEPLOYMENT.robots if name != "camera")
    assert [entity.name for entity in LAYOUT.robots] == sorted(DEPLOYMENT.robots)
    assert [entity.name for entity in LAYOUT.balls] == [BALL]
    assert {entity.name for entity in LAYOUT.entities if not entity.has_body} == {WORLD, "camera"}
    assert {"rod", "rover"} == BODIES & ROBOTS and ADDABLE <= BODIES - ROBOTS
    assert "ball" in LAYOUT and "nobody" not in LAYOUT and LAYOUT["camera"].model == "camera"


def test_what_the_owner_writes_is_the_memory_of_sensors() -> None:
    for entity in LAYOUT.entities:
        owned = [field for field, at in entity.offsets.items() if at >= entity.split]
        assert owned == [f"sampled.{channel}" for channel in LAYOUT.sensors.get(entity.name, ())]


def test_every_difference_has_another_digest() -> None:
    layouts = [
        LAYOUT,
        build_layout(DEPLOYMENT, [("ball2", "ball")]),
        build_layout(DEPLOYMENT, [("ball3", "ball")]),
        build_layout(DEPLOYMENT, [("ball2", "ball"), ("ball3", "ball")]),
        Layout({**LAYOUT.models, "red.goal": "camera"}, LAYOUT.sensors),
        Layout(LAYOUT.models, {**LAYOUT.sensors, "red.goal": ()}),
        Layout(LAYOUT.models, {**LAYOUT.sensors, "red.goal": ("encodes",)}),
        Layout(LAYOUT.models, {**LAYOUT.sensors, "red.goal": ("encoder", "second")}),
    ]
    assert len({layout.digest for layout in layouts}) == len(layouts)
    assert build_layout(DEPLOYMENT).digest == LAYOUT.digest


def test_a_layout_does_not_know_who_computes_it() -> None:
    sets = ["nodes={one: {robots: [" + ", ".join(DEPLOYMENT.robots) + "]}}", "seed=9", "tick=5 ms"]
    other = load_deployment(apply_sets(TABLE.read_text(), TABLE.name, sets), TABLE.name)
    assert build_layout(other).digest == LAYOUT.digest


@pytest.mark.parametrize(
    "wrong",
    [
        [("ball", "ball")],
        [("world", "ball")],
        [("red.goal", "ball")],
        [("b2", "rod")],
        [("b2", "camera")],
        [("b2", "world")],
        [("b2", "")],
        [("b2", "ball"), ("b2", "ball")],
    ],
    ids=str,
)
def test_only_balls_with_free_names_are_added(wrong: list[tuple[str, str]]) -> None:
    with pytest.raises(Malformed, match=f"{wrong[-1][1]} {wrong[-1][0]} cannot be added"):
        build_layout(DEPLOYMENT, wrong)
