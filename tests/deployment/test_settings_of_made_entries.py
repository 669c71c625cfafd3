"""Settings of what templates, counts and `each` make: they become keys of entries in the text, which stays short."""

from __future__ import annotations

from typing import Any

import pytest

from foosim.deployment.loader import apply_sets, expanded_text, load_deployment
from foosim.deployment.text.yaml import locate_in, plain, read_tree
from tests.deployment.halls import MADE, problems_of


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
