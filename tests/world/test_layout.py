"""The canonical layout: entities in name order, every slot with one name and one kind of writer."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Final

from hypothesis import given, settings
from hypothesis import strategies as st

from foosim.deployment.loader import apply_sets, load_deployment
from foosim.deployment.schema import Deployment
from foosim.library.table.table import BALL
from foosim.world.component_types.descriptions import ABSENT
from foosim.world.component_types.registry import find_model, names
from foosim.world.components.view import Mounting
from foosim.world.layout import NOTHING, WORLD, Carried, Declared, Layout, build_layout

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
DEPLOYMENT: Final = load_deployment(TABLE.read_text(), TABLE.name)
LAYOUT: Final = build_layout(DEPLOYMENT)

models = st.dictionaries(
    st.text("abcdefgh.-_0123456789", min_size=1, max_size=8), st.sampled_from(["ball", "rod", "camera", "rover"])
)


@settings(max_examples=100)
@given(models=models, data=st.data())
def test_slots_follow_each_other_in_name_order(models: dict[str, str], data: st.DataObject) -> None:
    slots = st.dictionaries(st.text("abc", min_size=1, max_size=3), st.integers(1, 5), max_size=3)
    carried = {
        name: Carried(
            {f"{one}.held": count for one, count in data.draw(slots).items()},
            {f"{one}.seen": count for one, count in data.draw(slots).items()},
        )
        for name, model in models.items()
        if Layout.kind_of(model).is_robot
    }
    layout = Layout(models, Declared(carried=carried))
    assert list(layout.names) == sorted(models)
    position = 0
    for index, entity in enumerate(layout.entities):
        assert (entity.index, entity.start) == (index, position)
        assert entity.start < entity.split <= entity.stop
        its = carried.get(entity.name, NOTHING)
        own = {ABSENT: 1} if entity.can_leave else {}
        assert entity.counts == {**entity.fields, **its.solver, **own, **its.owner}
        assert entity.can_leave == ("position" in entity.fields and entity.is_solved)
        assert entity.stop - entity.split == sum(its.owner.values())
        assert list(entity.offsets) == list(entity.counts)
        for field, count in entity.counts.items():
            assert entity.offsets[field] == position and count > 0
            assert (position >= entity.split) == (field in its.owner)
            position += count
        assert entity.stop == position
    assert layout.size == position
    again = Layout(dict(reversed(models.items())), Declared(carried=dict(reversed(carried.items()))))
    assert again.digest == layout.digest, "the order in which things are named is nothing"


def with_spares(count: int) -> Deployment:
    return load_deployment(apply_sets(TABLE.read_text(), TABLE.name, [f"table.spare_balls={count}"]), TABLE.name)


def test_spares_are_in_the_layout_from_the_start_and_the_ball_never_leaves() -> None:
    none = build_layout(with_spares(0))
    assert not none.spares and not any(entity.can_leave for entity in none.entities)
    assert {*LAYOUT.names} == {*none.names, "ball-2", "ball-3"} and LAYOUT.spares == {"ball-2", "ball-3"}
    assert [entity.name for entity in LAYOUT.entities if entity.can_leave] == ["ball-2", "ball-3"]


def test_the_table_has_its_entities() -> None:
    assert set(LAYOUT.names) == {BALL, *LAYOUT.spares, WORLD, *DEPLOYMENT.robots}
    assert [entity.name for entity in LAYOUT.of("rod")] == sorted(
        name for name in DEPLOYMENT.robots if name != "camera"
    )
    assert [entity.name for entity in LAYOUT.robots] == sorted(DEPLOYMENT.robots)
    assert [entity.name for entity in LAYOUT.of("ball")] == [BALL, "ball-2", "ball-3"]
    assert {entity.name for entity in LAYOUT.entities if not entity.is_solved} == {WORLD, "camera"}
    models = [find_model(name) for name in names("model")]
    assert {model.name for model in models if model.is_solved and model.is_robot and model.kit} == {"rod", "rover"}
    assert find_model("ball").can_be_free and not find_model("ball").is_robot
    assert {model.name for model in models if model.actuators and model.kit} == {"rod", "rover"}
    assert "ball" in LAYOUT and "nobody" not in LAYOUT and LAYOUT["camera"].model == "camera"


def test_what_the_owner_writes_is_the_memory_of_sensors() -> None:
    for entity in LAYOUT.entities:
        owned = [field for field, at in entity.offsets.items() if at >= entity.split]
        sensors = DEPLOYMENT.robots[entity.name].sensors if entity.is_robot else {}
        delayed = ["ball.delay.values", "ball.delay.ticks"] if entity.name == "camera" else []
        assert owned == [*delayed, *(f"{channel}.samples" for channel in sorted(sensors))]
        assert all(entity.counts[field] == 1 for field in owned if field not in delayed)


def test_what_an_actuator_remembers_is_the_solvers() -> None:
    for rod in LAYOUT.of("rod"):
        held = [field for field in rod.offsets if "." in field and rod.offsets[field] < rod.split]
        assert held == ["position.set_point"] and rod.counts["position.set_point"] == 2
        assert LAYOUT.components(rod.name) == ["encoder", "position"]
    assert LAYOUT.components("camera") == ["ball"] and LAYOUT.components(BALL) == []


SENSOR: Final = "{kind: encoder, rate: 100 Hz}"
SLIDE: Final = "{kind: rod_position}"


def laid_out(*sets: str) -> Layout:
    return build_layout(load_deployment(apply_sets(TABLE.read_text(), TABLE.name, sets), TABLE.name))


def test_the_order_in_which_components_are_named_is_nothing() -> None:
    one, other = (
        laid_out(
            "players={}",
            f"robots.red.goal.sensors={{{', '.join(f'{name}: {SENSOR}' for name in sensors)}}}",
            f"robots.red.goal.actuators={{{', '.join(f'{name}: {SLIDE}' for name in actuators)}}}",
        )
        for sensors, actuators in ((("zeta", "alpha"), ("one",)), (("alpha", "zeta"), ("one",)))
    )
    assert one.digest == other.digest
    assert one.components("red.goal") == ["alpha", "one", "zeta"]
    assert list(one["red.goal"].offsets)[-4:] == ["one.set_point", "inactive", "alpha.samples", "zeta.samples"]


def test_a_robot_without_actuators_has_its_models_and_one_that_names_them_has_those() -> None:
    assert laid_out(f"robots.red.goal.actuators={{position: {SLIDE}}}").digest == LAYOUT.digest
    assert laid_out("robots.red.goal.actuators=null").digest == LAYOUT.digest
    moved = laid_out(f"robots.red.goal.actuators={{loop: {SLIDE}}}")
    assert moved.components("red.goal") == ["encoder", "loop"] and moved.size == LAYOUT.size
    none = laid_out("robots.red.goal.actuators={}")
    assert none.components("red.goal") == ["encoder"] and none.size == LAYOUT.size - 2
    assert len({layout.digest for layout in (LAYOUT, moved, none)}) == 3


def test_every_difference_has_another_digest() -> None:
    solver, owner = {"position.set_point": 2}, {"encoder.samples": 1}
    assert LAYOUT.declared.carried["red.goal"] == Carried(solver, owner)
    others = [
        NOTHING,
        Carried(solver, {}),
        Carried({}, owner),
        Carried(solver, {"encodes.samples": 1}),
        Carried(solver, {**owner, "second.samples": 1}),
        Carried({"position.set_points": 2}, owner),
        Carried({"positions.et_point": 2}, owner),
        Carried({"position.set_point": 1, "position.more": 1}, owner),
        Carried({"position.set_point": 3}, owner),
        Carried({**solver, **owner}, {}),
        Carried({}, {**solver, **owner}),
        Carried({"position.set_point": 1}, {"encoder.samples": 2}),
    ]
    layouts = [
        LAYOUT,
        build_layout(with_spares(0)),
        build_layout(with_spares(1)),
        Layout({**LAYOUT.models, "red.goal": "camera"}, replace(LAYOUT.declared, kinds={})),
        *(
            Layout(LAYOUT.models, replace(LAYOUT.declared, carried={**LAYOUT.declared.carried, "red.goal": other}))
            for other in others
        ),
    ]
    assert len({layout.digest for layout in layouts}) == len(layouts)
    assert build_layout(DEPLOYMENT).digest == LAYOUT.digest


def test_a_layout_does_not_know_who_computes_it() -> None:
    sets = ["nodes={one: {robots: [" + ", ".join(DEPLOYMENT.robots) + "]}}", "seed=9", "tick=5 ms"]
    other = load_deployment(apply_sets(TABLE.read_text(), TABLE.name, sets), TABLE.name)
    assert build_layout(other).digest == LAYOUT.digest


def test_a_slot_of_a_rule_is_not_that_of_a_sensor_of_its_name() -> None:
    """Nor may the sensor write it: what is the solver's is no owner's."""
    sets = ["robots.red.goal.rules={}", "robots.red.goal.sensors.wear={kind: encoder, rate: 100 Hz}"]
    deployment = load_deployment(apply_sets(TABLE.read_text(), TABLE.name, sets), TABLE.name)
    layout = build_layout(deployment)
    rod = layout["red.goal"]
    solvers = {**rod.offsets, "wear.contacts": rod.offsets["contacts"]}
    both = replace(rod, offsets=solvers, counts={**rod.counts, "wear.contacts": 3})
    sensor = Mounting(deployment, layout, both, "wear", b"", is_owners=True)
    rule = Mounting(deployment, layout, both, "wear", b"")
    assert (sensor.slot("contacts").name, sensor.slot("contacts").is_own) == ("red.goal contacts", False)
    assert (rule.slot("contacts").name, rule.slot("contacts").is_own) == ("red.goal wear.contacts", True)
    assert sensor.slot("samples").is_own and "wear.samples" in sensor.slot("samples").name
