"""Meshes on trial: what fails in the throw-away process fails there alone, and is told with the file's name."""

from __future__ import annotations

import sys
from contextlib import suppress
from pathlib import Path
from typing import Final

import pytest

from foosim.deployment.loader import apply_sets, load_deployment
from foosim.deployment.schema import Deployment
from foosim.node.physics import mesh_trial
from foosim.node.physics.mesh_trial import check_meshes
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
    """A throw-away process in which building the world with the mesh of `z` does something else."""
    program = f"""if True:
        import ctypes, os, resource, sys, time
        from foosim.node.physics import mesh_trial
        real = mesh_trial._try
        def tried(deployment):
            if "z" in deployment.scenery:
                {statements}
            real(deployment)
        mesh_trial._try = tried
        mesh_trial.main()
    """
    return [sys.executable, "-c", program]


def test_good_meshes_pass() -> None:
    check_meshes(deployment(), "t", TEXT)


def test_without_meshes_there_is_no_trial() -> None:
    plain = load_deployment(TABLE.read_text(), "t")
    check_meshes(plain, "t", TABLE.read_text(), ["/absent"])


def test_what_passed_is_tried_again_only_with_another_file_or_setting(tmp_path: Path) -> None:
    tries = tmp_path / "tries"
    command = ["sh", "-c", f"echo >> {tries}; echo done"]
    exact = "robots.camera.sensors.exact={kind: ball_state, rate: 50 Hz}"
    other = apply_sets(TEXT, "t", ["nodes={n: {robots: ['*']}}", exact])
    heavier = apply_sets(TEXT, "t", ["table.ball.mass=30 g"])
    files = {**FILES, "z.obj": SHARD + b"v 9 9 8\n"}
    for text, contents, count in ((TEXT, FILES, 1), (other, FILES, 1), (heavier, FILES, 2), (TEXT, files, 3)):
        check_meshes(load_deployment(text, "t").with_assets(contents), "t", text, command)
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
        check_meshes(deployment(), "t", TEXT, broken(statements))
    assert str(refusal.value).startswith("z.obj: scenery.z failed its trial with the engine bullet: ")
    assert reason in str(refusal.value)


def test_a_trial_that_never_ends_is_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mesh_trial, "WALL_S", 0.1)
    with pytest.raises(AssetError, match=r"^t: its shapes failed its trial .* or 0\.1 s$"):
        check_meshes(deployment(), "t", TEXT, [sys.executable, "-c", "import time; time.sleep(1000)"])


def test_a_process_tries_a_world_once_whoever_computes_it_and_again_what_failed(tmp_path: Path) -> None:
    """Another file is another world."""
    count, word = tmp_path / "count", tmp_path / "word"
    command = ["sh", "-c", f"echo >> {count}; cat {word}"]

    def tries(sets: str = "tick=2 ms", files: dict[str, bytes] = FILES) -> int:
        text = apply_sets(TEXT, "t", [sets])
        with suppress(AssetError):
            check_meshes(load_deployment(text, "t").with_assets(files), "t", text, command)
        return len(count.read_text())

    word.write_text("no")
    assert [tries(), tries()] == [1, 2]
    word.write_text(mesh_trial.DONE)
    assert [tries(), tries(), tries("nodes={all: {robots: ['*']}}"), tries("players={}")] == [3, 3, 3, 3]
    assert [tries("substeps=2"), tries(files={**FILES, "a.obj": FILES["z.obj"]})] == [4, 5]
