"""What is abbreviated in a deployment: templates, counts, spares, entries for each robot; and settings of these."""

from __future__ import annotations

import json
from collections.abc import Mapping
from contextlib import suppress
from decimal import Decimal
from fnmatch import fnmatchcase
from pathlib import Path
from textwrap import dedent
from typing import Any, Final

import pytest
from hypothesis import given
from hypothesis import strategies as st

from foosim.common import limits, units
from foosim.common.errors import BadValue, DeploymentError
from foosim.deployment.assets import pin_assets
from foosim.deployment.loader import apply_sets, expanded_text, load_deployment, with_owners
from foosim.deployment.text.expand import expand
from foosim.deployment.text.includes import Source
from foosim.deployment.text.selection import Population, Selector, TooManyComparisons
from foosim.deployment.text.yaml import Fields, locate_in, plain, read_tree, write_yaml
from foosim.library.mobile.rover import RoverRobot
from foosim.world.layout import build_layout
from tests.deployment.halls import BATTERY, HEAD, MADE, PATROL, PILOT, ROVER, TWO, WAREHOUSE, hall, problems_of
from tests.kinematic_yard import yard_text

# --- templates --------------------------------------------------------------------------------------------------------


def test_a_setting_of_null_takes_away_what_a_template_has_itself_or_by_another_one() -> None:
    robots = "robots: {a: {like: slow, x: 1 m, y: 2 m}}\n"
    for battery in ("", f", sensors: {{battery: {BATTERY}}}"):
        text = hall(ROVER + f"  slow: {{like: rover{battery}}}\n" + robots)
        for template in ("rover", "slow") if not battery else ("slow",):
            changed = apply_sets(text, "f.yaml", [f"templates.{template}.sensors.battery=null"])
            assert [*load_deployment(changed, "f.yaml").robots["a"].sensors] == ["pose"]


# --- what is wrong ----------------------------------------------------------------------------------------------------


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


# --- entries for each robot -------------------------------------------------------------------------------------------


def test_what_is_made_is_in_the_place_of_its_entry() -> None:
    text = hall(ROVER + PILOT + TWO + "players: {z: {like: pilot, on: r-1, robots: {r-1: []}}, "
                "p$1: {like: pilot, each: r-*}, a: {like: pilot, on: r-1, robots: {r-1: []}}}\n")  # fmt: skip
    text = text.replace("robots: {r-1: []}", "robots: null")
    assert list(load_deployment(text, "f").players) == ["z", "p1", "p2", "a"]


def test_on_other_nodes_what_is_placed_by_the_node_is_not_placed() -> None:
    """Else a rehearsal on nodes n1 and n2 would need hosts of these names."""
    hosts = "hosts: {east: {address: 10.0.0.1}, west: {address: 10.0.0.2}}\n"
    players = "players: {p$1: {like: pilot, each: r-*, host: $node, process: on-$node}, p2: {process: own}}\n"
    text = hall(ROVER + PILOT + hosts + TWO + "nodes: {east: {robots: [r-1]}, west: {robots: [rest]}}\n" + players)
    declared = load_deployment(text, "f")
    assert [player.host for player in declared.players.values()] == ["east", "west"]
    others = load_deployment(with_owners(text, "f", {"n1": ["r-2"], "n2": ["r-1"]}, ["seed=7"]), "f")
    assert (others.owners(), others.seed) == ({"r-1": "n2", "r-2": "n1"}, 7)
    assert {name: player.process for name, player in others.players.items()} == {"p1": None, "p2": "own"}
    assert {player.host for player in others.players.values()} == {None}
    assert {**others.model_dump(), "nodes": 0, "players": 0, "seed": 0} == {
        **declared.model_dump(), "nodes": 0, "players": 0, "seed": 0}  # fmt: skip


# --- counts and selectors ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("at", [None, {}, {"yaw": "90 deg"}])
def test_what_stands_at_a_pose_is_spaced_from_the_origin_where_none_is_given(at: dict[str, str] | None) -> None:
    robot = {"model": "differential_drive", "count": 3, "spacing": {"x": "2 m", "y": "-50 cm"}}
    own = {"scout-3": {"at": {"x": "7 m"}}}
    text = yard_text({"scout": robot | ({} if at is None else {"at": at}), **own})
    robots: Mapping[str, Any] = load_deployment(text, "yard.yaml").robots
    places = [robots[name].at.position[:2] for name in ("scout-1", "scout-2", "scout-3")]
    assert places == [(0.0, 0.0), (2.0, -0.5), (7.0, -1.0)]


def lengths(digits_max: int) -> st.SearchStrategy[str]:
    """Lengths of at most 10 m and 1 m, with up to four decimals."""
    digits, places = st.integers(-digits_max, digits_max), st.integers(1, 4)
    return st.builds(
        lambda n, k, unit: f"{Decimal(n).scaleb(-k):f} {unit}", digits, places, st.sampled_from(["mm", "cm"])
    )


@given(lengths(9_999), lengths(999), st.integers(2, 5))
def test_places_are_added_exactly_and_rounded_once(start: str, step: str, count: int) -> None:
    spacing = f"spacing: {{x: {step}, y: 1 m}}"
    text = f"robots: {{r: {{like: rover, count: {count}, x: {start}, y: 2 m, {spacing}}}}}\n"
    deployment = load_deployment(hall(ROVER + text), "f")
    for number in range(count):
        robot = deployment.robots[f"r-{number + 1}"]
        assert isinstance(robot, RoverRobot)
        exact = units.parse(start, units.LENGTH) + number * units.parse(step, units.LENGTH)
        assert (robot.x, robot.y) == (float(exact), 2.0 + number)


# --- selectors --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("selector", "name", "parts"),
    [
        ("rover-*", "rover-12", ("12",)),
        ("*-*", "a-b-c", ("a", "b-c")),
        ("*a*b", "xayb", ("x", "y")),
        ("rover-1..12", "rover-12", ("12",)),
        ("rover-1..12", "rover-13", None),
        ("rover-1..12", "rover-012", None),
        ("rover-1..12", "rover-1b", None),
        ("rover01..12", "rover09", ("09",)),
        ("rover01..12", "rover9", None),
        ("r2d2-3..3", "r2d2-3", ("3",)),
    ],
)
def test_a_selector_takes_the_text_of_each_wildcard(selector: str, name: str, parts: tuple[str, ...] | None) -> None:
    assert Selector(selector).match(name) == parts


@given(st.text("ab*?", min_size=1, max_size=8), st.text("ab", max_size=8))
def test_a_glob_matches_as_elsewhere_and_the_parts_make_the_name(glob: str, name: str) -> None:
    parts = Selector(glob).match(name)
    assert (parts is not None) == fnmatchcase(name, glob)
    if parts is not None:
        rest = iter(parts)
        assert "".join(next(rest) if sign in "*?" else sign for sign in glob) == name


@pytest.mark.parametrize("text", ["Rover", "a..b", "rover-9..1", "a b", "", "x" * 65, "..", "1..2"])
def test_what_is_no_selector_is_refused(text: str) -> None:
    with pytest.raises(BadValue):
        Selector(text)


def test_a_selector_of_many_wildcards_takes_no_time() -> None:
    population = Population(["a" * 32] * 1000)
    assert population.chosen("*a" * 31 + "*b") == []


def test_comparisons_are_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(limits, "COMPARISONS_MAX", 1000)
    population = Population([f"r{n}" for n in range(100)])
    for number in (*range(10), 5):
        population.chosen(f"*{number}")
    with pytest.raises(TooManyComparisons):
        population.chosen("*10")


# --- spares -----------------------------------------------------------------------------------------------------------


DEPLOY: Final = Path(__file__).parents[2] / "deploy"
BOX: Final = {"model": "box", "size": ["20 cm"] * 3, "mass": "1 kg", "at": {"z": "10 cm"}}


def test_objects_have_spares_too_and_a_set_changes_how_many() -> None:
    text = yard_text({"w": {"model": "holonomic"}}, engine="mujoco", objects={"b": {**BOX, "spare": 2}})
    assert build_layout(load_deployment(text, "y")).spares == {"b-1", "b-2"}
    more = apply_sets(text, "y", ["objects.b.count=1", "objects.b.spare=3", "robots.w.spare=true"])
    layout = build_layout(load_deployment(more, "y"))
    assert layout.spares == {"b-2", "b-3", "b-4", "w"} and "b-1" in layout
    assert apply_sets(more, "y", []) == more


def test_nodes_and_players_have_the_spares_of_a_fleet() -> None:
    pilots = (
        f"players:\n  p-$1: {{each: '*', class: '{PATROL}', rate: 10 Hz, on: $robot, robots: {{$robot: [pose]}}}}\n"
    )
    nodes = "nodes:\n  a: {robots: ['*-1']}\n  b: {robots: ['*-2']}\n"
    fleet = "robots:\n  r: {like: rover, x: -15 m, y: 10 m, spacing: {x: 2 m}, count: 1, spare: 1}\n"
    text = hall(ROVER + fleet + nodes + pilots)
    deployment = load_deployment(text, "hall")
    assert deployment.owners() == {"r-1": "a", "r-2": "b"}
    assert {player.on for player in deployment.players.values()} == {"r-1", "r-2"}


@pytest.mark.parametrize("fixed", [True, False])
def test_what_is_fixed_is_no_spare(fixed: bool) -> None:
    """Whether it moves freely follows from its file: it is refused when that is there."""
    arm = {"model": "urdf", "file": "arm.urdf", "at": {"z": "1 m"}, "fixed": fixed, "spare": True}
    text = yard_text({"arm": arm | ({} if fixed else {"speed_limit": "9 m/s"})}, engine="mujoco", assets="models")
    if not fixed:
        pinned, files = pin_assets(text, "y", DEPLOY)
        assert build_layout(load_deployment(pinned, "y").with_assets(files)).spares == {"arm"}
        return
    line = 1 + next(number for number, its in enumerate(text.splitlines()) if "spare: true" in its)
    with pytest.raises(DeploymentError) as refused:
        pin_assets(text, "y", DEPLOY)
    (told,) = refused.value.problems
    assert told.startswith(f"y:{line}:") and told.endswith(
        "robots.arm.spare: a spare that could not be absent: an urdf without a place of its own, true"
    )


# --- settings of what is made -----------------------------------------------------------------------------------------


def written(*sets: str) -> Any:
    """The canonical text after settings, as data."""
    tree, _ = read_tree(apply_sets(MADE, "f", sets), locate_in("f"))
    assert tree is not None
    return plain(tree)


def changed(*sets: str) -> dict[str, Any]:
    """What of the expanded deployment is not as without settings, by path."""

    def flat(value: Any, path: str) -> dict[str, Any]:
        if not isinstance(value, dict):
            return {path: value}
        return {key: one for name, inner in value.items() for key, one in flat(inner, f"{path}/{name}").items()}

    def expanded(*of: str) -> dict[str, Any]:
        tree, _ = read_tree(expanded_text(MADE, "f", of), locate_in("f"))
        assert tree is not None
        return flat(plain(tree), "")

    before, after = expanded(), expanded(*sets)
    return {path: after.get(path) for path in {**before, **after} if before.get(path) != after.get(path)}


@pytest.mark.parametrize(
    ("setting", "change"),
    [
        ("robots.r-7.x=0.1 m", {"/robots/r-7/x": "0.1 m"}),
        ("robots.r-7.charge=5 %", {"/robots/r-7/charge": "5 %"}),
        ("robots.r-7.sensors.pose.rate=10 Hz", {"/robots/r-7/sensors/pose/rate": "10 Hz"}),
        ("robots.r-7.sensors.battery.offset=20 ms", {"/robots/r-7/sensors/battery/offset": "20 ms"}),
        ("robots.red.one.sensors.pose.rate=10 Hz", {"/robots/red.one/sensors/pose/rate": "10 Hz"}),
        ("robots.r-7.like=heavy", {"/robots/r-7/charge": "50 %"}),
        ("players.p3.rate=50 Hz", {"/players/p3/rate": "50 Hz"}),
        ("players.p3.parameters={speed: 2}", {"/players/p3/parameters/speed": 2}),
        ("players.p3.robots.r-3[0]=battery", {"/players/p3/robots/r-3": ["battery"]}),
        ("players.q-one.robots.red.one[0]=battery", {"/players/q-one/robots/red.one": ["battery"]}),
        ("players.p3.hears.p*[1]=beacon2", {"/players/p3/hears/p*": ["beacon", "beacon2"]}),
        ("players.p3.process=on-$node", {"/players/p3/process": "on-one"}),
        ("clients.c9.rate=5 Hz", {"/clients/c9/rate": "5 Hz"}),
        ("templates.heavy.sensors.battery.rate=2 Hz", {"/robots/red.one/sensors/battery/rate": "2 Hz"}),
        ("robots.r.spacing.x=-1 m", {f"/robots/r-{n + 1}/x": f"{-9 - n} m" for n in range(1, 9)}),
        ("templates.other={model: rover}", {}),
    ],
)
def test_a_setting_changes_what_it_names_and_nothing_else(setting: str, change: dict[str, Any]) -> None:
    assert changed(setting) == change


def test_a_made_robot_is_written_as_an_entry_of_its_own() -> None:
    robots = written("robots.r-7.x=3 m", "robots.r-7.sensors.pose.rate=10 Hz")["robots"]
    assert robots["r-7"] == {"x": "3 m", "sensors": {"pose": {"rate": "10 Hz"}}}
    assert robots["r"]["count"] == 9
    canonical = apply_sets(MADE, "f", ["robots.r-7.x=3 m", "players.p7.rate=50 Hz"])
    assert apply_sets(canonical, "c", []) == canonical
    players = load_deployment(canonical, "c").players
    assert [player.rate_hz for player in players.values()] == [10] * 6 + [50] + [10] * 3


def test_a_setting_of_a_count_is_seen_by_the_next_one() -> None:
    robots = load_deployment(apply_sets(MADE, "f", ["robots.r.count=10", "robots.r-10.x=9.5 m"]), "f").robots
    assert getattr(robots["r-10"], "x") == 9.5  # noqa: B009


def test_a_robot_that_is_named_wrongly_is_compared_with_made_names() -> None:
    text = MADE.replace("on: $robot}}", "on: r-55}}").replace("c$1: {each: r-*, ", "c1: {")
    assert problems_of(text) == ["13:20: clients.c1.on: unknown robot, 'r-55', nearest is 'r-5'"]
