"""A public robot on a floor, by the entry that `foosim urdf` proposes, stepped by hand."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, Self

import pytest
import yaml

from foosim import Simulation
from foosim.deployment.assets import asset_folder, pin_assets, read_robot
from foosim.deployment.loader import load_deployment
from foosim.world.bodies.urdf_text import snippet
from foosim.world.clearance.convex import convex_parts
from foosim.world.frame import Frame
from foosim.world.kinematics import forward_kinematics
from foosim.world.scene import ORIGIN, Body, place
from tests.corpus.table import folder_of, foreign_version

NAME: Final = "corpus.yaml"
TICK_S: Final = 0.01
SUBSTEPS: Final = 8
"""A motor yields in proportion to the substep: legs that carry a robot are 3e-4 rad off with 4, 1.8e-4 with 8."""


def needed(which: str) -> Path:
    """Return the folder of a set of robots. Without it, and with another version than the table has, a test is skipped;
    with CI in the environment it fails, but that no pybullet is published for later Pythons than 3.11."""
    folder = folder_of(which)
    other = foreign_version(which)
    if folder is None or other:
        reason = f"{other or f'{which} is not installed'}: `make robots` installs it, on Python 3.11"
        if os.environ.get("CI") and sys.version_info < (3, 12):
            pytest.fail(reason)
        pytest.skip(reason)
    return folder


class Running:
    """A robot of the corpus in a world of its own."""

    def __init__(self, which: str, path: str, entry: Mapping[str, Any] | None = None) -> None:
        """`entry` has what differs from the proposed one."""
        file = needed(which) / path
        ((self.name, proposed),) = yaml.safe_load(snippet(read_robot(file, None)))["robots"].items()
        text = {
            "format": 2,
            "world": "corpus",
            "seed": 1,
            "tick": f"{TICK_S * 1e3:g} ms",
            "substeps": SUBSTEPS,
            "engine": "mujoco",
            "pace": "fast",
            "scene": {"kind": "empty"},
            "robots": {self.name: {**proposed, **(entry or {})}},
            "nodes": {"one": {"robots": [self.name]}},
            "network": {"links": [{"id": "all", "from": "*", "to": "*"}]},
        }
        pinned, files = pin_assets(
            yaml.safe_dump(json.loads(json.dumps(text)), sort_keys=False), NAME, asset_folder(file)
        )
        self.simulation = Simulation(load_deployment(pinned, NAME).with_assets(files))
        self.body: Body = self.simulation.scene.bodies[self.name]
        self.joints = self.body.joint_names
        """The names of those that move."""
        mimics = {name: link.mimic for name, link in zip(self.joints, self.body.joints, strict=True)}
        self.led = [name for name, mimic in mimics.items() if mimic is None]
        self.followers = {
            name: (self.body.links[mimic.leader].joint_name, mimic.ratio, mimic.offset)
            for name, mimic in mimics.items()
            if mimic is not None
        }
        """By joint: the one that it follows, their ratio, and the offset."""

    def stand(self, positions: Sequence[float]) -> None:
        """Begin in a stance: these positions of its joints, its lowest point on the floor, at rest."""
        self.put(joint_positions=positions)
        low = min(self._lows())
        x, y, z = self["position"]
        self.put(position=(x, y, z - low))

    def _lows(self) -> Iterator[float]:
        """Yield the lowest point of each shape (m)."""
        frame = self.simulation.frame
        poses = forward_kinematics(self.body, frame.layout[self.name], frame.numbers)
        for link, (_, position, orientation) in zip(self.body.links, poses, strict=True):
            for shape in link.shapes:
                at = place(shape, position, orientation)
                for part in convex_parts(shape, *at, ORIGIN, ORIGIN):
                    yield part.farthest((0.0, 0.0, -1.0))[2]

    def turned(self) -> list[float]:
        """Return where its wheels are (rad)."""
        positions = zip(self.joints, self["joint_positions"], strict=True)
        return [position for joint, position in positions if "wheel" in joint]

    def put(self, **fields: Sequence[float]) -> None:
        """Begin with other numbers of its fields."""
        frame = self.simulation.frame
        numbers = [*frame.numbers]
        for field, values in fields.items():
            at = frame.layout[self.name].offsets[field]
            numbers[at : at + len(values)] = values
        self.simulation.reset(Frame(frame.tick, frame.layout, None, frame.outboxes, numbers=numbers))

    def __getitem__(self, field: str) -> list[float]:
        """Return the numbers of one of its fields, now."""
        entity = self.simulation.frame.layout[self.name]
        at = entity.offsets[field]
        return self.simulation.frame.numbers[at : at + entity.counts[field]]

    def step(self, seconds: float, command: Any = None) -> None:
        """Send a command, and compute some time."""
        self.simulation.step({} if command is None else {self.name: command}, round(seconds / TICK_S))
        assert not self.simulation.quarantined, self.simulation.quarantined

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.simulation.close()
