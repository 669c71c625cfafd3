"""Meshes on trial: what fails in the throw-away process fails there alone, and is told with the file's name."""

from __future__ import annotations

import json
import sys
from contextlib import suppress
from pathlib import Path
from typing import Final

import pytest

from foosim.deployment.loader import apply_sets, load_deployment
from foosim.deployment.schema import Deployment
from foosim.node.physics import mesh_trial
from foosim.node.physics.mesh_trial import check_models
from foosim.world.matter.mesh import AssetError

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
SHARD: Final = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\n"
THINGS: Final = (
    "{a: {shape: mesh, file: a.obj, scale: 0.02, surface: walls}, z: {shape: mesh, file: z.obj, surface: walls}, "
    "block: {shape: box, x: 1 m, length: 1 cm, width: 2 cm, height: 3 cm, surface: goal}}"
)
TEXT: Final = apply_sets(TABLE.read_text(), "t", [f"scenery={THINGS}"])
FILES: Final = {"a.obj": SHARD, "z.obj": SHARD + b"v 9 9 9\n"}


def deployment() -> Deployment:
    return load_deployment(TEXT, "t").with_assets(FILES)


def broken(statements: str) -> list[str]:
    """A throw-away process in which building the world with the mesh of `z` or the body `rock` does something else."""
    program = f"""if True:
        import ctypes, os, resource, sys, time
        from foosim.node.physics import mesh_trial
        real, real_body = mesh_trial._try, mesh_trial._try_body
        def tried(deployment):
            if "z" in deployment.scenery:
                {statements}
            real(deployment)
        def tried_body(deployment, entity):
            if entity.name in ("rock", "arm"):
                {statements}
            real_body(deployment, entity)
        mesh_trial._try, mesh_trial._try_body = tried, tried_body
        mesh_trial.main()
    """
    return [sys.executable, "-c", program]


def test_good_meshes_pass() -> None:
    check_models(deployment(), "t", TEXT)


def test_without_meshes_there_is_no_trial() -> None:
    plain = load_deployment(TABLE.read_text(), "t")
    check_models(plain, "t", TABLE.read_text(), ["/absent"])


def test_what_passed_is_tried_again_only_with_another_file_or_setting(tmp_path: Path) -> None:
    tries = tmp_path / "tries"
    command = ["sh", "-c", f"echo >> {tries}; echo done"]
    exact = "robots.camera.sensors.exact={kind: ball_state, rate: 50 Hz}"
    other = apply_sets(TEXT, "t", ["nodes={n: {robots: ['*']}}", exact])
    heavier = apply_sets(TEXT, "t", ["table.ball.mass=30 g"])
    files = {**FILES, "z.obj": SHARD + b"v 9 9 8\n"}
    for text, contents, count in ((TEXT, FILES, 1), (other, FILES, 1), (heavier, FILES, 2), (TEXT, files, 3)):
        check_models(load_deployment(text, "t").with_assets(contents), "t", text, command)
        assert len(tries.read_text()) == count


@pytest.mark.parametrize(
    ("statements", "reason"),
    [
        ("ctypes.string_at(0)", "the process was ended by SIGSEGV"),
        ("resource.setrlimit(resource.RLIMIT_CPU, (1, -1)) or [None for _ in iter(int, 1)]", "5 s of processor time"),
        ("bytearray(1 << 30)", "MemoryError"),
        ("os.open('/etc/passwd', os.O_RDONLY)", "the process ended with 1"),
    ],
)
def test_a_mesh_that_fails_is_named_with_the_reason(statements: str, reason: str) -> None:
    with pytest.raises(AssetError) as refusal:
        check_models(deployment(), "t", TEXT, broken(statements))
    assert str(refusal.value).startswith("z.obj: scenery.z failed its trial with the engine bullet: ")
    assert reason in str(refusal.value)


def test_a_trial_that_never_ends_is_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mesh_trial, "WALL_S", 0.1)
    with pytest.raises(AssetError, match=r"^t: its shapes failed its trial .* or 0\.1 s$"):
        check_models(deployment(), "t", TEXT, [sys.executable, "-c", "import time; time.sleep(1000)"])


def test_a_process_tries_a_world_once_whoever_computes_it_and_again_what_failed(tmp_path: Path) -> None:
    """Another file is another world."""
    count, word = tmp_path / "count", tmp_path / "word"
    command = ["sh", "-c", f"echo >> {count}; cat {word}"]

    def tries(sets: str = "tick=2 ms", files: dict[str, bytes] = FILES) -> int:
        text = apply_sets(TEXT, "t", [sets])
        with suppress(AssetError):
            check_models(load_deployment(text, "t").with_assets(files), "t", text, command)
        return len(count.read_text())

    word.write_text("no")
    assert [tries(), tries()] == [1, 2]
    word.write_text(mesh_trial.DONE)
    assert [tries(), tries(), tries("nodes={all: {robots: ['*']}}"), tries("players={}")] == [3, 3, 3, 3]
    assert [tries("substeps=2"), tries(files={**FILES, "a.obj": FILES["z.obj"]})] == [4, 5]


# --- hulls -----------------------------------------------------------------------------------------------------------

CORNERS: Final = [[0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 0.5]]
ARM: Final = b"""<robot name="arm">
  <link name="base"><inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
    <collision><geometry><mesh filename="shard.obj"/></geometry></collision></link>
</robot>"""


def rocks() -> tuple[str, Deployment]:
    """Hulls of two kinds, one of which twice, and an arm from a file with a mesh."""
    rock = {"model": "hull", "corners": [[f"{side} m" for side in corner] for corner in CORNERS], "mass": "1 kg"}
    flat = rock | {"corners": [*rock["corners"][:3], ["0 m", "0 m", "20 cm"]]}
    objects = {
        "flat": {**flat, "at": {"x": "3 m", "z": "1 m"}},
        "rock": {**rock, "at": {"z": "1 m"}},
        "rock2": {**rock, "at": {"x": "6 m", "z": "1 m"}},
    }
    arm = {"model": "urdf", "file": "arm.urdf", "fixed": True, "at": {"x": "-5 m"}}
    data = {
        "format": 2,
        "world": "rocks",
        "seed": 1,
        "tick": "10 ms",
        "substeps": 2,
        "engine": "mujoco",
        "pace": "fast",
        "scene": {"kind": "empty"},
        "objects": objects,
        "robots": {"arm": arm},
        "nodes": {"n": {"robots": ["arm"]}},
        "network": {"links": [{"id": "all", "from": "*", "to": "*"}]},
    }
    text = json.dumps(data)
    return text, load_deployment(text, "t").with_assets({"arm.urdf": ARM, "shard.obj": SHARD})


def test_each_kind_of_hull_is_tried_once() -> None:
    text, made = rocks()
    assert list(mesh_trial._tries(made, "t")) == ["robots.arm", "objects.flat", "objects.rock"]
    check_models(made, "t", text)


@pytest.mark.parametrize(("who", "where"), [("arm", "arm.urdf: robots.arm"), ("rock", "t: objects.rock")])
def test_a_hull_that_crashes_the_engine_is_named(who: str, where: str) -> None:
    text, made = rocks()
    with pytest.raises(AssetError) as refusal:
        check_models(made, "t", text, broken(f"entity.name == {who!r} and ctypes.string_at(0)"))
    assert str(refusal.value) == f"{where} failed its trial with the engine bullet: the process was ended by SIGSEGV"


def test_a_hull_that_never_ends_is_ended() -> None:
    text, made = rocks()
    soon = "resource.setrlimit(resource.RLIMIT_CPU, (1, -1))"
    with pytest.raises(AssetError, match=r"^t: objects\.rock failed its trial .* 5 s of processor time"):
        check_models(made, "t", text, broken(f"entity.name == 'rock' and ({soon} or all(True for _ in iter(int, 1)))"))
