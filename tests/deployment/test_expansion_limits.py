"""Hostile files: what is abbreviated cannot become so much that it takes the memory or the time of who reads it."""

from __future__ import annotations

from pathlib import Path

import pytest

from foosim.common import limits
from foosim.common.errors import DeploymentError
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.deployment.text.expand import expand
from foosim.deployment.text.report import PROBLEMS_MAX
from foosim.deployment.text.yaml import locate_in, plain, read_tree
from tests.deployment.halls import HEAD, PATROL, POSE, ROVER, hall, problems_of

MEMORY_BYTES_MAX = 64_000_000
LARGE = HEAD.replace('"length": "40 m", "width": "25 m"', '"length": "1000 m", "width": "1000 m"')


def rows(count: int, length: int) -> str:
    """Rows of rovers 1 m apart, in a large hall."""
    row = "  r{0}: {{like: rover, count: {1}, x: -490 m, y: {2} m, spacing: {{x: 1.5 m}}}}\n"
    return "robots:\n" + "".join(row.format(number, length, number - 490) for number in range(count))


def pilots(**more: str) -> str:
    """A template of players for each robot, with more keys."""
    keys = "".join(f", {key}: {value}" for key, value in more.items())
    return f"  pilot: {{class: '{PATROL}', rate: 10 Hz, on: $robot{keys}}}\n"


EACH = "players: {p$1-$2: {like: pilot, each: r*-*}}\n"
WIDE = ", ".join(f"k{number}: 1" for number in range(6000))
CHAIN = "".join(
    f"  t{n}: {{like: t{n + 1}, {', '.join(f'k{n}x{number}: 1' for number in range(100))}}}\n" for n in range(15)
)
GLOBS = ", ".join(f"'*{number}*'" for number in range(6000))
LINKS = "".join(
    f"  - {{id: l{n}, from: [{', '.join(repr(f'*{10 * n + i}') for i in range(10))}], to: '*'}}\n" for n in range(500)
)
TOO_MUCH = f"templates and counts make more than {limits.EXPANDED_NODES_MAX} values and keys"
COMPARISONS_MAX = 100_000
TOO_MANY = f"more than {COMPARISONS_MAX} comparisons of names with selectors"

HOSTILE = {
    "a million": (ROVER + "robots: {r: {like: rover, count: 1000000}}\n", "not a whole number from 1 to 4096"),
    "count of count": (
        ROVER + "robots: {r: {like: rover, count: 4}, r-1: {count: 4000}}\n", "a count of what the entry r makes"
    ),
    "a wide template": (f"templates: {{t: {{{WIDE}}}}}\nrobots: {{r: {{like: t, count: 4096}}}}\n", TOO_MUCH),
    "a wide template with more": (
        f"templates: {{t: {{{WIDE}}}}}\nrobots: {{{', '.join(f'r{n}: {{like: t, z: 1}}' for n in range(99))}}}\n",
        TOO_MUCH,
    ),
    "a chain of templates": (
        f"templates:\n{CHAIN}  t15: {{a: 1}}\nrobots: {{r: {{like: t0, count: 4096}}}}\n",
        TOO_MUCH,
    ),
    "many sensors": (
        ROVER + "".join(f"      s{n}: {POSE}\n" for n in range(12)) + rows(8, 512), TOO_MUCH
    ),
    "all robots for each": (ROVER + pilots(robots="{'*': [pose]}") + rows(2, 500) + EACH, TOO_MUCH),
    "selectors of nodes": (
        ROVER + rows(8, 512) + f"nodes: {{n: {{robots: [{GLOBS}]}}}}\n", TOO_MANY
    ),
    "selectors of links": (ROVER + rows(8, 512) + f"network:\n  links:\n{LINKS}", TOO_MANY),
    "a template that is wrong for each": (
        ROVER.replace("5 Hz", "5 Hx").replace("1 Hz, offset", "1 Hz, ofset") + rows(8, 512), "not a rate"
    ),
    "unknown robots for each": (
        ROVER + pilots(robots="{x-$1-$2: [pose], y-$1-$2: [pose]}") + rows(2, 512) + EACH, "unknown robot, 'x-0-1'"
    ),
    "nothing heard by each": (
        ROVER + pilots(hears="{x-$2: [a]}") + rows(2, 512) + EACH, "a selector that matches no other endpoint"
    ),
    "arrivals of all": (
        ROVER + pilots(act="arrival", hears="{'*': [a]}", arrivals="{'p*': [b]}") + rows(2, 512) + EACH,
        "no channel that it hears of p*: valid are a",
    ),
    "all at one place": (
        ROVER + "robots: {r: {like: rover, count: 4096, x: 1 m, y: 1 m}}\n", "the rover starts in the rover r-1"
    ),
}  # fmt: skip


def resident_bytes(which: str) -> int:
    """Return how much of this process is in memory now (`VmRSS`), or was at most since that was cleared (`VmHWM`)."""
    (line,) = [line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith(which)]
    return int(line.split()[1]) * 1024


@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_file_is_refused_in_bounded_memory(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    rest, problem = HOSTILE[name]
    if problem == TOO_MANY:
        monkeypatch.setattr(limits, "COMPARISONS_MAX", COMPARISONS_MAX)
    text = hall(rest, head=LARGE)
    assert len(text) <= limits.DEPLOYMENT_BYTES_MAX
    Path("/proc/self/clear_refs").write_text("5")  # to trace each allocation takes seven times as long
    before = resident_bytes("VmRSS")
    with pytest.raises(DeploymentError) as error:
        load_deployment(text, name)
    assert resident_bytes("VmHWM") - before < MEMORY_BYTES_MAX
    assert any(problem in line for line in error.value.problems)
    assert len(error.value.problems) <= PROBLEMS_MAX + 1


def test_one_problem_of_thousands_of_robots_is_one_line() -> None:
    assert problems_of(hall(ROVER.replace("5 Hz", "5 Hx") + rows(8, 512), head=LARGE)) == [
        "5:32: templates.rover.sensors.pose.rate: not a rate (a number and one of Hz, kHz, mHz), '5 Hx', "
        "nearest is '5 Hz'"
    ]


def test_as_many_robots_as_are_allowed_are_loaded_from_a_short_text() -> None:
    text = hall(ROVER + rows(8, limits.ENTITIES_MAX // 8), head=LARGE)
    assert len(text) < 2_000
    assert len(load_deployment(text, "f").robots) == limits.ENTITIES_MAX
    assert problems_of(text.replace("nodes:", "  s: {like: rover, x: 0 m, y: 0 m}\nnodes:")) == [
        "8:28: robots.r0.count: with it there are 4097 robots, more than 4096, 512"
    ]


def test_a_thousand_robots_with_players_fit_the_canonical_text() -> None:
    text = hall(ROVER + pilots() + rows(2, 500) + EACH, head=LARGE)
    canonical = apply_sets(text, "f", [])
    deployment = load_deployment(canonical, "f")
    assert (len(deployment.robots), len(deployment.players)) == (1000, 1000)
    assert len(canonical) < 2_000


def test_what_many_have_in_common_is_expanded_to_one_node() -> None:
    tree, _ = read_tree(hall(ROVER + rows(2, 500)), locate_in("f"))
    assert tree is not None
    expanded = expand(tree).tree
    assert expanded is not None
    robots = getattr(expanded, "values")["robots"].values  # noqa: B009
    assert len({id(robot.values["sensors"]) for robot in robots.values()}) == 1
    data = plain(expanded)
    assert len({id(robot["sensors"]) for robot in data["robots"].values()}) == 1


def test_templates_are_limited_in_number() -> None:
    many = "".join(f"  t{number}: {{}}\n" for number in range(limits.TEMPLATES_MAX + 1))
    assert problems_of(hall(f"templates:\n{many}robots: {{}}\n")) == ["2:3: templates: more than 256 templates, 257"]


def test_the_problems_of_an_expansion_are_bounded() -> None:
    robots = "".join(f"  r{number}: {{like: no}}\n" for number in range(2_000))
    found = problems_of(hall(f"robots:\n{robots}"))
    assert len(found) == PROBLEMS_MAX + 1
    tree, _ = read_tree(hall(f"robots:\n{robots}"), locate_in("f"))
    assert tree is not None and len(expand(tree).problems) == PROBLEMS_MAX + 1
    assert found[0] == "2:14: robots.r0.like: unknown template, 'no'"
