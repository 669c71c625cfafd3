"""Trials of the scenery's meshes with the engine in a throw-away process, before a run.

`world.mesh_files` has checked the files before; but Bullet may still crash, hang or use up the
memory. The throw-away process has 1 GiB of address space, 5 s of processor time for each, and can open nothing. It
builds the world with one mesh alone, lets a free body fall on it and start inside of it, 100 ticks in all. If it
fails, the run does not begin, and the message names the file. A process that rehearses a
world several times tries it once.
"""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
from collections import deque
from collections.abc import Sequence
from hashlib import sha256
from math import isfinite
from typing import Final

import foosim.world.mesh_files  # noqa: F401  # before the limits: the trial can open no file
from foosim.deployment.loader import check_engine, load_deployment
from foosim.deployment.schema import Deployment
from foosim.node.physics.interface import Engine, IslandEngine
from foosim.node.physics.making import engine_of, make_engine
from foosim.protocol.codec import decode_any, encode
from foosim.world.assembly.world import build_scene, initial_numbers
from foosim.world.layout import Entity, build_layout
from foosim.world.matter.mesh import AssetError, Mesh
from foosim.world.scene import Body, Shape, Vector, place, shape_box
from foosim.world.scenery import SceneryMesh
from foosim.world.spec import WorldSpec

TICKS: Final = 100
CPU_S: Final = 5
ADDRESS_SPACE_BYTES: Final = 1 << 30
WALL_S: Final = 300.0
"""The limit of wall time, for a process that sleeps."""
DONE: Final = "done"
_passed: Final = deque[bytes](maxlen=100)
"""Digests of the last worlds that passed in this process: the engine is deterministic."""
COMMAND: Final = (sys.executable, "-P", "-m", "foosim.node.physics.mesh_trial")


def check_shapes(deployment: Deployment, name: str, text: str) -> None:
    """Try the engine of a deployment, and its files: meshes of scenery, and bodies. Files must have been read.

    `text` is that of the deployment. Raises AssetError, and DeploymentError for an engine that this machine lacks.
    """
    check_engine(text, name, deployment)
    layout = build_layout(deployment)
    if layout.couples:
        make_engine(deployment, layout).close()
    else:
        check_meshes(deployment, name, text)


def check_meshes(deployment: Deployment, name: str, text: str, command: Sequence[str] = COMMAND) -> None:
    """Try the meshes of a deployment, whose text is given, with its engine. Its files must have been read.

    Raises AssetError for a mesh that fails.
    """
    tries = {f"scenery.{thing}": f"{mesh.file}: scenery.{thing}" for thing, mesh in _meshes(deployment).items()}
    if not tries:
        return
    world = _digest(deployment, command)
    if world in _passed:
        return
    one_thread = {"OPENBLAS_NUM_THREADS": "1"}  # of which each takes address space
    try:
        ended = subprocess.run(
            command,
            input=encode([name, text, dict(deployment.asset_files)]),
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            timeout=WALL_S,
            env={**os.environ, **one_thread},
            check=False,
        )
        code, lines = ended.returncode, ended.stdout.decode(errors="replace").splitlines()
    except subprocess.TimeoutExpired as late:
        code, lines = -signal.SIGALRM, (late.stdout or b"").decode(errors="replace").splitlines()
    if code == 0 and lines and lines[-1] == DONE:
        _passed.append(world)
        return
    tried = [line for line in lines if line in tries]
    output = [line for line in lines if line not in tries and line != DONE]
    where = tries[tried[-1]] if tried else f"{name}: its shapes"
    raise AssetError(f"{where} failed its trial with the engine {deployment.engine}: {_reason(code, output)}")


def _digest(deployment: Deployment, command: Sequence[str]) -> bytes:
    """Return a digest of the inputs of a trial: the world without its sensors and nodes, and its files."""
    world = {field: getattr(deployment, field) for field in WorldSpec.model_fields}
    world["robots"] = {name: robot.model_copy(update={"sensors": {}}) for name, robot in deployment.robots.items()}
    found = sha256(repr([command, world]).encode())
    for path, content in sorted(deployment.asset_files.items()):
        found.update(f"\0{path}\0{len(content)}\0".encode() + content)
    return found.digest()


def _meshes(deployment: Deployment) -> dict[str, SceneryMesh]:
    """Return the meshes that free bodies meet: motions meet the box around one, which is checked."""
    found = {thing: spec for thing, spec in sorted(deployment.scenery.items()) if isinstance(spec, SceneryMesh)}
    return found if build_layout(deployment).free else {}


def _reason(code: int, output: Sequence[str]) -> str:
    if output:
        return output[-1]
    if code in (-signal.SIGXCPU, -signal.SIGALRM):
        return f"it took more than {CPU_S} s of processor time, or {WALL_S:g} s"
    return f"the process was ended by {signal.Signals(-code).name}" if code < 0 else f"the process ended with {code}"


# --- in the throw-away process ---------------------------------------------------------------------------------------


def main() -> None:
    """Try the meshes on standard input; print each thing's name before its trial, and `DONE` at the end."""
    report = os.dup(1)
    nothing = os.open(os.devnull, os.O_RDWR)
    os.dup2(nothing, 1)  # where Bullet prints
    name, text, files = decode_any(tuple[str, str, dict[str, bytes]], sys.stdin.buffer.read())
    deployment = load_deployment(text, name).with_assets(files)
    bare = deployment.model_copy(update={"scenery": {}})
    engine_of(bare, build_layout(deployment)).close()  # for its imports
    _limit(resource.RLIMIT_CORE, 0)
    _limit(resource.RLIMIT_NOFILE, 0)
    _limit(resource.RLIMIT_AS, ADDRESS_SPACE_BYTES)
    for thing, mesh in _meshes(deployment).items():
        os.write(report, f"scenery.{thing}\n".encode())
        used = resource.getrusage(resource.RUSAGE_SELF)
        _limit(resource.RLIMIT_CPU, int(used.ru_utime + used.ru_stime) + 1 + CPU_S)
        try:
            _try(deployment.model_copy(update={"scenery": {thing: mesh}}).with_assets(files))
        except (AssertionError, MemoryError, ArithmeticError) as error:
            os.write(report, f"{type(error).__name__} {' '.join(str(error).split())[:200]}\n".encode())
            raise
    os.write(report, f"{DONE}\n".encode())


def _limit(what: int, value: int) -> None:
    resource.setrlimit(what, (value, resource.getrlimit(what)[1]))


def _try(deployment: Deployment) -> None:
    """Build the world with its one mesh and step it with each free body: from above, and from within a triangle."""
    layout = build_layout(deployment)
    engine = engine_of(deployment, layout)
    assert not isinstance(engine, IslandEngine), engine
    (shape,) = deployment.scenery_shapes()
    assert isinstance(shape.geometry, Mesh), shape
    low, high = shape_box(shape)
    bodies = build_scene(deployment, layout).bodies
    for entity in layout.entities:
        if entity.is_rigid and bodies[entity.name].is_free:
            top = ((low[0] + high[0]) / 2, (low[1] + high[1]) / 2, high[2] + _radius(bodies[entity.name]))
            for start in (top, _inside(shape, shape.geometry)):
                _drop(deployment, engine, entity, initial_numbers(deployment, layout), start)
    engine.close()


def _radius(body: Body) -> float:
    """Return the distance from a body's middle down to its lowest point, at rest."""
    return -shape_box(body.links[0].shapes[0])[0][2]


def _inside(shape: Shape, mesh: Mesh) -> Vector:
    """Return the middle of the first triangle, in the world."""
    x, y, z = mesh.vertices[mesh.triangles[0]].mean(axis=0).tolist()
    position, _ = place(Shape(mesh, shape.surface, shape.colour, (x, y, z)), shape.position, shape.orientation)
    return position


def _drop(deployment: Deployment, engine: Engine, body: Entity, numbers: list[float], start: Vector) -> None:
    """Let a free body, which is at rest in a world's numbers, start from another place."""
    at = body.offsets["position"]
    numbers[at : at + 3] = start
    for _ in range(TICKS // 2):
        engine.load((body,), numbers)
        engine.step(deployment.substeps)
        engine.read((body,), numbers)
        if not all(isfinite(number) for number in numbers):
            raise ArithmeticError("the position of a body that touches it is not finite")


if __name__ == "__main__":
    main()
