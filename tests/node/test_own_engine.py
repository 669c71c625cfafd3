"""Engines by their names: foosim's own, without what they need; one of another package, in a whole run."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Final

import pytest

from foosim.common.errors import DeploymentError
from foosim.deployment.json_schema import deployment_schema
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.library.table.settings import table_of
from foosim.simulation.run import rehearse
from foosim.world.assembly import world
from foosim.world.assembly.world import initial_numbers
from foosim.world.component_types import registry
from foosim.world.component_types.descriptions import ENGINES
from foosim.world.layout import build_layout
from foosim.world.scene import Scene, Sphere, Vector
from tests.placing import place_ball
from tests.shared_engine import make_shared_engine

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
TEXT: Final = TABLE.read_text()
STILL: Final = '''
from foosim.world.component_types.descriptions import ENGINES, Engine


class Still:
    """All that it has is where bodies were, and one of them moves."""

    def __init__(self, deployment, layout):
        self.layout = layout

    def load(self, entities, state):
        self.state = list(state)

    def command(self, entities, commands):
        self.commands = dict(zip([entity.name for entity in entities], commands, strict=True))

    def step(self, substeps):
        for name, ((speed, force), _) in self.commands.items():
            self.state[self.layout[name].offsets["joint_efforts"]] = force
        if "ball" in self.layout:
            self.state[self.layout["ball"].offsets["position"]] += 0.0001

    def read(self, entities, state):
        for entity in entities:
            state[entity.start : entity.split] = self.state[entity.start : entity.split]

    def close(self):
        """It holds nothing."""


ENGINES["still"] = Engine("still", "own_still:Still")
'''


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """What pip leaves of a package whose entry point is a module with an engine."""
    known = dict(ENGINES)
    (tmp_path / "own_still.py").write_text(STILL)
    monkeypatch.syspath_prepend(str(tmp_path))
    about = tmp_path / "still-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: still\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text("[foosim.world]\nstill = own_still\n")
    registry._entry_points.cache_clear()
    registry._loaded.clear()
    yield
    ENGINES.clear()
    ENGINES.update(known)


def problem(*sets: str) -> str:
    with pytest.raises(DeploymentError) as error:
        apply_sets(TEXT, TABLE.name, sets)
    return str(error.value)


def test_names_of_engines_import_nothing_that_they_need() -> None:
    code = """
import json, sys
from foosim.world.component_types import registry
from foosim.world.component_types.descriptions import ENGINES
heavy = ("numpy", "pybullet", "foosim.node.physics.interface", "foosim.deployment.schema")
print(json.dumps([*registry.engines(), *[name for name in heavy if name in sys.modules]]))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert json.loads(done.stdout) == ["bullet", "mujoco", "pure"]


@pytest.mark.usefixtures("installed")
def test_an_engine_of_ones_own_computes_a_run_and_is_in_its_schema_and_messages() -> None:
    assert "engine: unknown engine (there are: bullet, mujoco, pure, still), 'stil', nearest is 'still'" in problem(
        "engine=stil"
    )
    result = rehearse(TEXT, TABLE.name, 20, 2, ["engine=still"])
    assert result.json["ticks"] == 20 and result.json["failed"] is False
    deployment = load_deployment(apply_sets(TEXT, TABLE.name, ["engine=still"]), TABLE.name)
    assert type(make_shared_engine(deployment, build_layout(deployment))).__module__ == "own_still"
    enums = [deployment_schema(installed=theirs)["properties"]["engine"]["enum"] for theirs in (False, True)]
    assert enums == [["bullet", "mujoco", "pure"], ["bullet", "mujoco", "pure", "still"]]
    mesh = "scenery={shard: {shape: mesh, file: shard.obj}}"
    assert "scenery.shard.shape: the engine still has no meshes" in problem("engine=still", mesh)
    assert "engine: not a text, 3" in problem("engine=3")


@pytest.mark.parametrize("engine", ["bullet", "pure"])
def test_what_is_not_rigid_is_no_engines(monkeypatch: pytest.MonkeyPatch, engine: str) -> None:
    """A camera with a body, which the engine neither builds nor minds when it is asked to load it."""
    deployment = load_deployment(apply_sets(TEXT, TABLE.name, [f"engine={engine}"]), TABLE.name)
    layout = build_layout(deployment)
    scene = world.build_scene(deployment, layout)
    strange = Scene({**scene.bodies, "camera": scene.bodies["red.goal"]}, scene.scenery)
    module = {"bullet": "bullet_engine", "pure": "pure_engine"}[engine]
    monkeypatch.setattr(f"foosim.node.physics.{module}.build_scene", lambda *_: strange)
    made = make_shared_engine(deployment, layout)
    numbers = [0.0] * layout.size
    made.load([layout["camera"]], numbers)
    made.step(deployment.substeps)
    made.read([layout["camera"]], numbers)
    made.close()
    assert numbers == [0.0] * layout.size


@pytest.mark.parametrize("engine", ["bullet", "pure"])
def test_free_bodies_have_sizes_of_their_own(monkeypatch: pytest.MonkeyPatch, engine: str) -> None:
    """A sphere of twice the radius and four times the mass: both bounce off the wall where they touch it, and meet
    with the speeds of their masses, (m v + M V -+ e M (v - V)) / (m + M)."""
    sets = [f"engine={engine}", "table.gravity=0 m/s2", "table.contact_erp=0", "table.spare_balls=1"]
    deployment = load_deployment(apply_sets(TEXT, TABLE.name, sets), TABLE.name)
    layout = build_layout(deployment)
    scene = world.build_scene(deployment, layout)
    (link,), radius = scene.bodies["ball-2"].links, 2 * table_of(deployment).ball.radius
    shape = replace(link.shapes[0], geometry=Sphere(radius))
    inertia = 0.4 * 4 * link.mass * radius * radius
    heavy = replace(link, shapes=(shape,), mass=4 * link.mass, inertia=(inertia, inertia, inertia))
    strange = Scene({**scene.bodies, "ball-2": replace(scene.bodies["ball-2"], links=(heavy,))}, scene.scenery)
    module = {"bullet": "bullet_engine", "pure": "pure_engine"}[engine]
    monkeypatch.setattr(f"foosim.node.physics.{module}.build_scene", lambda *_: strange)
    made = make_shared_engine(deployment, layout)
    both = [layout["ball"], layout["ball-2"]]

    def after(places: list[Vector], velocities: list[Vector], ticks: int) -> list[float]:
        """The speeds along x and y of both, one after the other."""
        numbers = initial_numbers(deployment, layout)
        for entity, place, velocity in zip(both, places, velocities, strict=True):
            place_ball(numbers, entity, place, velocity)
        for _ in range(ticks):
            made.load(both, numbers)
            made.step(deployment.substeps)
            made.read(both, numbers)
        starts = [entity.offsets["linear_velocity"] for entity in both]
        return [numbers[start + axis] for start in starts for axis in (0, 1)]

    surfaces, wall = table_of(deployment).surfaces, table_of(deployment).field.width / 2
    small = table_of(deployment).ball.radius
    short_of = [(-0.3, wall - small - 0.0201, 0.07), (0.3, wall - radius - 0.0201, 0.07)]
    assert after(short_of, [(0.0, 1.0, 0.0)] * 2, 10) == [0.0, 1.0, 0.0, 1.0]
    bounced = after(short_of, [(0.0, 1.0, 0.0)] * 2, 11)
    assert bounced == pytest.approx([0.0, -surfaces.walls.restitution] * 2, abs=1e-3)
    apart = small + radius + 0.01
    met = after([(0.0, 0.0, 0.07), (apart, 0.0, 0.07)], [(1.0, 0.0, 0.0), (-1.0, 0.0, 0.0)], 5)
    parting = 2.0 * surfaces.balls.restitution
    mean = (1.0 - 4.0) / 5.0
    assert met == pytest.approx([mean - 0.8 * parting, 0.0, mean + 0.2 * parting, 0.0], abs=1e-3)
    made.close()
