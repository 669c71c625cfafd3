"""Presets of the kit: a name for a whole table, free parameters over it, and what no table can be."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Final

import jsonschema
import pytest
import yaml

from foosim.common.errors import DeploymentError
from foosim.deployment.json_schema import deployment_schema_text
from foosim.deployment.loader import apply_sets, expanded_text, load_deployment
from foosim.deployment.schema import Deployment
from foosim.library.table.settings import Table, places_between_lines, table_of
from foosim.library.table.table_presets import PRESETS
from foosim.simulation.run import rehearse

TEXT: Final = (Path(__file__).parents[2] / "deploy" / "table.yaml").read_text()
SIZES: Final = {"german": (1.2, 0.68), "us": (1.168, 0.679), "small": (1.17, 0.631)}


def deployed(*sets: str) -> Deployment:
    return load_deployment(apply_sets(TEXT, "table.yaml", sets), "table.yaml")


def table(*sets: str) -> Table:
    return table_of(deployed(*sets))


def problems(*sets: str) -> list[str]:
    with pytest.raises(DeploymentError) as raised:
        deployed(*sets)
    return str(raised.value).splitlines()


@pytest.mark.parametrize("name", PRESETS)
def test_a_preset_is_a_whole_table(name: str) -> None:
    made = table(f"table={{preset: {name}}}")
    assert (made.field.length, made.field.width) == SIZES[name]
    assert made.goal.depth > 2 * made.ball.radius and len(places_between_lines(made)) == 7


def test_the_german_one_is_that_of_the_deployed_table() -> None:
    assert table("table={preset: german, spare_balls: 2}") == table()


def test_a_us_table_has_three_figures_before_the_goal() -> None:
    us = table("table={preset: us}")
    assert us.lines["goal"].figures == 3 and us.ball.mass == 0.027 and us.rod.radius == 0.00795
    assert us.lines["midfield"].figures == 5 and us.rod.axis_height == 0.084


def test_what_is_written_counts() -> None:
    written = table("table={preset: us, ball: {mass: 21 g}}")
    usual = table("table={preset: us}")
    assert written.ball.mass == 0.021 and written.ball.radius == usual.ball.radius
    set_later = table("table={preset: us}", "table.field.width=690 mm", "table.strips={height: 5 mm, width: 20 mm}")
    assert (set_later.field.width, set_later.field.length) == (0.69, 1.168) and set_later.strips is not None
    assert table("table={preset: small}", "table.rules.match=null").rules.match is None


def test_the_canonical_text_keeps_the_name_and_the_expanded_one_has_all() -> None:
    canonical = apply_sets(TEXT, "table.yaml", ["table={preset: us}"])
    assert "table:\n  preset: us\n" in canonical
    expanded = yaml.safe_load(expanded_text(canonical, "table.yaml"))
    assert "preset" not in expanded["table"] and expanded["table"]["ball"]["mass"] == "27 g"


@pytest.mark.parametrize("name", PRESETS)
def test_a_ball_is_played_on_each(name: str) -> None:
    sets = [f"table={{preset: {name}}}", "table.rules.kickoff_delay=20 ms", "engine=bullet"]
    result = rehearse(TEXT, "table.yaml", 200, None, sets).json
    assert result["packets"]["refused"] == 0 and not result["failed"]
    assert result["clock_s"] > 0.3


def test_editors_know_presets() -> None:
    schema = json.loads(deployment_schema_text())
    editor = jsonschema.Draft202012Validator({"$defs": schema["$defs"], **schema["properties"]["table"]})
    section: dict[str, Any]
    for section, is_valid in (
        ({"preset": "us"}, True),
        ({"preset": "us", "ball": {"mass": "20 g"}}, True),
        ({"preset": "uss"}, False),
        ({"preset": "us", "bal": {"mass": "20 g"}}, False),
        ({"ball": {"mass": "20 g"}}, False),
    ):
        assert editor.is_valid(section) == is_valid, section
