"""Templates: what is `like` one has its keys, its own come over them, and what is wrong is said where it is written."""

from __future__ import annotations

import json
from contextlib import suppress
from textwrap import dedent
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from foosim.common import limits
from foosim.common.errors import DeploymentError
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.deployment.text.expand import expand
from foosim.deployment.text.includes import Source
from foosim.deployment.text.yaml import Fields, locate_in, plain, read_tree, write_yaml
from foosim.world.models.rover import RoverRobot
from tests.deployment.halls import BATTERY, HEAD, ROVER, WAREHOUSE, hall, problems_of


def test_a_setting_of_null_takes_away_what_a_template_has_itself_or_by_another_one() -> None:
    robots = "robots: {a: {like: slow, x: 1 m, y: 2 m}}\n"
    for battery in ("", f", sensors: {{battery: {BATTERY}}}"):
        text = hall(ROVER + f"  slow: {{like: rover{battery}}}\n" + robots)
        for template in ("rover", "slow") if not battery else ("slow",):
            changed = apply_sets(text, "f.yaml", [f"templates.{template}.sensors.battery=null"])
            assert [*load_deployment(changed, "f.yaml").robots["a"].sensors] == ["pose"]






# --- what is wrong ----------------------------------------------------------------------------------------------------

TWENTY = "robots:\n" + "".join(f"  r{n}: {{like: rover, x: {n - 10} m, y: 2 m}}\n" for n in range(20))










def test_templates_that_are_like_one_another_end_somewhere() -> None:
    depth = limits.LIKE_DEPTH_MAX
    chain = "".join(f"  t{n}: {{like: t{n + 1}}}\n" for n in range(depth + 1)) + f"  t{depth + 1}: {{like: rover}}\n"
    robots = "robots: {r: {like: t0, x: 1 m, y: 1 m}}\n"
    assert problems_of(hall(ROVER + chain + robots)) == [
        f"{6 + depth}:15: templates.t{depth - 1}.like: more than {depth} templates that are like one another, "
        f"'t{depth}'"
    ]
    load_deployment(hall(ROVER + chain + robots.replace("t0", "t3")), "f")






# --- canonical text ---------------------------------------------------------------------------------------------------






def test_the_warehouse_is_what_it_would_be_written_out() -> None:
    """Written out by this test: each entry with its template's keys, its own instead of them."""
    tree, _ = read_tree(WAREHOUSE.read_text(), locate_in("w"))
    assert tree is not None
    data = plain(tree)
    templates = data.pop("templates")
    rovers = [f"rover{number:02}" for number in range(1, 22)]
    assert [name for name in data["robots"] if name not in {"base", "porter"}] == rovers
    for section in ("robots", "scenery"):
        for name, entry in data[section].items():
            data[section][name] = {**templates.get(entry.pop("like", ""), {}), **entry}
    pillar = data["scenery"].pop("pillar")
    for key in ("count", "spacing"):
        pillar.pop(key)
    data["scenery"] |= {f"pillar-{n + 1}": {**pillar, "x": f"{x} m"} for n, x in enumerate((-15, -10, -5, 0))}
    data["nodes"]["west"]["robots"] = ["base", *rovers[:10]]
    data["nodes"]["east"]["robots"] = [*rovers[10:], "porter"]
    data["players"] = {"dispatch": data["players"]["dispatch"]}
    for number, rover in enumerate(rovers, 1):
        pilot = json.loads(json.dumps(templates["pilot"]).replace("$robot", rover))
        data["players"][f"pilot{number:02}"] = {**pilot, "process": "fleet-west" if number <= 10 else "fleet-east"}
    long = load_deployment(write_yaml(data), "long").model_dump()
    assert load_deployment(WAREHOUSE.read_text(), "short").model_dump() == long


def test_a_further_rover_of_the_warehouse_is_one_line() -> None:
    text = WAREHOUSE.read_text()
    line = "  rover20: {like: rover, x: 13.75 m, y: -6.25 m, heading: 90 deg, charge: 61 %}\n"
    assert line in text
    more = load_deployment(text.replace(line, f"{line}  rover22: {{like: rover, x: 17 m, y: -4 m}}\n"), "w")
    assert more.owners()["rover22"] == "east"
    assert (more.players["pilot22"].on, more.players["pilot22"].process) == ("rover22", "fleet-east")


def test_the_example_of_the_reference_is_a_deployment() -> None:
    page = (WAREHOUSE.parents[1] / "docs" / "reference" / "deployment.md").read_text()
    example = page[page.index("    include: [parts/shelves.yaml]") : page.index("* **Templates.**")]
    text = Source(HEAD + dedent(example), (("parts/shelves.yaml", "scenery: {}\n"),))
    deployment = load_deployment(text, "page")
    assert (len(deployment.robots), deployment.owners()["scout-11"]) == (22, "east")
    assert (deployment.players["pilot-12"].on, deployment.players["pilot-12"].process) == ("scout-12", "fleet-east")
    assert deployment.players["pilot-7"].rate_hz == 5
    assert len(deployment.players["watch"].robots) == 20
    scout = deployment.robots["scout-7"]
    assert isinstance(scout, RoverRobot)
    assert (scout.x, scout.y, scout.charge, list(scout.sensors)) == (-4.0, 6.0, 0.6, ["pose"])


VALUES = st.recursive(
    st.none() | st.booleans() | st.integers(-9, 9) | st.sampled_from(["x", "$robot", "1 m"]),
    lambda inner: st.lists(inner, max_size=2) | st.dictionaries(st.sampled_from("abc"), inner, max_size=3),
    max_leaves=6,
)
ENTRIES = st.dictionaries(st.sampled_from("abc"), VALUES, max_size=3)
NAMES = st.sampled_from(["t0", "t1", "t2", "t3"])


@given(st.dictionaries(NAMES, ENTRIES, max_size=4), st.lists(st.tuples(NAMES | st.none(), ENTRIES), max_size=3))
def test_expanding_is_merging(templates: dict[str, Any], robots: list[tuple[str | None, Any]]) -> None:
    """Templates are each like the next one; null takes away; compared with merging plain data."""
    names = sorted(templates)
    data: dict[str, Any] = {"templates": {}, "robots": {}}
    for name, after in zip(names, [*names[1:], None], strict=False):
        data["templates"][name] = templates[name] | ({"like": after} if after else {})
    for number, (like, entry) in enumerate(robots):
        data["robots"][f"r{number}"] = entry | ({"like": like} if like in templates else {})
    tree, _ = read_tree(write_yaml(data), locate_in("f"))
    assert tree is not None
    expanded = expand(tree)
    assert expanded.problems == [] and isinstance(expanded.tree, Fields)

    def over(base: Any, own: Any) -> Any:
        if not (isinstance(base, dict) and isinstance(own, dict)):
            return own
        kept = {key: value for key, value in base.items() if key not in own or own[key] is not None}
        return kept | {key: over(kept[key], own[key]) if key in kept else own[key] for key in own if not
                       (key in base and own[key] is None)}  # fmt: skip

    for number, (like, entry) in enumerate(robots):
        found: Any = {}
        for name in reversed(names[names.index(like) :] if like in templates else []):
            found = over(found, templates[name])
        found = over(found, entry) if like in templates else entry
        assert plain(expanded.tree)["robots"][f"r{number}"] == found


@given(st.text("ab:{}[]'\" \n$-.*1~", max_size=40))
def test_any_entry_is_expanded_or_refused(text: str) -> None:
    whole = hall(
        f"templates: {{t: {text}}}\nrobots: {{r: {{like: t, {text}}}, s: {text}}}\nplayers: {{'p$1': {text}}}\n"
    )
    with suppress(DeploymentError):
        load_deployment(whole, "f")
