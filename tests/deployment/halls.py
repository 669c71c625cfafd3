"""Small halls for tests of what is abbreviated in a deployment: their text, and what is said about a bad one."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import pytest

from foosim.common.errors import DeploymentError
from foosim.deployment.loader import Text, apply_sets
from foosim.deployment.text.yaml import locate_in, plain, read_tree

WAREHOUSE = Path(__file__).parents[2] / "deploy" / "warehouse.yaml"


def head() -> str:
    """Everything of a hall but its robots, nodes and players, in eight lines; the hall is that of the warehouse."""
    tree, _ = read_tree(WAREHOUSE.read_text(), locate_in("warehouse.yaml"))
    assert tree is not None
    return f"""\
format: 2
world: small
seed: 1
tick: 20 ms
substeps: 1
engine: pure
pace: fast
hall: {json.dumps(plain(tree)["hall"])}
"""


HEAD = head()
HEAD_LINES = HEAD.count("\n")
POSE = "{kind: pose, rate: 5 Hz, offset: 0 s}"
BATTERY = "{kind: battery, rate: 1 Hz, offset: 0 s}"
ALL_ON_ONE = "nodes: {one: {robots: ['*']}}\n"
PATROL = "foosim.library.mobile.players.warehouse_rover:Patrol"

ROVER = f"""\
templates:
  rover:
    model: rover
    sensors:
      pose: {POSE}
      battery: {BATTERY}
"""
PILOT = f"  pilot: {{class: '{PATROL}', rate: 10 Hz, on: $robot, robots: {{$robot: [pose]}}}}\n"
TWO = "robots: {r-1: {like: rover, x: 1 m, y: 2 m}, r-2: {like: rover, x: 3 m, y: 2 m}}\n"
FLEET = ROVER + "robots:\n  rover: {like: rover, count: 12, x: -15 m, y: 10 m, spacing: {x: 1.25 m, y: -50 cm}}\n"


def hall(rest: str, *, head: str = HEAD) -> str:
    """Return the text of a hall; robots are on one node unless `rest` has nodes."""
    return head + rest + ("" if "\nnodes:" in f"\n{rest}" else ALL_ON_ONE)


MADE = hall(
    ROVER
    + PILOT.replace("robots:", "hears: {'p*': [beacon, more]}, robots:")
    + "  heavy: {like: rover, charge: 50 %}\n"
    + "robots:\n  r: {like: rover, count: 9, x: -9 m, y: 2 m, spacing: {x: 2 m}}\n"
    + "  red.one: {like: heavy, x: 0 m, y: 4 m}\n"
    + "players: {p$1: {like: pilot, each: r-*}, q-$1: {like: pilot, each: red.*}}\n"
    + "clients: {c$1: {each: r-*, on: $robot}}\n"
)
"""A fleet with players and clients, and a robot beside it."""


def problems_of(text: Text, sets: Sequence[str] = (), name: str = "f") -> list[str]:
    """Return the lines of the report on a bad text; places of its own are counted from behind the head."""
    with pytest.raises(DeploymentError) as error:
        apply_sets(text, name, sets)
    assert str(error.value) == "\n".join(error.value.problems)
    return [behind_head(line, name) for line in error.value.problems]


def behind_head(line: str, name: str) -> str:
    """Return a line of a report on a file of this name, its place counted from behind the head of a hall."""
    file, number, rest = f"{line}::".split(":", 2)
    return f"{int(number) - HEAD_LINES}:{rest}".removesuffix("::") if file == name else line
