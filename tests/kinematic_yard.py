"""A world of robots that move by kinematics, or of rigid bodies, stepped by hand."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any, Final

import yaml

from foosim.common.keyed_random import draw_key, draw_words, unit_interval
from foosim.deployment.loader import load_deployment
from foosim.node.physics.making import make_engine
from foosim.node.tick import Stepper, Work
from foosim.world.assembly.world import initial_numbers
from foosim.world.layout import Entity, build_layout

TICK_S: Final = 0.01


def yard_text(robots: Mapping[str, Any], **sections: Any) -> str:
    """Return a deployment of these robots on a floor."""
    data = {
        "format": 2,
        "world": "yard",
        "seed": 1,
        "tick": "10 ms",
        "substeps": 1,
        "engine": "pure",
        "pace": "fast",
        "scene": {"kind": "empty"},
        "robots": dict(robots),
        "nodes": {"n": {"robots": ["*"]}},
        "network": {"links": [{"id": "all", "from": "*", "to": "*"}]},
    }
    return yaml.safe_dump(json.loads(json.dumps(data | sections)), sort_keys=False)  # without anchors


class Yard:
    """The numbers of a world, and what computes them."""

    def __init__(self, text: str, files: Mapping[str, bytes] | None = None) -> None:
        """`files` are what the text names, by path."""
        deployment = load_deployment(text, "yard.yaml")
        self.deployment = deployment if files is None else deployment.with_assets(files)
        self.layout = build_layout(self.deployment)
        self.numbers = initial_numbers(self.deployment, self.layout)
        self.stepper = Stepper(self.deployment, self.layout)
        self.engine = make_engine(self.deployment, self.layout)
        self.tick = 0

    def vector(self, robot: str, field: str) -> list[float]:
        entity = self.layout[robot]
        at = entity.offsets[field]
        return self.numbers[at : at + entity.counts[field]]

    def put(self, robot: str, field: str, *values: float) -> None:
        at = self.layout[robot].offsets[field]
        self.numbers[at : at + len(values)] = values

    def step(self, ticks: int = 1) -> None:
        for _ in range(ticks):
            robots = [robot for robot in self.layout.robots if robot.is_solved]
            self.solve(robots, self.numbers, self.stepper)
            self.tick += 1
        assert not self.stepper.quarantined, self.stepper.quarantined

    def solve(self, robots: Sequence[Entity], numbers: list[float], stepper: Stepper) -> None:
        islands = tuple((robot,) for robot in robots)
        stepper.solve(self.engine, Work(self.tick, self.layout, islands, tuple(r.index for r in robots), numbers, {}))


class Together(Yard):
    """All bodies as one island."""

    def step(self, ticks: int = 1) -> None:
        everybody = tuple(self.layout.entities)
        solved = tuple(entity.index for entity in everybody)
        for _ in range(ticks):
            self.stepper.solve(self.engine, Work(self.tick, self.layout, (everybody,), solved, self.numbers, {}))
            self.tick += 1
        assert not self.stepper.quarantined, self.stepper.quarantined


def drawn(name: str, tick: int, bounds: Sequence[float]) -> list[float]:
    """Return numbers between each bound and its negative."""
    words = draw_words(draw_key(5, "drawn", name), tick)
    return [bound * (2.0 * unit_interval(word) - 1.0) for bound, word in zip(bounds, words, strict=False)]
